#pragma once

#include <mrpt/math/TPlane.h>
#include <mrpt/math/TPoint3D.h>

#include <Eigen/Dense>
#include <cstdint>
#include <optional>

namespace mp2p_icp
{
/** A plane and the centroid of the patch of it that was seen. The normal (a,b,c of `plane`) is a unit vector
 * that points out of the measured surface, towards the sensor, where its side is known.
 */
struct plane_patch_t
{
    mrpt::math::TPlane plane;
    mrpt::math::TPoint3D centroid = {0, 0, 0};

    plane_patch_t() = default;
    plane_patch_t(const mrpt::math::TPlane& p, const mrpt::math::TPoint3D& c) : plane(p), centroid(c) {}
};

/** How far a plane that was fitted to points was seen, and how well it is known. Coordinates u along axis_u
 * and v along (normal x axis_u) are counted from the centroid, in metres.
 */
struct plane_fit_t
{
    Eigen::Vector3d axis_u =
        Eigen::Vector3d::UnitX();  ///< unit, across the normal, in the frame of the patch
    double u_min = 0, u_max = 0, v_min = 0, v_max = 0;  ///< the box around the inliers
    uint64_t inliers = 0;                               ///< how many points it was fitted to
    double sigma = 0;  ///< noise: standard deviation of their distance to the plane, m
    /** Of the errors (a, b, h): the true plane is at the height h + a u + b v above the fitted one, its
     * normal being that of the patch - a axis_u - b axis_v, to first order. rad^2, rad m, m^2. So h is the
     * error of the centroid along the normal; along the plane it has none that matters.
     */
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

    /// Standard deviation of the normal along its least known direction, rad.
    double angle_deviation() const;
    /// Standard deviation of the plane's height at the centroid, m.
    double offset_deviation() const;
    /// Is it something that a fit may give: finite numbers, a unit axis, a box that is not turned inside out,
    /// no negative variance?
    bool is_sound() const;
};

/// A patch of a map, with its fit where that is known.
struct fitted_plane_t : public plane_patch_t
{
    std::optional<plane_fit_t> fit;

    using plane_patch_t::plane_patch_t;
    fitted_plane_t() = default;
    // A patch of which nothing more is known; not explicit, so that patches may be put into maps.
    fitted_plane_t(const plane_patch_t& patch) : plane_patch_t(patch) {}
    fitted_plane_t(const plane_patch_t& patch, const plane_fit_t& f) : plane_patch_t(patch), fit(f) {}

    Eigen::Vector3d normal() const { return {plane.coefs[0], plane.coefs[1], plane.coefs[2]}; }
};

}  // namespace mp2p_icp
