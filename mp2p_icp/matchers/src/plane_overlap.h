#pragma once

#include <mp2p_icp/plane_patch.h>

#include <array>

namespace mp2p_icp
{
/// The box around the inliers of a plane.
struct PlaneBox
{
    Eigen::Vector3d centroid, axis_u, axis_v;
    std::array<Eigen::Vector3d, 4> corners;  ///< counter-clockwise seen from the tip of the normal
};
PlaneBox box_of(const Eigen::Vector3d& centroid, const Eigen::Vector3d& normal, const plane_fit_t& fit);

/// Area of what two boxes share, projected into the plane of `a`, over the area of the smaller one; 0 if that
/// has none.
double shared_area(const PlaneBox& a, const PlaneBox& b);

}  // namespace mp2p_icp
