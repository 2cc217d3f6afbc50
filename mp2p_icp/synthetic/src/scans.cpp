#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mrpt/core/bits_math.h>

#include <stdexcept>

namespace mp2p_icp::synthetic
{
namespace
{
void check(bool rule, const char* text)
{
    if (!rule) throw std::invalid_argument(std::string("scan_from: ") + text);
}

Eigen::Vector3d unit_direction(double azimuth, double elevation)
{
    return {std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
            std::sin(elevation)};
}

/// Fires all beams (unit vectors in the sensor's frame).
SyntheticScan fire(const RayTracer& world, const mrpt::poses::CPose3D& T_world_sensor,
                   const RangeSensor& sensor, const std::vector<Eigen::Vector3d>& beams)
{
    check(sensor.max_range > 0, "max_range must be above zero");
    check(sensor.sigma >= 0, "sigma must not be negative");
    check(is_finite(T_world_sensor), "T_world_sensor must be finite");
    const Eigen::Matrix3d R_world_sensor = rotation_of(T_world_sensor);
    const Eigen::Vector3d origin = translation_of(T_world_sensor);
    SeededRandom random(sensor.seed);
    SyntheticScan scan;
    scan.points = mrpt::maps::CSimplePointsMap::Create();
    for (size_t i = 0; i < beams.size(); i++)
    {
        const double noise = random.gaussian(sensor.sigma);  // drawn for each beam, hit or not
        const auto hit = world.first_hit(origin, (R_world_sensor * beams[i]).normalized(), sensor.max_range);
        if (!hit || hit->range + noise <= 0) continue;
        const Eigen::Vector3f point = ((hit->range + noise) * beams[i]).cast<float>();
        scan.points->insertPoint(point.x(), point.y(), point.z());
        scan.true_range.push_back(hit->range);
        scan.beam.push_back(static_cast<uint32_t>(i));
        scan.triangle.push_back(hit->triangle);
    }
    return scan;
}
}  // namespace

SyntheticScan scan_from(const RayTracer& world, const mrpt::poses::CPose3D& T_world_sensor,
                        const LaserScanner2D& sensor)
{
    check(sensor.beams >= 2, "beams must be at least 2");
    check(sensor.aperture_deg > 0 && sensor.aperture_deg <= 360, "aperture_deg must be in (0, 360]");
    std::vector<Eigen::Vector3d> beams;
    const double aperture = mrpt::DEG2RAD(sensor.aperture_deg);
    const double step = aperture / static_cast<double>(sensor.beams - 1);
    for (size_t i = 0; i < sensor.beams; i++)
        beams.push_back(unit_direction(-0.5 * aperture + step * static_cast<double>(i), 0));
    return fire(world, T_world_sensor, sensor, beams);
}

SyntheticScan scan_from(const RayTracer& world, const mrpt::poses::CPose3D& T_world_sensor,
                        const RotatingLidar& sensor)
{
    check(sensor.rings >= 1 && sensor.azimuth_steps >= 1, "rings and azimuth_steps must be at least 1");
    check(-90 <= sensor.lowest_deg && sensor.lowest_deg <= sensor.highest_deg && sensor.highest_deg <= 90,
          "-90 <= lowest_deg <= highest_deg <= 90 must hold");
    std::vector<Eigen::Vector3d> beams;
    const double lowest = mrpt::DEG2RAD(sensor.lowest_deg), highest = mrpt::DEG2RAD(sensor.highest_deg);
    const double ring_step =
        sensor.rings > 1 ? (highest - lowest) / static_cast<double>(sensor.rings - 1) : 0;
    const double azimuth_step = 2 * M_PI / static_cast<double>(sensor.azimuth_steps);
    for (size_t ring = 0; ring < sensor.rings; ring++)
        for (size_t i = 0; i < sensor.azimuth_steps; i++)
            beams.push_back(unit_direction(azimuth_step * static_cast<double>(i),
                                           lowest + ring_step * static_cast<double>(ring)));
    return fire(world, T_world_sensor, sensor, beams);
}

}  // namespace mp2p_icp::synthetic
