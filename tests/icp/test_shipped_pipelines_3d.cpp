// The shipped pipelines of 3-D scans, each on ray-traced scans of what it was made for.
#include <gtest/gtest.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>

#include "icp_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using namespace mp2p_icp::synthetic;

namespace
{
/// Of a street, 2 cm of noise along the beams.
mrpt::maps::CSimplePointsMap::Ptr lidar_scan(const RayTracer& world, const CPose3D& pose, uint64_t seed)
{
    RotatingLidar lidar;
    lidar.rings = 32, lidar.azimuth_steps = 600, lidar.lowest_deg = -25, lidar.highest_deg = 15;
    lidar.max_range = 60, lidar.sigma = 0.02, lidar.seed = seed;
    return scan_from(world, pose, lidar).points;
}

/// A depth camera that looks along x, 160 x 120 pixels and 57 degrees wide, whose error grows with the square
/// of the depth: 1.5 mm at 1 m.
mrpt::maps::CSimplePointsMap::Ptr depth_image(const RayTracer& world, const CPose3D& pose, uint64_t seed)
{
    SeededRandom random(seed);
    auto points = mrpt::maps::CSimplePointsMap::Create();
    const Eigen::Matrix3d R = rotation_of(pose);
    for (int v = -60; v < 60; v++)
        for (int u = -80; u < 80; u++)
        {
            const Eigen::Vector3d pixel(1, -u / 147.0, -v / 147.0);  // at a depth of 1 m
            const auto hit = world.first_hit(translation_of(pose), R * pixel.normalized(), 10);
            const double error = random.gaussian();
            if (!hit) continue;
            const double depth = hit->range / pixel.norm();
            const Eigen::Vector3f p = (pixel * (depth + 0.0015 * depth * depth * error)).cast<float>();
            points->insertPoint(p.x(), p.y(), p.z());
        }
    return points;
}

Results align_with(const std::string& name, metric_map_t local, metric_map_t global)
{
    Pipeline pipeline = pipeline_from_yaml(yaml_from_text(shipped_pipeline(name)));
    for (auto* map : {&local, &global})
        mp2p_icp_filters::apply_filter_pipeline(pipeline.filters.at("filters"), *map);
    Results r;
    pipeline.icp->align(local, global, {}, pipeline.parameters, r);
    return r;
}

void expect_right(const std::string& name, const Results& r, const CPose3D& truth, double metres,
                  double degrees)
{
    const double m = translation_error(r.optimal_tf.mean, truth),
                 deg = mrpt::RAD2DEG(rotation_error(r.optimal_tf.mean, truth));
    std::cout << name << ": " << m << " m, " << deg << " deg; " << r.nIterations << " iterations, "
              << r.finalPairings.contents_summary() << ", quality " << r.quality << "\n";
    EXPECT_EQ(r.verdict, Verdict::aligned) << name << ": " << r.verdict_reason;
    EXPECT_LT(m, metres) << name;
    EXPECT_LT(deg, degrees) << name;
}
}  // namespace

// Tolerances: some thousands of points with 2 cm of noise give the pose to less than a millimetre; what is
// left is that the planes of voxels of 0.25 m across edges and poles are wrong by centimetres. Points against
// points are off by 2 cm and 0.6 degrees here: they see the rings.
TEST(shipped_pipelines_3d, lidar_scans_of_a_street)
{
    const CPose3D at = pose_deg(-10, 1, 1.8, 20, 0, 0), near = pose_deg(0.9, -0.4, 0.03, 4, 0.5, -0.4),
                  far = pose_deg(1.8, -0.8, 0.05, 14, 1, -1);
    for (const uint64_t seed : {1u, 2u})
    {
        const RayTracer world(street(120, seed));
        const auto global = map_of(lidar_scan(world, at, 10)),
                   local = map_of(lidar_scan(world, at + near, 11)),
                   local_far = map_of(lidar_scan(world, at + far, 12));
        for (const std::string name : {"icp-3d-point-to-plane", "icp-3d-multi-primitive"})
            expect_right(name, align_with(name, local, global), near, 0.01, 0.05);
        expect_right("icp-coarse-to-fine", align_with("icp-coarse-to-fine", local_far, global), far, 0.02,
                     0.1);
    }
}

// Depths at 3 m have noise of 14 mm.
TEST(shipped_pipelines_3d, depth_images_of_a_room)
{
    const CPose3D truth = pose_deg(0.15, -0.08, 0.05, 4, -2, 2);
    for (const uint64_t seed : {1u, 2u, 3u})
    {
        const RayTracer world(room_with_boxes(7, 6, 2.5, 10, seed));
        const CPose3D at = pose_deg(-1, 0, 1.3, 30, 10, 0);
        const Results r = align_with("icp-rgbd", map_of(depth_image(world, at + truth, 21)),
                                     map_of(depth_image(world, at, 20)));
        expect_right("icp-rgbd", r, truth, 0.01, 0.3);
    }
}
