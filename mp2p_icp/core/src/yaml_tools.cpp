#include <libfyaml.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/yaml_tools.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <numeric>
#include <sstream>

namespace mp2p_icp
{
YamlPlace YamlPlace::key(const std::string& name) const
{
    return {file, path.empty() ? name : path + "." + name};
}
YamlPlace YamlPlace::item(size_t index) const
{
    return {file, path + "[" + std::to_string(index) + "]"};
}

std::string YamlPlace::text(const yaml::node_t* node) const
{
    std::string out = file;
    if (!file.empty() && node) out += ":" + std::to_string(node->marks.line + 1);
    if (!path.empty()) out += (out.empty() ? "" : ": ") + path;
    return out.empty() ? std::string("YAML") : out;
}

// ---- Checks that MRPT's reader does not make: libfyaml, which MRPT itself reads with, gives the events ----
namespace
{
std::string at_line(const std::string& file_name, size_t line)
{
    return (file_name.empty() ? std::string("line ") : file_name + ":") + std::to_string(line) + ": ";
}

struct Diagnostics
{
    std::unique_ptr<fy_diag, void (*)(fy_diag*)> diag{nullptr, fy_diag_destroy};
    Diagnostics()
    {
        fy_diag_cfg config;
        fy_diag_cfg_default(&config);
        config.fp = nullptr;
        config.output_fn = [](fy_diag*, void*, const char*, size_t) {};
        diag.reset(fy_diag_create(&config));
        fy_diag_set_collect_errors(diag.get(), true);
    }
    [[noreturn]] void raise(const std::string& file_name) const
    {
        void* cursor = nullptr;
        if (const fy_diag_error* error = fy_diag_errors_iterate(diag.get(), &cursor))
            throw ConfigError(at_line(file_name, static_cast<size_t>(error->line)) + error->msg);
        throw ConfigError((file_name.empty() ? std::string() : file_name + ": ") + "not valid YAML");
    }
};

/// What a collection that is being read has seen so far.
struct OpenCollection
{
    bool is_map = false;
    bool expects_key = true;
    std::map<std::string, size_t> key_lines;
};

/// Walks through the events and refuses what MRPT's reader drops silently or refuses without a place.
class TextCheck
{
 public:
    explicit TextCheck(const std::string& file_name) : file_name_(file_name) {}

    void event(fy_event* e)
    {
        if (const fy_mark* mark = fy_event_start_mark(e)) line_ = static_cast<size_t>(mark->line) + 1;
        switch (e->type)
        {
            case FYET_DOCUMENT_START:
                if (++documents_ > 1) refuse("a second document ('---') begins, but only one is read");
                break;
            case FYET_MAPPING_START:
                node_begins(), open_.push_back({true, true, {}});
                break;
            case FYET_SEQUENCE_START:
                node_begins(), open_.push_back({false, false, {}});
                break;
            case FYET_MAPPING_END:
            case FYET_SEQUENCE_END:
                open_.pop_back();
                break;
            case FYET_SCALAR:
                scalar(e->scalar.value);
                break;
            case FYET_ALIAS:
                refuse("aliases ('*name') are not supported; write the value again");
            default:
                break;
        }
    }

 private:
    [[noreturn]] void refuse(const std::string& problem) const
    {
        throw ConfigError(at_line(file_name_, line_) + problem);
    }

    void node_begins()
    {
        if (!open_.empty() && open_.back().is_map) open_.back().expects_key = !open_.back().expects_key;
    }
    void scalar(fy_token* token)
    {
        size_t length = 0;
        const char* text = token ? fy_token_get_text(token, &length) : nullptr;
        const std::string value(text ? text : "", text ? length : 0);
        const bool is_key = !open_.empty() && open_.back().is_map && open_.back().expects_key;
        if (value.empty() && (!token || fy_token_scalar_style(token) == FYSS_PLAIN))
            refuse(is_key ? "a key is missing before ':'"
                   : last_key_.empty()
                       ? "a value is missing"
                       : "a value is missing (after the key '" + last_key_ + "'); write ~ for none");
        if (is_key) key(value);
        node_begins();
    }
    void key(const std::string& name)
    {
        last_key_ = name;
        const auto [first, is_new] = open_.back().key_lines.emplace(name, line_);
        if (!is_new)
            refuse("the key '" + name + "' stands twice in this map, first on line " +
                   std::to_string(first->second));
    }

