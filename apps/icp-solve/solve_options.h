#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/// The command line of icp-solve.
struct SolveOptions
{
    std::string pairings;
    std::string solver = "certified";  ///< certified, horn, olae, gauss-newton
    std::string guess;                 ///< as icp-run's; empty: none
    std::string certificate;           ///< file to write; empty: none
    bool all_minima = false;
    double outlier_threshold = 0;  ///< m; 0: all pairings are right
};

/// Empty if help or the version was asked for, and written to `out`. \exception std::invalid_argument
std::optional<SolveOptions> parse_solve_options(const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace mp2p_icp_apps
