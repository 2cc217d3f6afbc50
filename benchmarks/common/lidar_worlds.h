#pragma once

#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/synthetic/RayTracer.h>
#include <mrpt/poses/CPose3D.h>

#include <string>

/// Ray-traced scans and random motions that several benchmarks share.
namespace mp2p_icp_bench
{
/// Odd seeds: a room with boxes; even ones: a street.
mp2p_icp::synthetic::TriangleMesh room_or_street(uint64_t seed);
/// Where a sensor stands in either.
mrpt::poses::CPose3D sensor_pose();

/// Of a LiDAR with 64 rings from -50 to 40 degrees, 450 azimuths, and 2 cm of noise: the layer `raw`.
mp2p_icp::metric_map_t lidar_scan(const mp2p_icp::synthetic::RayTracer& world,
                                  const mrpt::poses::CPose3D& from, uint64_t seed);

/// By so much, in a direction and about an axis that are uniform on the sphere.
mrpt::poses::CPose3D moved_by(double metres, double degrees, mp2p_icp::SeededRandom& random);

/// Of a text file with a 4x4 matrix. \exception std::runtime_error
mrpt::poses::CPose3D pose_of_file(const std::string& path);

double error_m(const mrpt::poses::CPose3D& pose, const mrpt::poses::CPose3D& truth);
double error_deg(const mrpt::poses::CPose3D& pose, const mrpt::poses::CPose3D& truth);
}  // namespace mp2p_icp_bench
