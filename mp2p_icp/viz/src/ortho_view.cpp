#include <mp2p_icp/ortho_view.h>
#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
using mrpt::math::TPoint2D;
using mrpt::math::TPoint3D;
using mrpt::math::TVector3D;

namespace
{
double dot(const TVector3D& a, const TVector3D& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
}  // namespace

TVector3D OrthoView::towards_eye() const
{
    const double az = mrpt::DEG2RAD(azimuth_deg), el = mrpt::DEG2RAD(elevation_deg);
    return {std::cos(az) * std::cos(el), std::sin(az) * std::cos(el), std::sin(el)};
}

TVector3D OrthoView::up() const
{
    const double az = mrpt::DEG2RAD(azimuth_deg), el = mrpt::DEG2RAD(elevation_deg);
    return {-std::cos(az) * std::sin(el), -std::sin(az) * std::sin(el), std::cos(el)};
}

TVector3D OrthoView::right() const
{
    const double az = mrpt::DEG2RAD(azimuth_deg);
    return {-std::sin(az), std::cos(az), 0};
}

TPoint2D OrthoView::project(const TPoint3D& point, int width_px, int height_px) const
{
    const TVector3D from_focus = point - focus;
    const double px_per_metre = height_px / height;
    return {0.5 * width_px + px_per_metre * dot(right(), from_focus),
            0.5 * height_px - px_per_metre * dot(up(), from_focus)};
}

TPoint3D OrthoView::in_scene(const TPoint3D& point) const
{
    return (point - focus) * (1 / height);
}

mrpt::opengl::CCamera OrthoView::camera(int width_px, int height_px) const
{
    // Axes of MRPT's cameras: x to the right, y down, z forwards.
    Eigen::Matrix3d R_world_camera;
    R_world_camera << to_eigen(right()), -to_eigen(up()), -to_eigen(towards_eye());
    const Eigen::Vector3d eye = to_eigen(towards_eye()) * (depth / height);
    mrpt::opengl::CCamera camera;
    camera.set6DOFMode(true);
    camera.setPose(make_pose(R_world_camera, eye));
    camera.setOrthogonal();
    // MRPT shows half the zoom distance along the shorter side of the picture.
    const double shorter_side = std::min(1.0, static_cast<double>(width_px) / height_px);
    camera.setZoomDistance(static_cast<float>(2 * shorter_side));
    return camera;
}

}  // namespace mp2p_icp
