#pragma once

#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/fitted_line.h>
#include <mp2p_icp/plane_patch.h>
#include <mrpt/maps/CPointsMap.h>

#include <vector>

namespace mp2p_icp_filters
{
/// When two planes make a line.
struct IntersectionParameters : public mp2p_icp::Parameterizable
{
    double minimum_angle_deg = 30;  ///< between the planes, and from being the same
    double touch_distance = 0.20;   ///< how near to the line both planes must have points, m
    double minimum_length = 0.5;    ///< of the pieces of the line where both have, together, m

    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
};

/** The lines in which planes of one cloud meet, where both touch: within touch_distance of the line, and at
 * the same place along it (in pieces of 0.25 m), there are points that lie in the one plane and not in the
 * other, of both kinds. (These need not be inliers, which keep clear of edges.)
 *
 * Base point: the middle between the first and the last such piece. The largest component of the director is
 * positive. Axis b is the normal of the first plane. The covariance follows from those of the planes: a
 * displacement x of the line must climb the error of each plane there, n'x = height, and its turn the slope.
 * As inliers count the points of those pieces; sigma is the mean of both planes.
 *
 * In the order of the pairs (first, second) of planes. Planes without a sound fit make none. Reads only, in
 * one thread. O(planes^2 x points near the lines).
 * \exception std::invalid_argument for parameters out of range.
 */
std::vector<mp2p_icp::fitted_line_t> intersect_planes(const mrpt::maps::CPointsMap& cloud,
                                                      const std::vector<mp2p_icp::fitted_plane_t>& planes,
                                                      const IntersectionParameters& parameters = {});

}  // namespace mp2p_icp_filters
