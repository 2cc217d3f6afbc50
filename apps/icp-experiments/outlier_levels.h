#pragma once

#include <string>

#include "experiment_options.h"
#include "pose_study.h"

namespace mp2p_icp_apps::experiments
{
/// 200 points, noise of 1 mm, and all shares of outliers that were asked for.
PoseStudy outlier_study(const ExperimentOptions& options, const std::string& id, const std::string& about);

}  // namespace mp2p_icp_apps::experiments
