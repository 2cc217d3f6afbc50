#include <mp2p_icp/numbers.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <cmath>

#include "sensor_clouds.h"

namespace mp2p_icp
{
using mrpt::maps::CPointsMap;
using mrpt::obs::CObservation2DRangeScan;

namespace
{
/// A range that the sensor says it measured. NaN is one: the caller counts it.
bool is_return(const CObservation2DRangeScan& scan, size_t ray)
{
    return scan.getScanRangeValidity(ray) && !(scan.getScanRange(ray) <= 0);
}

mrpt::math::TPoint3D ray_end(const CObservation2DRangeScan& scan, size_t ray)
{
    const size_t rays = scan.getScanSize();
    const double along = rays > 1 ? static_cast<double>(ray) / static_cast<double>(rays - 1) : 0.5;
    const double angle = (scan.rightToLeft ? 1.0 : -1.0) * static_cast<double>(scan.aperture) * (along - 0.5);
    const double range = static_cast<double>(scan.getScanRange(ray));
    const double x = range * std::cos(angle), y = range * std::sin(angle);
    // The pitch of a nodding sensor grows along the scan; its pose is that of the first ray.
    const double pitch = scan.deltaPitch * along;
    return {x * std::cos(pitch), y, -x * std::sin(pitch)};
}

void check_options(const ObservationPointsOptions& o)
{
    if (!(o.scan_2d_interpolate_up_to >= 0) || std::isinf(o.scan_2d_interpolate_up_to))
        throw std::invalid_argument("scan_2d_interpolate_up_to must be a distance >= 0 m, and is " +
                                    to_text(o.scan_2d_interpolate_up_to));
    if (o.scan_2d_interpolate_up_to > 0 && !(o.scan_2d_interpolation_step >= 1e-3))
        throw std::invalid_argument("scan_2d_interpolation_step must be at least 0.001 m, and is " +
                                    to_text(o.scan_2d_interpolation_step));
}

void add_point(CPointsMap& out, const mrpt::math::TPoint3D& p)
{
    out.insertPointFast(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
}

/// Points between the ends of two neighbouring rays, evenly spaced and at most a step apart.
void add_between(CPointsMap& out, const CObservation2DRangeScan& scan, size_t ray,
                 const ObservationPointsOptions& options)
{
    const auto a = ray_end(scan, ray), b = ray_end(scan, ray + 1);
    const double gap = (b - a).norm();
    if (!(gap <= options.scan_2d_interpolate_up_to)) return;  // also if an end is not finite
    auto* with_intensity = dynamic_cast<mrpt::maps::CPointsMapXYZI*>(&out);
    const double ia = scan.getScanIntensity(ray), ib = scan.getScanIntensity(ray + 1);
    const double parts = std::ceil(gap / options.scan_2d_interpolation_step);
    for (double k = 1; k < parts; k++)
    {
        add_point(out, a + (b - a) * (k / parts));
        if (with_intensity)
            with_intensity->setPointIntensity(out.size() - 1,
                                              static_cast<float>(ia + (ib - ia) * (k / parts)));
    }
}
}  // namespace

CPointsMap::ConstPtr sensor_cloud(const CObservation2DRangeScan& scan,
                                  const ObservationPointsOptions& options)
{
    check_options(options);
    CPointsMap::Ptr out = mrpt::maps::CSimplePointsMap::Create();
    const auto with_intensity = scan.hasIntensity() ? mrpt::maps::CPointsMapXYZI::Create() : nullptr;
    if (with_intensity) out = with_intensity;
    const size_t rays = scan.getScanSize();
    for (size_t i = 0; i < rays; i++)
    {
        if (!is_return(scan, i)) continue;
        add_point(*out, ray_end(scan, i));
        if (with_intensity)
            with_intensity->setPointIntensity(out->size() - 1, static_cast<float>(scan.getScanIntensity(i)));
    }
    if (options.scan_2d_interpolate_up_to > 0)
        for (size_t i = 0; i + 1 < rays; i++)
            if (is_return(scan, i) && is_return(scan, i + 1)) add_between(*out, scan, i, options);
    return out;
}

}  // namespace mp2p_icp
