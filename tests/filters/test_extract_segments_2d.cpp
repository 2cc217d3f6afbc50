#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/extract_segments_2d.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "expect_problem.h"
#include "filter_test_tools.h"
#include "true_faces.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using Eigen::Vector3d;
using mp2p_icp::to_eigen;

namespace
{
/// A level scan of a room of 6 x 4 m from (0.5, -0.3).
ScannedWorld level_scan(double sigma, uint64_t seed, double yaw = 0.3)
{
    ScannedWorld w{mp2p_icp::synthetic::box_room(6, 4, 3), {0.5, -0.3, 1, yaw, 0, 0}, {}};
    mp2p_icp::synthetic::LaserScanner2D laser;
    laser.beams = 720, laser.aperture_deg = 359.5, laser.sigma = sigma, laser.seed = seed;
    w.scan = scan_from(mp2p_icp::synthetic::RayTracer(w.mesh), w.pose, laser);
    return w;
}

/// Of the place and slope of the true wall against a segment, along axis a.
Eigen::Vector2d wall_error(const Segment2d& segment, const ScannedWorld& world)
{
    const TrueFace face = main_face(world, segment.inliers).face;
    const Vector3d a = segment.line.fit->axis_a, d = to_eigen(segment.line.director);
    const double along_a = face.normal.dot(a);
    return {-(face.normal.dot(to_eigen(segment.line.pBase)) - face.offset) / along_a,
            -face.normal.dot(d) / along_a};
}
}  // namespace

TEST(extract_segments_2d, aRoomHasFourWallsAndFourCorners)
{
    for (const double sigma : {0.0, 0.005, 0.01})
        for (uint64_t seed = 1; seed <= 10; seed++)
        {
            const auto world = level_scan(sigma, seed, 0.6 * static_cast<double>(seed));
            const auto found = extract_segments_2d(*world.scan.points);
            EXPECT_EQ(found.segments.size(), 4u);
            for (const auto& segment : found.segments)
            {
                EXPECT_GT(main_face(world, segment.inliers).share, 0.97);
                EXPECT_TRUE(segment.line.fit->is_sound());
                EXPECT_LT(std::abs(wall_error(segment, world)(0)), 0.005);
                const Vector3d ray = to_eigen(segment.line.pBase), d = to_eigen(segment.line.director);
                EXPECT_GT(ray.x() * d.y() - ray.y() * d.x(), 0);  // counter-clockwise
            }
            ASSERT_EQ(found.corners.size(), 4u);
            for (const auto& corner : found.corners)
            {
                const auto p = world.pose.composePoint(corner);
                EXPECT_NEAR(std::abs(p.x), 3, 0.01);
                EXPECT_NEAR(std::abs(p.y), 2, 0.01);
                EXPECT_NEAR(p.z, 1, 1e-6);
            }
        }
}

TEST(extract_segments_2d, wallsKnowHowWellTheyAreKnown)
{
    double chi2 = 0;
    size_t count = 0;
    for (uint64_t seed = 1; seed <= 60; seed++)
    {
        const auto world = level_scan(0.01, seed);
        for (const auto& segment : extract_segments_2d(*world.scan.points).segments)
        {
            const Eigen::Vector2d e = wall_error(segment, world);
            const auto& c = segment.line.fit->covariance;
            Eigen::Matrix2d covariance;
            covariance << c(0, 0), c(0, 2), c(2, 0), c(2, 2);
            chi2 += e.dot(covariance.ldlt().solve(e)) / 2;
            count++;
            EXPECT_EQ(c(1, 1), UNKNOWN_VARIANCE);
            EXPECT_EQ(c(3, 3), UNKNOWN_VARIANCE);
        }
    }
    chi2 /= static_cast<double>(count);
    std::printf("%zu walls, chi2/2 %.2f\n", count, chi2);
    EXPECT_GT(chi2, 0.7);
    EXPECT_LT(chi2, 1.4);
}

TEST(extract_segments_2d, theOrderOfThePointsDoesNotMatter)
{
    const auto world = level_scan(0.01, 1);
    const auto reversed = mrpt::maps::CSimplePointsMap::Create();
    const size_t n = world.scan.points->size();
    for (size_t i = 0; i < n; i++)
    {
        float x = 0, y = 0, z = 0;
        world.scan.points->getPointFast(n - 1 - i, x, y, z);
        reversed->insertPoint(x, y, z);
    }
    const auto a = extract_segments_2d(*world.scan.points), b = extract_segments_2d(*reversed);
    ASSERT_EQ(a.segments.size(), b.segments.size());
    for (size_t i = 0; i < a.segments.size(); i++)
    {
        EXPECT_EQ(a.segments[i].line.pBase, b.segments[i].line.pBase);
        EXPECT_EQ(a.segments[i].line.director, b.segments[i].line.director);
    }
    EXPECT_EQ(a.corners, b.corners);
}

TEST(extract_segments_2d, gapsEndWallsAndCurvesAreNone)
{
    const auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 100; i++)
        if (i < 40 || i >= 60)
            cloud->insertPoint(3, -2.5f + 0.05f * static_cast<float>(i), 0.5f);  // a door of 1 m
    EXPECT_EQ(extract_segments_2d(*cloud).segments.size(), 2u);
    EXPECT_TRUE(extract_segments_2d(*cloud).corners.empty());
    SegmentParameters wide;
    wide.maximum_gap = 1.5;
    EXPECT_EQ(extract_segments_2d(*cloud, wide).segments.size(), 1u);

    const auto column = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 200; i++)
    {
        const double a = M_PI / 2 + M_PI * i / 200;
        column->insertPoint(static_cast<float>(5 + 0.5 * std::cos(a)), static_cast<float>(0.5 * std::sin(a)),
                            0);
    }
    SegmentParameters fine;
    fine.split_distance = 0.01;
    EXPECT_TRUE(extract_segments_2d(*column, fine).segments.empty());
}

TEST(extract_segments_2d, hardPlaces)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_TRUE(extract_segments_2d(*cloud_of({})).segments.empty());
    EXPECT_TRUE(extract_segments_2d(*cloud_of({{1, 2, 0}})).segments.empty());
    EXPECT_TRUE(
        extract_segments_2d(*cloud_of(std::vector<mrpt::math::TPoint3Df>(100, {1, 2, 0}))).segments.empty());
    EXPECT_TRUE(
        extract_segments_2d(*cloud_of(std::vector<mrpt::math::TPoint3Df>(100, {0, 0, 0}))).segments.empty());
    EXPECT_TRUE(extract_segments_2d(*cloud_of(std::vector<mrpt::math::TPoint3Df>(100, {nan, 2, 0})))
                    .segments.empty());
    EXPECT_NO_THROW(
        extract_segments_2d(*cloud_of({{1e30f, 1, 0}, {-1e30f, 2, 0}, {1, 3e38f, 0}, {1, -3e38f, 0}})));
    expect_problem_with<std::invalid_argument>({"one height"},
                                               [&]() {
                                                   extract_segments_2d(*cloud_of({{1, 0, 0}, {1, 1, 0.5f}}));
                                               });
    SegmentParameters bad;
    bad.maximum_gap = 0;
    expect_problem_with<std::invalid_argument>({"maximum_gap"},
                                               [&]() { extract_segments_2d(*cloud_of({}), bad); });
    bad = {};
    bad.corner_distance = -1;
    expect_problem_with<std::invalid_argument>({"corner_distance"},
                                               [&]() { extract_segments_2d(*cloud_of({}), bad); });
}
