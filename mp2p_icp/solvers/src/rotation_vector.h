#pragma once

#include <Eigen/Dense>
#include <cmath>

namespace mp2p_icp
{
/// The rotation by |omega| rad about omega.
inline Eigen::Matrix3d rotation_by(const Eigen::Vector3d& omega)
{
    const double angle = omega.norm();
    if (!(angle > 0)) return Eigen::Matrix3d::Identity();
    return Eigen::AngleAxisd(angle, omega / angle).toRotationMatrix();
}

/// The rotation vector, of half a turn at most, from A to B: B = rotation_by(v) A.
inline Eigen::Vector3d rotation_between(const Eigen::Matrix3d& A, const Eigen::Matrix3d& B)
{
    const Eigen::AngleAxisd turn(Eigen::Quaterniond(Eigen::Matrix3d(B * A.transpose())));
    return (turn.angle() <= M_PI ? turn.angle() : turn.angle() - 2 * M_PI) * turn.axis();
}
}  // namespace mp2p_icp
