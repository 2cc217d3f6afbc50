#pragma once

#include <mrpt/poses/CPose3D.h>

namespace mp2p_icp
{
/// How far apart two poses are.
struct PoseStep
{
    double metres = 0, radians = 0;
};

/// Length of the translation and angle of the rotation of the increment from one pose to another. NaN where a
/// pose is not finite.
PoseStep step_between(const mrpt::poses::CPose3D& from, const mrpt::poses::CPose3D& to);

}  // namespace mp2p_icp
