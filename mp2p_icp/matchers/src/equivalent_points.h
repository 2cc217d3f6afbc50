#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/fitted_line.h>
#include <mp2p_icp/plane_patch.h>
#include <mrpt/poses/CPose3D.h>

namespace mp2p_icp
{
/** \file equivalent_points.h
 * A pair of fitted primitives as weighted point-plane pairings whose squared residuals add up to
 * unit_variance times e' S^-1 e, e being the difference of both primitives and S the sum of the covariances
 * of their fits: to first order in the angle between them, least squares over such pairings is the
 * maximum-likelihood pose. One weight per pair cannot say as much, as a plane's normal is known better along
 * one axis than along the other.
 */

/// Fits without noise are not infinitely sure: m^2 (and rad^2), added to variances.
constexpr double ROUNDING_VARIANCE = 1e-14;

struct WeightedPointPlanes
{
    MatchedPointPlaneList pairs;  ///< both sides in the global frame
    WeightRuns weights;

    /// Adds them to the pairings of a local map that lies at `pose`.
    void append_to(Pairings& out, const mrpt::poses::CPose3D& pose) const;
};

/** Of planes: four points of the local one, on its principal axes of information, to the global plane.
 * \param global, local with fits; the local one as it lies in the global frame, normals within 90 degrees
 */
WeightedPointPlanes equivalent_points(const fitted_plane_t& global, const fitted_plane_t& local,
                                      double unit_variance);

/** Of lines: two points of the local line to each of two planes through the global one. Exact if the errors
 * along the normals of these planes are independent, as they are for the line in which two planes meet; else
 * what they have in common is dropped. \param global, local as for planes; directors of either sign
 */
WeightedPointPlanes equivalent_points(const fitted_line_t& global, const fitted_line_t& local,
                                      double unit_variance);

}  // namespace mp2p_icp
