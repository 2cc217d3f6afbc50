#pragma once

#include <mp2p_icp/Pairings.h>
#include <mrpt/core/optional_ref.h>
#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/math/CVectorFixed.h>
#include <mrpt/poses/CPose3D.h>

namespace mp2p_icp
{
/** \file Residuals of one pairing at the pose (R, t) of local with respect to global, and their Jacobians by
 * the 12 entries of the pose's matrix: the columns of R one after the other, then t.
 *
 * Positions are in metres, directions are unit vectors (normalised here) without unit. A direction of zero
 * length, like any other input that is not finite, gives NaN. Thread-safe; O(1).
 */
template <int ROWS>
using ErrorTermJacobian = mrpt::math::CMatrixFixed<double, ROWS, 12>;

/// R p + t - q.
mrpt::math::CVectorFixedDouble<3> error_point2point(
    const mrpt::tfest::TMatchingPair_d& pairing, const mrpt::poses::CPose3D& relativePose,
    mrpt::optional_ref<ErrorTermJacobian<3>> jacobian = std::nullopt);

/// (I - u u')(R p + t - q): from the nearest point of the global line (point q, unit direction u) to the
/// local point. Rank 2.
mrpt::math::CVectorFixedDouble<3> error_point2line(
    const point_line_pair_t& pairing, const mrpt::poses::CPose3D& relativePose,
    mrpt::optional_ref<ErrorTermJacobian<3>> jacobian = std::nullopt);

/** n n'(R p + t - q): from the nearest point of the global plane (unit normal n, through the patch's
 * centroid q) to the local point; the signed distance along the normal, times the normal. Rank 1.
 */
mrpt::math::CVectorFixedDouble<3> error_point2plane(
    const point_plane_pair_t& pairing, const mrpt::poses::CPose3D& relativePose,
    mrpt::optional_ref<ErrorTermJacobian<3>> jacobian = std::nullopt);

/** In two coordinates across the global line (unit direction u_g, base point q): first those of the direction
 * s R u_l, then those of the position R p + t - q, p the local line's base point. Directions have no sign: s
 * is +1 or -1, such that s R u_l and u_g differ by 90 degrees at most. The coordinates are an orthonormal
 * basis of the plane perpendicular to u_g that depends on u_g alone. The first two have the norm sin(angle
 * between the lines).
 */
mrpt::math::CVectorFixedDouble<4> error_line2line(
    const matched_line_t& pairing, const mrpt::poses::CPose3D& relativePose,
    mrpt::optional_ref<ErrorTermJacobian<4>> jacobian = std::nullopt);

/// R n_l - n_g: unit normals, oriented alike (towards the sensor). The planes' positions do not enter.
mrpt::math::CVectorFixedDouble<3> error_plane2plane(
    const matched_plane_t& pairing, const mrpt::poses::CPose3D& relativePose,
    mrpt::optional_ref<ErrorTermJacobian<3>> jacobian = std::nullopt);

}  // namespace mp2p_icp
