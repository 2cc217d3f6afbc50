#pragma once

#include <mp2p_icp/fitted_line.h>
#include <mp2p_icp/plane_patch.h>
#include <mrpt/math/TLine3D.h>
#include <mrpt/poses/CPose3D.h>

#include <Eigen/Dense>

namespace mp2p_icp
{
/// The rotation of a pose as an Eigen matrix.
Eigen::Matrix3d rotation_of(const mrpt::poses::CPose3D& pose);
/// The translation of a pose as an Eigen vector.
Eigen::Vector3d translation_of(const mrpt::poses::CPose3D& pose);
/// The pose with this rotation matrix (orthonormal, det +1) and translation.
mrpt::poses::CPose3D make_pose(const Eigen::Matrix3d& R, const Eigen::Vector3d& t);

/// Angle of a rotation matrix in [0, pi], accurate near 0 and near pi.
double rotation_angle(const Eigen::Matrix3d& R);

/// Are all 12 numbers of the pose finite?
bool is_finite(const mrpt::poses::CPose3D& pose);

inline Eigen::Vector3d to_eigen(const mrpt::math::TPoint3D& p)
{
    return {p.x, p.y, p.z};
}
inline mrpt::math::TPoint3D to_mrpt(const Eigen::Vector3d& v)
{
    return {v.x(), v.y(), v.z()};
}

/// The line, plane or patch as seen from the frame in which `pose` stands: points p map to `pose (+) p`.
mrpt::math::TLine3D compose(const mrpt::poses::CPose3D& pose, const mrpt::math::TLine3D& line);
plane_patch_t compose(const mrpt::poses::CPose3D& pose, const plane_patch_t& patch);
/// \overload With their fits, whose axes turn with them.
fitted_line_t compose(const mrpt::poses::CPose3D& pose, const fitted_line_t& line);
fitted_plane_t compose(const mrpt::poses::CPose3D& pose, const fitted_plane_t& plane);

}  // namespace mp2p_icp
