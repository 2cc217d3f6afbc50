#pragma once

#include <Eigen/Dense>

namespace mp2p_icp
{
/// The rotation by |omega| rad about omega.
inline Eigen::Matrix3d rotation_by(const Eigen::Vector3d& omega)
{
    const double angle = omega.norm();
    if (!(angle > 0)) return Eigen::Matrix3d::Identity();
    return Eigen::AngleAxisd(angle, omega / angle).toRotationMatrix();
}
}  // namespace mp2p_icp
