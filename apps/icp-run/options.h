#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/// The command line of icp-run. Empty texts: not given.
struct Options
{
    std::string input_local, input_global;
    std::string config;  ///< a file, or the name of a shipped pipeline
    std::string config_generators, config_filters_local, config_filters_global;
    std::optional<std::string> entry_name_filters_local, entry_name_filters_global;
    std::string guess = "[0 0 0 0 0 0]";
    std::string ground_truth;
    std::string output_result, output_aligned, snapshot;
    std::string describe, replay, why;  ///< one of these: done instead of an alignment
    std::optional<unsigned> threads;
    bool generate_debug_log = false;
    bool profiler = false;
};

/** Reads the command line.
 * \param arguments without the program's name
 * \return empty if help or the version was asked for, and written to `out`
 * \exception std::invalid_argument for anything wrong with it.
 */
std::optional<Options> parse_options(const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace mp2p_icp_apps
