#include <gtest/gtest.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mrpt/core/bits_math.h>

#include <cmath>

using namespace mp2p_icp::synthetic;
using mrpt::DEG2RAD;
using mrpt::poses::CPose3D;

namespace
{
mrpt::math::TPoint3D point(const SyntheticScan& scan, size_t i)
{
    mrpt::math::TPoint3D p;
    scan.points->getPoint(i, p.x, p.y, p.z);
    return p;
}
}  // namespace

TEST(scans, a_laser_scan_seen_from_its_pose_lies_on_the_walls)
{
    const auto room = room_with_boxes(12, 8, 2.5, 6, 4);
    const CPose3D T_world_sensor(0.5, -0.3, 1.0, 0.7, 0.05, -0.1);
    const auto scan = scan_from(RayTracer(room), T_world_sensor, LaserScanner2D());
    ASSERT_EQ(scan.points->size(), 361u) << "the room is closed";
    for (size_t i = 0; i < scan.points->size(); i++)
    {
        const auto p = point(scan, i);
        EXPECT_EQ(p.z, 0);  // in the plane of the sensor, in its frame
        const auto seen = mp2p_icp::to_eigen(T_world_sensor.composePoint(p));
        EXPECT_LT(room.triangle(scan.triangle[i]).distance_to(seen), 1e-6 * 12);  // float points
        EXPECT_NEAR(p.norm(), scan.true_range[i], 1e-6 * 12);
    }
}

TEST(scans, the_beams_of_a_laser_scan_are_spread_over_its_aperture)
{
    LaserScanner2D sensor;
    sensor.beams = 5;
    sensor.aperture_deg = 240;
    const auto scan = scan_from(RayTracer(box_room(10, 10, 3)), CPose3D(0, 0, 1, 0, 0, 0), sensor);
    ASSERT_EQ(scan.points->size(), 5u);
    for (size_t i = 0; i < 5; i++)
    {
        const auto p = point(scan, i);
        EXPECT_NEAR(std::atan2(p.y, p.x), DEG2RAD(-120.0 + 60.0 * static_cast<double>(i)), 1e-6);
    }
    EXPECT_NEAR(point(scan, 2).x, 5.0, 1e-6) << "the middle beam looks along x";
}

TEST(scans, the_rings_of_a_lidar_have_their_elevations)
{
    RotatingLidar sensor;
    sensor.rings = 3;
    sensor.lowest_deg = -20;
    sensor.highest_deg = 10;
    sensor.azimuth_steps = 8;
    const CPose3D T_world_sensor(1, 1, 1, 0.3, 0.2, 0.1);
    const auto scan = scan_from(RayTracer(box_room(10, 10, 3)), T_world_sensor, sensor);
    ASSERT_EQ(scan.points->size(), 24u);
    for (size_t i = 0; i < 24; i++)
    {
        const auto p = point(scan, i);
        EXPECT_NEAR(std::asin(p.z / p.norm()), DEG2RAD(-20.0 + 15.0 * static_cast<double>(i / 8)), 1e-6);
        const double turn =
            std::remainder(std::atan2(p.y, p.x) - DEG2RAD(45.0 * static_cast<double>(i % 8)), 2 * M_PI);
        EXPECT_NEAR(turn, 0, 1e-6);
        EXPECT_EQ(scan.beam[i], i);
    }
}

TEST(scans, noise_has_the_given_sigma_along_the_beam)
{
    RotatingLidar sensor;
    sensor.sigma = 0.03;
    sensor.seed = 9;
    const RayTracer world(box_room(20, 14, 5));
    const CPose3D T_world_sensor(2, 1, 1.7, 0.5, 0, 0);
    const auto noisy = scan_from(world, T_world_sensor, sensor);
    sensor.sigma = 0;
    const auto clean = scan_from(world, T_world_sensor, sensor);
    ASSERT_EQ(noisy.points->size(), clean.points->size());
    double sum = 0, squares = 0;
    const auto n = static_cast<double>(noisy.points->size());
    for (size_t i = 0; i < noisy.points->size(); i++)
    {
        const auto p = point(noisy, i), q = point(clean, i);
        const double error = p.norm() - noisy.true_range[i];
        sum += error;
        squares += error * error;
        EXPECT_NEAR(p.x * q.y - p.y * q.x, 0, 2e-6 * p.norm() * q.norm()) << "off the beam";
        EXPECT_EQ(noisy.true_range[i], clean.true_range[i]);
    }
    EXPECT_NEAR(sum / n, 0, 5 * 0.03 / std::sqrt(n));  // 5 standard errors
    EXPECT_NEAR(std::sqrt(squares / n), 0.03, 5 * 0.03 / std::sqrt(2 * n));
}

TEST(scans, same_seed_same_scan_other_seed_other_noise)
{
    LaserScanner2D sensor;
    sensor.sigma = 0.01;
    const RayTracer world(box_room(6, 6, 3));
    const CPose3D at(0, 0, 1, 0, 0, 0);
    const auto a = scan_from(world, at, sensor), b = scan_from(world, at, sensor);
    sensor.seed = 1;
    const auto c = scan_from(world, at, sensor);
    EXPECT_EQ(a.points->getPointsBufferRef_x(), b.points->getPointsBufferRef_x());
    EXPECT_EQ(a.points->getPointsBufferRef_y(), b.points->getPointsBufferRef_y());
    EXPECT_NE(a.points->getPointsBufferRef_x(), c.points->getPointsBufferRef_x());
}

TEST(scans, what_is_beyond_the_range_leaves_no_point_and_does_not_disturb_the_other_beams)
{
    LaserScanner2D sensor;
    sensor.sigma = 0.01;
    const RayTracer world(box_room(20, 4, 3));
    const CPose3D at(0, 0, 1, 0, 0, 0);
    const auto all = scan_from(world, at, sensor);
    sensor.max_range = 5;
    const auto near = scan_from(world, at, sensor);
    ASSERT_LT(near.points->size(), all.points->size());
    ASSERT_GT(near.points->size(), 100u);
    for (size_t i = 0; i < near.points->size(); i++)
    {
        EXPECT_LE(near.true_range[i], 5);
        EXPECT_EQ(point(near, i), point(all, near.beam[i]));
    }
}

TEST(scans, parameters_out_of_range_are_refused)
{
    const RayTracer world(box_room(6, 6, 3));
    const auto refused = [&](auto sensor)
    { EXPECT_THROW(scan_from(world, CPose3D(), sensor), std::invalid_argument); };
    LaserScanner2D laser;
    laser.beams = 1;
    refused(laser);
    laser = {};
    laser.aperture_deg = 361;
    refused(laser);
    laser = {};
    laser.sigma = -1;
    refused(laser);
    laser = {};
    laser.max_range = 0;
    refused(laser);
    RotatingLidar lidar;
    lidar.rings = 0;
    refused(lidar);
    lidar = {};
    lidar.lowest_deg = 20;
    refused(lidar);
}
