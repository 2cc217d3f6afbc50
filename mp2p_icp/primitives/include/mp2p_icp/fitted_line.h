#pragma once

#include <mrpt/math/TLine3D.h>

#include <Eigen/Dense>
#include <cstdint>
#include <optional>

namespace mp2p_icp
{
/** How far a line that was fitted to points was seen, and how well it is known. Coordinates s along the
 * (unit) director, a along axis_a and b along (director x axis_a) are counted from the base point, in metres.
 */
struct line_fit_t
{
    Eigen::Vector3d axis_a =
        Eigen::Vector3d::UnitX();  ///< unit, across the director, in the frame of the line
    double begin = 0, end = 0;     ///< what was seen of it: s from begin to end
    uint64_t inliers = 0;          ///< how many points it rests on
    double sigma = 0;              ///< noise: rms distance of these points from the line or its planes, m
    /** Of the errors (x, y, p, q): at s, the true line passes at a = x + p s, b = y + q s, to first order.
     * m^2, rad m, rad^2.
     */
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();

    double length() const { return end - begin; }
    /// Standard deviation of the director along its least known direction, rad.
    double angle_deviation() const;
    /// Standard deviation of the base point across the line along its least known direction, m.
    double offset_deviation() const;
    /// Is it something that a fit may give: finite numbers, a unit axis, begin <= end, no negative variance?
    bool is_sound() const;
};

/// A line of a map, with its fit where that is known.
struct fitted_line_t : public mrpt::math::TLine3D
{
    std::optional<line_fit_t> fit;

    fitted_line_t() = default;
    // A line of which nothing more is known; not explicit, so that lines may be put into maps.
    fitted_line_t(const mrpt::math::TLine3D& line) : mrpt::math::TLine3D(line) {}
    fitted_line_t(const mrpt::math::TLine3D& line, const line_fit_t& f) : mrpt::math::TLine3D(line), fit(f) {}
};

}  // namespace mp2p_icp
