#pragma once

#include <mrpt/containers/yaml.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
using yaml = mrpt::containers::yaml;

/// Where a YAML node stands: for messages.
struct YamlPlace
{
    std::string file;  ///< empty: not from a file, so line numbers are not shown
    std::string path;  ///< such as `matchers[0].params`; empty: the top

    YamlPlace key(const std::string& name) const;
    YamlPlace item(size_t index) const;
    /// `file:line: path`, with the parts that are known. `node` gives the line.
    std::string text(const yaml::node_t* node = nullptr) const;
};

/** Reads and checks YAML text. \exception ConfigError on a syntax error (with its line), on a key that stands
 * twice in one map (with both lines: MRPT's reader would keep one of them silently), and, with the line, on
 * what that reader cannot read: aliases, a key without a value (write `~`), a second document.
 */
yaml yaml_from_text(const std::string& text, const std::string& file_name = "");
/// \overload \exception DataError if the file cannot be read or has no content.
yaml yaml_from_file(const std::string& file_name);

/// The name in `known` that is nearest to `name` by edit distance (one that begins with it is as near as one
/// with a single letter wrong); empty if none is near.
std::string nearest_name(const std::string& name, const std::vector<std::string>& known);

/// `unknown key 'x'; did you mean 'y'?`, as a ConfigError.
[[noreturn]] void throw_unknown_key(const YamlPlace& map_place, const yaml::node_t& key,
                                    const std::vector<std::string>& known);

/// \exception ConfigError if `map` is not a map, or holds a key that is not in `known`.
void check_keys(const yaml& map, const YamlPlace& place, const std::vector<std::string>& known);

/// A scalar of any type as text; \exception ConfigError if it is not a scalar, or null.
std::string scalar_text(const yaml::node_t& node, const YamlPlace& place);

}  // namespace mp2p_icp
