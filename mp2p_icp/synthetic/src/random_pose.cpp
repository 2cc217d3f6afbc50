#include <mp2p_icp/synthetic/random_pose.h>

#include <cmath>
#include <stdexcept>

namespace mp2p_icp::synthetic
{
mrpt::poses::CPose3D random_pose(const mrpt::math::TPose3D& limit, SeededRandom& random)
{
    double values[6];
    for (size_t i = 0; i < 6; i++)
    {
        if (!(limit[i] >= 0) || !std::isfinite(limit[i]))
            throw std::invalid_argument("random_pose: limits must be finite and not negative");
        values[i] = random.uniform(-limit[i], limit[i]);
    }
    return mrpt::poses::CPose3D(values[0], values[1], values[2], values[3], values[4], values[5]);
}

}  // namespace mp2p_icp::synthetic
