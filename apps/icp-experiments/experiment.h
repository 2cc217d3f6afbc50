#pragma once

#include <functional>
#include <string>
#include <vector>

#include "experiment_options.h"

namespace mp2p_icp_apps::experiments
{
class Workshop;

/// One experiment of the report: everything it does, writes and draws.
struct Experiment
{
    std::string name;   ///< the subcommand, and the name of its files
    std::string about;  ///< one line
    std::function<void(const ExperimentOptions&, Workshop&)> run;
};

// One file each, named as the function.
Experiment noise_points();
Experiment noise_planes();
Experiment noise_mixed();
Experiment outliers();
Experiment robust_loss();
Experiment bunny_icp();
Experiment timing();

/// In the order of the report.
inline std::vector<Experiment> all_experiments()
{
    return {noise_points(), noise_planes(), noise_mixed(), outliers(), robust_loss(), bunny_icp(), timing()};
}

}  // namespace mp2p_icp_apps::experiments
