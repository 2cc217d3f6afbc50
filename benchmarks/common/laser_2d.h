#pragma once

#include <mp2p_icp/synthetic/scans.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

namespace mp2p_icp_bench
{
/// The scan of a 2-D laser as its driver gives it: ranges, and which of them are valid.
mrpt::obs::CObservation2DRangeScan laser_observation(const mp2p_icp::synthetic::RayTracer& world,
                                                     const mrpt::poses::CPose3D& from,
                                                     const mp2p_icp::synthetic::LaserScanner2D& laser);
}  // namespace mp2p_icp_bench
