#include "lidar_worlds.h"

#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mrpt/core/bits_math.h>

#include <fstream>
#include <stdexcept>

namespace mp2p_icp_bench
{
using namespace mp2p_icp;
using namespace mp2p_icp::synthetic;
using mrpt::poses::CPose3D;

TriangleMesh room_or_street(uint64_t seed)
{
    return seed % 2 ? room_with_boxes(9, 7, 3, 8, seed) : street(120, seed);
}

CPose3D sensor_pose()
{
    return {0.3, -0.2, 1.4, 0, 0.02, 0.01};
}

metric_map_t lidar_scan(const RayTracer& world, const CPose3D& from, uint64_t seed)
{
    RotatingLidar lidar;
    lidar.rings = 64, lidar.azimuth_steps = 450, lidar.lowest_deg = -50, lidar.highest_deg = 40;
    lidar.max_range = 40, lidar.sigma = 0.02, lidar.seed = seed;
    metric_map_t map;
    map.layers[metric_map_t::PT_LAYER_RAW] = scan_from(world, from, lidar).points;
    return map;
}

CPose3D moved_by(double metres, double degrees, SeededRandom& random)
{
    const auto unit = [&]
    {
        const double x = random.gaussian(), y = random.gaussian(), z = random.gaussian();
        return Eigen::Vector3d(x, y, z).normalized();
    };
    const Eigen::Vector3d t = metres * unit();
    return make_pose(Eigen::AngleAxisd(mrpt::DEG2RAD(degrees), unit()).toRotationMatrix(), t);
}

CPose3D pose_of_file(const std::string& path)
{
    std::ifstream in(path);
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; i++) in >> m(i / 4, i % 4);
    if (!in) throw std::runtime_error("cannot read 16 numbers from '" + path + "'");
    return make_pose(m.topLeftCorner<3, 3>(), m.topRightCorner<3, 1>());
}

double error_m(const CPose3D& pose, const CPose3D& truth)
{
    return (translation_of(pose) - translation_of(truth)).norm();
}
double error_deg(const CPose3D& pose, const CPose3D& truth)
{
    return mrpt::RAD2DEG(rotation_angle(rotation_of(truth).transpose() * rotation_of(pose)));
}
}  // namespace mp2p_icp_bench
