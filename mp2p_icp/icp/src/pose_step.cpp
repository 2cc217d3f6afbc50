#include "pose_step.h"

#include <mrpt/poses/Lie/SE.h>

#include <cmath>

namespace mp2p_icp
{
std::pair<double, double> step_between(const mrpt::poses::CPose3D& from, const mrpt::poses::CPose3D& to)
{
    const auto log = mrpt::poses::Lie::SE<3>::log(to - from);
    return {std::hypot(log[0], log[1], log[2]), std::hypot(log[3], log[4], log[5])};
}

}  // namespace mp2p_icp
