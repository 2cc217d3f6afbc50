#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp_apps::experiments
{
/// The command line of icp-experiments.
struct ExperimentOptions
{
    std::vector<std::string> experiments;  ///< names, in the order of running
    std::optional<size_t> repetitions;     ///< empty: as in the report
    uint64_t seed = 1;
    std::optional<unsigned> threads;  ///< empty: all of the machine
    std::string output = "experiments";
    bool figures = true;
    std::string python;  ///< the program that draws; empty: the first that has matplotlib

    std::vector<double> noise_points = {0, .01, .02, .05, .1, .2, .5, 1};  ///< m
    std::vector<double> noise_angles = {0, .1, .2, .5, 1, 2, 5};           ///< degrees
    std::vector<double> outlier_ratios = {.05, .1, .2, .3, .4, .5, .6, .7, .75};
    std::string model = "/usr/share/glmark2/models/bunny.obj";
};

/// Empty if help or the version was asked for, and written to `out`. \exception std::invalid_argument
std::optional<ExperimentOptions> parse_experiment_options(const std::vector<std::string>& arguments,
                                                          std::ostream& out);

}  // namespace mp2p_icp_apps::experiments
