#include "laser_2d.h"

#include <mrpt/core/bits_math.h>

#include <cmath>

namespace mp2p_icp_bench
{
mrpt::obs::CObservation2DRangeScan laser_observation(const mp2p_icp::synthetic::RayTracer& world,
                                                     const mrpt::poses::CPose3D& from,
                                                     const mp2p_icp::synthetic::LaserScanner2D& laser)
{
    const auto seen = scan_from(world, from, laser);
    mrpt::obs::CObservation2DRangeScan scan;
    scan.aperture = static_cast<float>(mrpt::DEG2RAD(laser.aperture_deg));
    scan.rightToLeft = true;
    scan.maxRange = static_cast<float>(laser.max_range);
    scan.resizeScan(laser.beams);
    for (size_t beam = 0; beam < laser.beams; beam++) scan.setScanRangeValidity(beam, false);
    for (size_t i = 0; i < seen.beam.size(); i++)
    {
        mrpt::math::TPoint3D p;
        seen.points->getPoint(i, p);
        scan.setScanRange(seen.beam[i], static_cast<float>(std::hypot(p.x, p.y)));
        scan.setScanRangeValidity(seen.beam[i], true);
    }
    return scan;
}
}  // namespace mp2p_icp_bench
