#pragma once

#include <mp2p_icp/metricmap.h>
#include <mrpt/obs/CObservation.h>

#include <optional>

namespace mp2p_icp
{
/// How observations become points.
struct ObservationPointsOptions
{
    /** For 2-D range scans: adds points along the segment between consecutive rays whose ends are at most
     * this far apart (m), so that neighbours of the densified cloud are close to point-to-line projections.
     * 0: off. Rays without a valid range are never bridged. The measured points stay first, in the order of
     * the rays; the added ones follow, also in that order. Only for plain CObservation2DRangeScan.
     */
    double scan_2d_interpolate_up_to = 0.0;
    double scan_2d_interpolation_step =
        0.05;  ///< greatest distance of neighbouring added points, m; at least 0.001
};

/// Does the observation hold ranges or points that insert_observation_points() can use?
bool has_points(const mrpt::obs::CObservation& observation);

/** Appends the points of an observation to a cloud, in the robot's frame: the sensor's pose on the robot is
 * always applied, once. Thread-safe for different clouds. O(points).
 *  - CObservation2DRangeScan: one point per valid positive range, in ray order; intensities as they are;
 *    deltaPitch is applied;
 *  - CObservation3DRangeScan (RGB-D): the range image, unprojected, or else the points it holds; colours from
 *    the image;
 *  - CObservationVelodyneScan: its point_cloud if it has one, else all its packets within the sensor's
 * limits;
 *  - CObservationRotatingScan: with one row, or of a VLP-16 (the observation holds no elevations; those of
 *    other sensors are unknown). It holds no azimuth per firing either: a constant turning rate is assumed,
 *    which was good to 0.2 degrees on real data;
 *  - CObservationPointCloud: all points, read from its file if it is stored there.
 *
 * Fields are kept as append_points() says; intensities of 8 bits become 0..1. Points that are not finite are
 * dropped. The observation is not changed (MRPT loads and generates points lazily: a copy is made where that
 * is needed). \return the number of points that were dropped because they are not finite, or empty if the
 * kind of observation has no points. \exception DataError if the contents cannot be read (a missing file,
 * ...); std::invalid_argument for wrong options.
 */
std::optional<uint64_t> insert_observation_points(const mrpt::obs::CObservation& observation,
                                                  mrpt::maps::CPointsMap& points,
                                                  const ObservationPointsOptions& options = {});

}  // namespace mp2p_icp
