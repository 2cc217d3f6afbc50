#include <mp2p_icp/numbers.h>
#include <mp2p_icp/yaml_text.h>

namespace mp2p_icp
{
namespace
{
std::string quoted(const std::string& text)
{
    std::string out = "\"";
    for (const char c : text)
    {
        if (c == '"' || c == '\\')
            out += std::string("\\") + c;
        else if (static_cast<unsigned char>(c) < 0x20)
        {
            constexpr char digits[] = "0123456789abcdef";
            out += std::string("\\x") + digits[c >> 4] + digits[c & 15];
        }
        else
            out += c;
    }
    return out + "\"";
}

std::string to_flow(const yaml::node_t& node)
{
    if (node.isNullNode()) return "~";
    std::string out;
    if (node.isSequence())
    {
        for (const auto& item : node.asSequence()) out += (out.empty() ? "" : ", ") + to_flow(item);
        return "[" + out + "]";
    }
    if (node.isMap())
    {
        for (const auto& [key, value] : node.asMap())
            out +=
                (out.empty() ? "" : ", ") + quoted(std::string(key.internalAsStr())) + ": " + to_flow(value);
        return "{" + out + "}";
    }
    // MRPT's reader keeps numbers as text, too; they are written plain again.
    const std::string text = scalar_text(node, {});
    return to_number(text) || text == "true" || text == "false" ? text : quoted(text);
}
}  // namespace

std::string to_yaml_text(const yaml& content)
{
    return to_flow(content.node());
}

}  // namespace mp2p_icp
