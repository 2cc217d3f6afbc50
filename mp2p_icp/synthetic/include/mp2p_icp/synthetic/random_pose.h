#pragma once

#include <mp2p_icp/random.h>
#include <mrpt/math/TPose3D.h>
#include <mrpt/poses/CPose3D.h>

namespace mp2p_icp::synthetic
{
/** A pose whose x, y, z (m), yaw, pitch and roll (rad) are independent and uniform in [-limit, limit) of
 * the same coordinate.
 * \exception std::invalid_argument if a limit is negative or not finite.
 */
mrpt::poses::CPose3D random_pose(const mrpt::math::TPose3D& limit, SeededRandom& random);

}  // namespace mp2p_icp::synthetic
