#pragma once

#include <string>
#include <vector>

#include "pose_study.h"

namespace mp2p_icp_apps::experiments
{
/** \file Figures of studies, and the numbers that are said of them. Methods are named by their ids. Levels
 * without noise are left out where the axis is logarithmic: a note says what the errors are there.
 */

/// The report's figures 1 to 3: boxes of all methods, then of each alone; rotation left, translation right.
Figure report_noise_figure(const PoseStudyResult& r, const std::string& name,
                           const std::vector<std::string>& methods);
/// Boxes of all methods, rotation above translation.
Figure box_figure(const PoseStudyResult& r, const std::string& name, const std::vector<std::string>& methods);
/// RMSE of all methods with the bound, and below it their ratio.
Figure bound_figure(const PoseStudyResult& r, const std::string& name);
/// Medians of all methods with the bound.
Figure median_figure(const PoseStudyResult& r, const std::string& name);

/// RMSE of one method over that of another, at all levels with noise.
Finding rmse_ratio(const PoseStudyResult& r, const std::string& of, const std::string& over,
                   const Quantity& q);
/// The same of medians.
Finding median_ratio(const PoseStudyResult& r, const std::string& of, const std::string& over,
                     const Quantity& q);
/// RMSE over the bound, at all levels with noise.
Finding bound_ratio(const PoseStudyResult& r, const std::string& of, const Quantity& q);
/// The largest of a number over all runs of a level.
Finding largest(const PoseStudyResult& r, const std::string& of, const std::string& what,
                double PoseSample::*member);

}  // namespace mp2p_icp_apps::experiments
