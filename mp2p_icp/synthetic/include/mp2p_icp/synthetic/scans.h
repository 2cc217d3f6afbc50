#pragma once

#include <mp2p_icp/synthetic/RayTracer.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/poses/CPose3D.h>

#include <vector>

namespace mp2p_icp::synthetic
{
/// What all range sensors have.
struct RangeSensor
{
    double max_range = 100;  ///< m; what is farther away is not seen
    double sigma = 0;        ///< standard deviation of the noise added along each beam, m
    uint64_t seed = 0;       ///< of the noise
};

/// A laser that turns in its own x-y plane, counter-clockwise from -aperture/2 to aperture/2, both ends
/// included.
struct LaserScanner2D : RangeSensor
{
    size_t beams = 361;         ///< at least 2
    double aperture_deg = 180;  ///< in (0, 360]
};

/// A LiDAR whose rings turn about its z axis: azimuths 0, 360/azimuth_steps, ... for each ring from the
/// lowest to the highest.
struct RotatingLidar : RangeSensor
{
    size_t rings = 16;                          ///< at least 1
    size_t azimuth_steps = 900;                 ///< per turn; at least 1
    double lowest_deg = -15, highest_deg = 15;  ///< of the rings above the x-y plane, in [-90, 90]
};

/// A scan, and the truth behind it. Beams that meet nothing leave no point; the vectors run parallel to the
/// points.
struct SyntheticScan
{
    mrpt::maps::CSimplePointsMap::Ptr points;  ///< sensor frame
    std::vector<double> true_range;            ///< before noise, m
    std::vector<uint32_t> beam;                ///< index of the beam, in firing order
    std::vector<uint32_t> triangle;            ///< of the mesh, that the beam met
};

/** What a sensor at `T_world_sensor` measures. The noise of beam i depends on the seed and i only: a beam
 * keeps its noise whatever the other beams meet.
 * \exception std::invalid_argument for a parameter out of its range.
 */
SyntheticScan scan_from(const RayTracer& world, const mrpt::poses::CPose3D& T_world_sensor,
                        const LaserScanner2D& sensor);
SyntheticScan scan_from(const RayTracer& world, const mrpt::poses::CPose3D& T_world_sensor,
                        const RotatingLidar& sensor);

}  // namespace mp2p_icp::synthetic
