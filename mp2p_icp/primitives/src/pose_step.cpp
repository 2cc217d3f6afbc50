#include <mp2p_icp/pose_step.h>
#include <mp2p_icp/se3.h>

#include <limits>

namespace mp2p_icp
{
PoseStep step_between(const mrpt::poses::CPose3D& from, const mrpt::poses::CPose3D& to)
{
    constexpr double NONE = std::numeric_limits<double>::quiet_NaN();
    if (!is_finite(from) || !is_finite(to)) return {NONE, NONE};
    const auto increment = to - from;
    return {translation_of(increment).norm(), rotation_angle(rotation_of(increment))};
}

}  // namespace mp2p_icp
