#pragma once

#include <vector>

#include "experiment_options.h"
#include "pose_study.h"

namespace mp2p_icp_apps::experiments
{
/// Levels and axis of a study with noise on points only.
void set_point_levels(const ExperimentOptions& options, PoseStudy& study);

/** The same with noise on directions too. The report has one axis for both: the i-th noise of points goes
 * with the i-th of angles; the shorter list stays at its end. \exception std::invalid_argument where one of
 * both is zero: weights that are inverse variances have no ratio
 */
void set_mixed_levels(const ExperimentOptions& options, PoseStudy& study);

}  // namespace mp2p_icp_apps::experiments
