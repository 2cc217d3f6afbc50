#pragma once

#include <mrpt/poses/CPose3D.h>

#include <utility>

namespace mp2p_icp
{
/// Translation (m) and rotation (rad) of the increment from one pose to another, as norms of its logarithm in
/// SE(3).
std::pair<double, double> step_between(const mrpt::poses::CPose3D& from, const mrpt::poses::CPose3D& to);

}  // namespace mp2p_icp