    std::string file_name_, last_key_;
    std::vector<OpenCollection> open_;
    size_t line_ = 1, documents_ = 0;
};

void check_yaml_text(const std::string& text, const std::string& file_name)
{
    Diagnostics diagnostics;
    fy_parse_cfg config{};
    config.flags = static_cast<fy_parse_cfg_flags>(FYPCF_DEFAULT_PARSE);
    config.diag = diagnostics.diag.get();
    const std::unique_ptr<fy_parser, void (*)(fy_parser*)> parser(fy_parser_create(&config),
                                                                  fy_parser_destroy);
    fy_parser_set_string(parser.get(), text.data(), text.size());
    TextCheck check(file_name);
    for (;;)
    {
        const auto release = [&](fy_event* e) { fy_parser_event_free(parser.get(), e); };
        const std::unique_ptr<fy_event, decltype(release)> event(fy_parser_parse(parser.get()), release);
        if (!event) break;
        check.event(event.get());
        if (event->type == FYET_STREAM_END) break;
    }
    if (fy_parser_get_stream_error(parser.get()) || fy_diag_got_error(diagnostics.diag.get()))
        diagnostics.raise(file_name);
}

/// Nothing but blank lines and comments?
bool is_blank(const std::string& text)
{
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
    {
        const auto first = line.find_first_not_of(" \t\r");
        if (first != std::string::npos && line[first] != '#') return false;
    }
    return true;
}
}  // namespace

yaml yaml_from_text(const std::string& text, const std::string& file_name)
{
    if (is_blank(text)) return {};  // libfyaml leaks memory on it
    check_yaml_text(text, file_name);
    try
    {
        return yaml::FromText(text);
    }
    catch (const std::exception& e)
    {
        throw ConfigError((file_name.empty() ? std::string() : file_name + ": ") +
                          "not valid YAML: " + short_reason(e));
    }
}

yaml yaml_from_file(const std::string& file_name)
{
    std::ifstream file(file_name, std::ios::binary);
    std::stringstream text;
    if (!file || !(text << file.rdbuf())) throw DataError(file_name, "cannot be read, or is empty");
    return yaml_from_text(text.str(), file_name);
}

// ---- Names ------------------------------------------------------------------------------------------------
namespace
{
size_t edit_distance(const std::string& a, const std::string& b)
{
    std::vector<size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), size_t(0));
    for (size_t i = 0; i < a.size(); i++)
    {
        size_t diagonal = row[0];
        row[0] = i + 1;
        for (size_t j = 0; j < b.size(); j++)
        {
            const bool same = std::tolower(a[i]) == std::tolower(b[j]);
            const size_t best = std::min({diagonal + (same ? 0 : 1), row[j] + 1, row[j + 1] + 1});
            diagonal = row[j + 1];
            row[j + 1] = best;
        }
    }
    return row.back();
}
}  // namespace

std::string nearest_name(const std::string& name, const std::vector<std::string>& known)
{
    std::string best;
    size_t best_distance = std::max<size_t>(3, name.size() / 2) + 1;
    for (const auto& candidate : known)
    {
        const bool goes_on = name.size() > 3 && candidate.compare(0, name.size(), name) == 0;
        const size_t d = goes_on ? 1 : edit_distance(name, candidate);
        if (d < best_distance) best = candidate, best_distance = d;
    }
    return best;
}

void throw_unknown_key(const YamlPlace& map_place, const yaml::node_t& key,
                       const std::vector<std::string>& known)
{
    const std::string name(key.internalAsStr());
    const std::string nearest = nearest_name(name, known);
    std::string hint;
    if (!nearest.empty())
        hint = "; did you mean '" + nearest + "'?";
    else
        for (const auto& k : known) hint += (hint.empty() ? "; known keys: " : ", ") + k;
    throw ConfigError(map_place.key(name).text(&key) + ": unknown key '" + name + "'" + hint);
}

void check_keys(const yaml& map, const YamlPlace& place, const std::vector<std::string>& known)
{
    if (!map.isMap())
        throw ConfigError(place.text(&map.node()) + ": expected a map of keys and values, found a " +
                          map.node().typeName());
    for (const auto& [key, value] : map.asMap())
        if (std::find(known.begin(), known.end(), key.internalAsStr()) == known.end())
            throw_unknown_key(place, key, known);
}

std::string scalar_text(const yaml::node_t& node, const YamlPlace& place)
{
    if (!node.isScalar() || node.isNullNode())  // MRPT reads `~` as both
        throw ConfigError(place.text(&node) + ": expected a single value, found a " +
                          (node.isNullNode() ? "null" : node.typeName()));
    // Numbers set from C++ keep their type; written as text they must not lose digits.
    if (const auto* d = std::any_cast<double>(&node.asScalar())) return to_text(*d);
    if (const auto* f = std::any_cast<float>(&node.asScalar())) return to_text(static_cast<double>(*f));
    return node.as<std::string>();
}

}  // namespace mp2p_icp
