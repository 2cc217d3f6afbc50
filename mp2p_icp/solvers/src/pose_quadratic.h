#pragma once

#include <mp2p_icp/PoseQuadratic.h>

#include "pairing_sums.h"

namespace mp2p_icp
{
/// Information on the translation below this part of the largest is rounding, for all that sums can tell.
constexpr double RESOLVED_INFORMATION = 1e-12;

OriginPose relative_to(const Eigen::Vector3d& a_origin, const Eigen::Vector3d& b_origin,
                       const mrpt::poses::CPose3D& pose);
mrpt::poses::CPose3D absolute(const Eigen::Vector3d& a_origin, const Eigen::Vector3d& b_origin,
                              const OriginPose& pose);

PoseQuadratic pose_quadratic(const PairingSums& sums, const PreparedPairings& of);

}  // namespace mp2p_icp
