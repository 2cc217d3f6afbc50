#include "certificate_file.h"

#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/yaml_tools.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace mp2p_icp_certify
{
using mp2p_icp::ConfigError;
using mp2p_icp::DataError;
using mp2p_icp::yaml;
using mp2p_icp::YamlPlace;

// ---- Text -------------------------------------------------------------------------------------------------
namespace
{
std::string text_of_file(const std::string& file_name)
{
    std::error_code ignored;
    if (std::filesystem::is_directory(file_name, ignored)) throw DataError(file_name, "is a folder");
    std::ifstream in(file_name, std::ios::binary);
    if (!in) throw DataError(file_name, "cannot be opened");
    return {std::istreambuf_iterator<char>(in), {}};
}

/// A YAML text without the lines of its block `pairings: |`, and these lines. A million of them is a lot to
/// a YAML reader.
struct SplitText
{
    std::string rest;  ///< all lines at their places: those of the block as dots (many blank ones take long)
    std::string_view lines;
    size_t first_line = 0;  ///< 0: there is no such block
};

bool begins_block(std::string_view line)
{
    constexpr std::string_view KEY = "pairings:";
    if (line.substr(0, KEY.size()) != KEY) return false;
    line.remove_prefix(KEY.size());
    while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.remove_suffix(1);
    while (!line.empty() && line[0] == ' ') line.remove_prefix(1);
    return line == "|" || line == "|-" || line == "|+";
}

/// Indented, or blank.
bool continues_block(std::string_view line)
{
    return line.empty() || line[0] == ' ' || line[0] == '\r';
}

SplitText split_at_pairings(const std::string& text)
{
    SplitText split;
    size_t line_number = 0, block_begin = 0, block_end = 0;
    bool in_block = false;
    for (size_t at = 0; at < text.size();)
    {
        const size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view line(text.data() + at, end - at);
        line_number++;
        in_block = in_block && continues_block(line);
        if (in_block)
            block_end = end, split.rest += " .\n";
        else
            split.rest.append(line).append("\n");
        at = end + 1;
        if (split.first_line == 0 && begins_block(line))
            in_block = true, split.first_line = line_number + 1,
            block_begin = block_end = std::min(at, text.size());
    }
    split.lines = std::string_view(text).substr(block_begin, block_end - block_begin);
    return split;
}
}  // namespace

// ---- Values -----------------------------------------------------------------------------------------------
namespace
{
const yaml::node_t& value_at(const yaml& map, const YamlPlace& place, const std::string& key)
{
    const auto& entries = map.asMap();
    const auto found = entries.find(key);
    if (found == entries.end())
        throw ConfigError(place.text(&map.node()) + ": expected the key '" + key + "', found none");
    return found->second;
}

double number_from(const yaml::node_t& node, const YamlPlace& place)
{
    const std::string text = mp2p_icp::scalar_text(node, place);
    const auto value = mp2p_icp::to_number(text);
    if (!value || !std::isfinite(*value))
        throw ConfigError(place.text(&node) + ": expected a finite number, found '" + text.substr(0, 30) +
                          "'");
    return *value;
}

double number_at(const yaml& map, const YamlPlace& place, const std::string& key)
{
    return number_from(value_at(map, place, key), place.key(key));
}

std::string text_at(const yaml& map, const YamlPlace& place, const std::string& key)
{
    return mp2p_icp::scalar_text(value_at(map, place, key), place.key(key));
}

/// Row by row.
template <int ROWS, int COLS>
Eigen::Matrix<Real, ROWS, COLS> matrix_at(const yaml& map, const YamlPlace& map_place, const std::string& key)
{
    const auto& node = value_at(map, map_place, key);
    const YamlPlace place = map_place.key(key);
    const std::string expected = ": expected a list of " + std::to_string(ROWS * COLS) + " numbers, found ";
    if (!node.isSequence()) throw ConfigError(place.text(&node) + expected + "a " + node.typeName());
    const auto& items = node.asSequence();
    if (items.size() != size_t(ROWS * COLS))
        throw ConfigError(place.text(&node) + expected + std::to_string(items.size()));
    Eigen::Matrix<Real, ROWS, COLS> m;
    for (size_t i = 0; i < items.size(); i++)
        m(static_cast<int>(i) / COLS, static_cast<int>(i) % COLS) = number_from(items[i], place.item(i));
    return m;
}

Pose pose_at(const yaml& map, const YamlPlace& place)
{
    return {matrix_at<3, 3>(map, place, "rotation"), matrix_at<3, 1>(map, place, "translation")};
}

ListedMinimum minimum_from(const yaml& map, const YamlPlace& place)
{
    mp2p_icp::check_keys(map, place, {"rotation", "translation", "cost"});
    return {pose_at(map, place), number_at(map, place, "cost")};
}

std::vector<ListedMinimum> minima_from(const yaml::node_t& node, const YamlPlace& place)
{
    if (node.isNullNode()) return {};
    if (!node.isSequence())
        throw ConfigError(place.text(&node) + ": expected a list of minima, found a " + node.typeName());
    std::vector<ListedMinimum> minima;
    for (const auto& item : node.asSequence())
        minima.push_back(minimum_from(yaml(item), place.item(minima.size())));
    return minima;
}

Prior prior_from(const yaml& map, const YamlPlace& place)
{
    mp2p_icp::check_keys(map, place, {"rotation", "translation", "information"});
    return {pose_at(map, place), matrix_at<6, 6>(map, place, "information")};
}

std::string verdict_at(const yaml& map, const YamlPlace& place)
{
    const std::string verdict = text_at(map, place, "verdict");
    if (verdict != "global" && verdict != "global_ambiguous" && verdict != "unobservable" && verdict != "gap")
        throw ConfigError(place.key("verdict").text(&value_at(map, place, "verdict")) +
                          ": expected global, global_ambiguous, unobservable or gap, found '" +
                          verdict.substr(0, 30) + "'");
    return verdict;
}

void check_version(const yaml& map, const YamlPlace& place)
{
    const char* const KEY = "mp2p_icp_certificate";
    if (const double version = number_at(map, place, KEY); version != 1)
        throw ConfigError(place.key(KEY).text(&value_at(map, place, KEY)) + ": expected version 1, found " +
                          mp2p_icp::to_text(version));
}
}  // namespace

// ---- Files ------------------------------------------------------------------------------------------------
namespace
{
yaml map_from(const std::string& text, const std::string& file_name, const std::string& what)
{
    yaml map = mp2p_icp::yaml_from_text(text, file_name);
    if (!map.isMap()) throw DataError(file_name, "", what, map.isNullNode() ? "nothing" : "no YAML map");
    return map;
}

/// Those of the block that was cut out of the text, else those of the map, in another form.
std::vector<Pairing> pairings_of(const SplitText& split, const yaml& map, const std::string& file_name)
{
    if (split.first_line > 0) return pairings_from_lines(split.lines, file_name, split.first_line);
    const auto& node = value_at(map, {file_name, ""}, "pairings");
    if (node.isNullNode()) return {};
    const std::string text = mp2p_icp::scalar_text(node, {file_name, "pairings"});
    return pairings_from_lines(text, file_name, static_cast<size_t>(node.marks.line) + 1);
}

/// Does the first line that says something look like one of a list of pairings?
bool is_list_of_pairings(const std::string& text)
{
    for (size_t at = 0; at < text.size();)
    {
        const size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view line(text.data() + at, end - at);
        const auto first = line.find_first_not_of(" \t\r");
        if (first != std::string_view::npos && line[first] != '#')
            return line.find(',') != std::string_view::npos && line.find(':') == std::string_view::npos;
        at = end + 1;
    }
    return true;  // an empty list
}

Certificate certificate_from(const yaml& map, const YamlPlace& top)
{
    mp2p_icp::check_keys(map, top,
                         {"mp2p_icp_certificate", "verdict", "tolerance", "cost", "scale", "gap", "margin",
                          "rotation", "translation", "G", "minima", "prior", "pairings"});
    check_version(map, top);
    Certificate c;
    c.verdict = verdict_at(map, top);
    c.tolerance = number_at(map, top, "tolerance");
    c.cost = number_at(map, top, "cost");
    c.scale = number_at(map, top, "scale");
    c.gap = number_at(map, top, "gap");
    c.margin = number_at(map, top, "margin");
    c.pose = pose_at(map, top);
    c.G = matrix_at<9, 9>(map, top, "G");
    if (map.has("minima")) c.minima = minima_from(value_at(map, top, "minima"), top.key("minima"));
    if (map.has("prior")) c.prior = prior_from(yaml(value_at(map, top, "prior")), top.key("prior"));
    return c;
}
}  // namespace

std::vector<Pairing> read_pairings(const std::string& file_name)
{
    const std::string text = text_of_file(file_name);
    if (is_list_of_pairings(text)) return pairings_from_lines(text, file_name, 1);
    const SplitText split = split_at_pairings(text);
    return pairings_of(split, map_from(split.rest, file_name, "pairings, or YAML with 'pairings'"),
                       file_name);
}

Certificate read_certificate(const std::string& file_name, const std::string& pairings_file)
{
    const std::string text = text_of_file(file_name);
    const SplitText split = split_at_pairings(text);
    const yaml map = map_from(split.rest, file_name, "a certificate (YAML)");
    Certificate c = certificate_from(map, {file_name, ""});
    c.pairings = pairings_file.empty() ? pairings_of(split, map, file_name) : read_pairings(pairings_file);
    if (c.pairings.empty() && !c.prior)
        throw DataError(pairings_file.empty() ? file_name : pairings_file, "", "at least one pairing",
                        "none");
    return c;
}

}  // namespace mp2p_icp_certify
