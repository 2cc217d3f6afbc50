#pragma once

#include <mrpt/poses/CPose3D.h>

#include <Eigen/Dense>
#include <cmath>

namespace mp2p_icp
{
/** E with omega = E (dyaw, dpitch, droll)': the angular velocity, in the global frame, of R = Rz(yaw)
 * Ry(pitch) Rx(roll). det(E) = cos(pitch): singular at pitch = +-90 degrees.
 */
inline Eigen::Matrix3d euler_rates(const mrpt::poses::CPose3D& pose)
{
    const double cy = std::cos(pose.yaw()), sy = std::sin(pose.yaw()), cp = std::cos(pose.pitch()),
                 sp = std::sin(pose.pitch());
    Eigen::Matrix3d E;
    E.col(0) << 0, 0, 1;
    E.col(1) << -sy, cy, 0;
    E.col(2) << cy * cp, sy * cp, -sp;
    return E;
}

/// [v]x, so that [v]x u = v x u.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& v)
{
    Eigen::Matrix3d S;
    S << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return S;
}

}  // namespace mp2p_icp
