#include "yaml_writer.h"

#include <cmath>

#include "number_text.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
std::string yaml_number(double value)
{
    if (!std::isfinite(value)) return std::isnan(value) ? ".nan" : value > 0 ? ".inf" : "-.inf";
    std::string text = number_text(value);
    // YAML 1.1 takes 1e-05 for text: it wants a point.
    const auto exponent = text.find('e');
    if (exponent != std::string::npos && text.find('.') == std::string::npos) text.insert(exponent, ".0");
    return text;
}

std::string quoted(const std::string& text)
{
    std::string out = "\"";
    for (const char c : text)
    {
        if (c == '"' || c == '\\') out += '\\';
        out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
    return out + "\"";
}

/// Names are plain; labels such as `0.01 m` are not.
std::string key_text(const std::string& key)
{
    const bool plain =
        key.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_-0123456789") ==
            std::string::npos &&
        key.find_first_of("0123456789-") != 0 && key.size() > 1;
    return plain ? key : quoted(key);
}
}  // namespace

void YamlWriter::line(const std::string& content)
{
    text_ += item_begins_ ? std::string(indent_ - 2, ' ') + "- " : std::string(indent_, ' ');
    text_ += content + "\n";
    item_begins_ = false;
}

void YamlWriter::open_map(const std::string& key)
{
    line(key_text(key) + ":");
    indent_ += 2;
}
void YamlWriter::open_list(const std::string& key)
{
    open_map(key);
}
void YamlWriter::open_item()
{
    indent_ += 2, item_begins_ = true;
}
void YamlWriter::close()
{
    indent_ -= 2;
}

void YamlWriter::value(const std::string& key, double number)
{
    line(key_text(key) + ": " + yaml_number(number));
}
void YamlWriter::value(const std::string& key, size_t number)
{
    line(key_text(key) + ": " + std::to_string(number));
}
void YamlWriter::value(const std::string& key, const std::string& text)
{
    line(key_text(key) + ": " + quoted(text));
}
void YamlWriter::list(const std::string& key, const std::vector<std::string>& texts)
{
    std::string items;
    for (const auto& text : texts) items += (items.empty() ? "" : ", ") + quoted(text);
    line(key_text(key) + ": [" + items + "]");
}
void YamlWriter::numbers(const std::string& key, const std::vector<std::pair<std::string, double>>& values)
{
    std::string items;
    for (const auto& [name, number] : values)
        items += (items.empty() ? "" : ", ") + key_text(name) + ": " + yaml_number(number);
    line(key_text(key) + ": {" + items + "}");
}

}  // namespace mp2p_icp_apps::experiments
