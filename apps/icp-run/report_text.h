#pragma once

#include <mp2p_icp/metricmap.h>

#include <iosfwd>
#include <string>

#include "result_yaml.h"

namespace mp2p_icp_apps
{
/// What was read from one input: kind, points, notes, contents.
void print_input(std::ostream& out, const std::string& side, const mp2p_icp::LoadReport& report,
                 const mp2p_icp::metric_map_t& map);

/// The result for people, its verdict first.
void print_result(std::ostream& out, const AlignmentRecord& record);

/// A motion that is not determined, on one line.
void print_free_motion(std::ostream& out, const mp2p_icp::FreeTwist& twist);

/// The verdict and its reason, on one line.
std::string verdict_line(const mp2p_icp::Results& results);
/// Such as `x=1 y=2 z=3 m, yaw=10 pitch=0 roll=0 deg`.
std::string pose_line(const mrpt::poses::CPose3D& pose);

}  // namespace mp2p_icp_apps
