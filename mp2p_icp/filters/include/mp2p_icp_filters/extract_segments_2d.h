#pragma once

#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/fitted_line.h>
#include <mrpt/maps/CPointsMap.h>

#include <cstdint>
#include <vector>

namespace mp2p_icp_filters
{
/// What counts as a wall in a 2-D scan.
struct SegmentParameters : public mp2p_icp::Parameterizable
{
    double maximum_gap = 0.5;      ///< between neighbours on one wall, m
    double split_distance = 0.05;  ///< of a point from the chord beyond which a wall has a corner there, m
    uint32_t minimum_inliers = 8;  ///< points
    double minimum_length = 0.4;   ///< m
    double maximum_noise = 0.03;   ///< standard deviation of the points' distance from the wall, m
    double minimum_corner_angle_deg = 30;  ///< between walls that make a corner, and from being the same
    double corner_distance = 0.3;          ///< of the walls' ends from their corner, m

    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
};

/// A piece of a wall. Its director runs counter-clockwise as seen from the sensor; axis a is level.
struct Segment2d
{
    mp2p_icp::fitted_line_t line;
    std::vector<uint32_t> inliers;  ///< indices, in the order of their azimuth
};

struct Segments2d
{
    std::vector<Segment2d> segments;  ///< counter-clockwise, from the farthest point on
    /// Where neighbouring segments meet: of each corner the place, in the same order.
    std::vector<mrpt::math::TPoint3D> corners;
};

/** Walls and corners in a scan of a laser that turns in a plane z = constant.
 *
 * The points are sorted by their azimuth around the sensor, from the farthest one on (which is the end of a
 * wall: along a wall, distance is convex), cut at gaps, and each run is split where it is
 * farthest from the chord of its ends, again and again (U. Ramer, 1972; D. Douglas and T. Peucker, 1973).
 * Pieces that one line explains are joined again; each line is fitted by least squares across it, two
 * points at both ends of a piece (which may belong to the next wall) left out. A corner is where the lines of
 * two neighbouring segments cross, if both end near it.
 *
 * Fits: as for poles (sandwich of squared residuals) along axis a; a level scan knows nothing of the line's
 * height and slope, which get UNKNOWN_VARIANCE.
 *
 * Points that are not finite, or at the sensor, are left out. Reads only, in one thread. O(points log
 * points). \param sensor Where the laser stood, in the frame of the cloud, m; its z does not matter.
 * \exception std::invalid_argument for parameters out of range, and for a cloud whose points are not of one
 * height (to 1 mm and float rounding).
 */
Segments2d extract_segments_2d(const mrpt::maps::CPointsMap& cloud, const SegmentParameters& parameters = {},
                               const Eigen::Vector3d& sensor = Eigen::Vector3d::Zero());

/// Of what a scan tells nothing about; m^2 and rad^2.
constexpr double UNKNOWN_VARIANCE = 1e4;

}  // namespace mp2p_icp_filters
