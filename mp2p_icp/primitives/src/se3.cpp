#include <mp2p_icp/se3.h>

#include <cmath>

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

Eigen::Matrix3d rotation_of(const CPose3D& pose)
{
    Eigen::Matrix3d R;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) R(r, c) = pose.getRotationMatrix()(r, c);
    return R;
}

Eigen::Vector3d translation_of(const CPose3D& pose)
{
    return {pose.x(), pose.y(), pose.z()};
}

CPose3D make_pose(const Eigen::Matrix3d& R, const Eigen::Vector3d& t)
{
    mrpt::math::CMatrixDouble33 rotation;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) rotation(r, c) = R(r, c);
    CPose3D pose;
    pose.setRotationMatrix(rotation);
    pose.x(t.x()), pose.y(t.y()), pose.z(t.z());
    return pose;
}

double rotation_angle(const Eigen::Matrix3d& R)
{
    // |vee(R - R')| = 2 sin(angle), trace(R) - 1 = 2 cos(angle)
    const Eigen::Vector3d twice_sine(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
    return std::atan2(twice_sine.norm(), R.trace() - 1.0);
}

bool is_finite(const CPose3D& pose)
{
    return rotation_of(pose).allFinite() && translation_of(pose).allFinite();
}

mrpt::math::TLine3D compose(const CPose3D& pose, const mrpt::math::TLine3D& line)
{
    mrpt::math::TLine3D out;
    out.pBase = pose.composePoint(line.pBase);
    out.director = pose.rotateVector(line.director);
    return out;
}

plane_patch_t compose(const CPose3D& pose, const plane_patch_t& patch)
{
    const auto& c = patch.plane.coefs;
    const Eigen::Vector3d normal(c[0], c[1], c[2]);
    const Eigen::Vector3d n = rotation_of(pose) * normal;
    plane_patch_t out;
    out.centroid = pose.composePoint(patch.centroid);
    // n'x + d = 0 becomes (Rn)'y + d - (Rn)'t = 0 for y = R x + t
    out.plane.coefs = {n.x(), n.y(), n.z(), c[3] - n.dot(translation_of(pose))};
    return out;
}

fitted_line_t compose(const CPose3D& pose, const fitted_line_t& line)
{
    fitted_line_t out = compose(pose, static_cast<const mrpt::math::TLine3D&>(line));
    out.fit = line.fit;
    if (out.fit) out.fit->axis_a = rotation_of(pose) * line.fit->axis_a;
    return out;
}

fitted_plane_t compose(const CPose3D& pose, const fitted_plane_t& plane)
{
    fitted_plane_t out = compose(pose, static_cast<const plane_patch_t&>(plane));
    out.fit = plane.fit;
    if (out.fit) out.fit->axis_u = rotation_of(pose) * plane.fit->axis_u;
    return out;
}

}  // namespace mp2p_icp
