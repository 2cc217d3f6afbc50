#include <gtest/gtest.h>
#include <mp2p_icp/cloud_picture.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <cmath>

#include "picture_checks.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mrpt::math::TPoint3D;
using mrpt::poses::CPose3D;

namespace
{
constexpr int W = 300, H = 200;

/// Points far enough from each other that none hides another.
PointSet some_points(const TPoint3D& at, double size)
{
    const PointSet unit = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0.5}, {-0.5, 0.2, 0.3}};
    PointSet points;
    for (const auto& p : unit) points.push_back(at + p * size);
    return points;
}
}  // namespace

TEST(draw_clouds, every_point_is_drawn_where_the_view_says)
{
    const int sizes[][2] = {{300, 200}, {200, 300}, {201, 200}};
    for (const auto& [w, h] : sizes)
        for (const double size : {0.05, 1.0, 1e4})
            for (const double away : {0.0, 1e4})
                for (const ViewDirection direction : {ViewDirection{}, {-90, 90}, {30, 0}, {170, -30}})
                {
                    const PointSet points = some_points({away, away, away}, size);
                    const auto view = fit_view({points}, static_cast<double>(w) / h, direction);
                    const auto picture = draw_clouds({{&points, RED, 5}}, view, w, h);
                    ASSERT_EQ(picture.getWidth(), static_cast<size_t>(w));
                    ASSERT_EQ(picture.getHeight(), static_cast<size_t>(h));
                    for (const auto& p : points)
                        EXPECT_TRUE(seen_at(picture, view.project(p, w, h), RED)) << size << " " << away;
                    EXPECT_LE(count(picture, RED), points.size() * 5 * 5);
                }
}

TEST(draw_clouds, the_nearer_point_hides_the_farther_one)
{
    const PointSet near = {{0, 0, 1}}, far = {{0, 0, 0}}, corners = {{-1, -1, 0}, {1, 1, 0}};
    const auto view = fit_view({near, far, corners}, 1.5, {-90, 90});
    for (const bool near_first : {true, false})
    {
        const DrawnCloud a{&near, RED, 5}, b{&far, GREEN, 5};
        const auto picture = draw_clouds(near_first ? std::vector{a, b} : std::vector{b, a}, view, W, H);
        EXPECT_GT(count(picture, RED), 8u);
        EXPECT_EQ(count(picture, GREEN), 0u);
    }
}

TEST(draw_clouds, where_points_meet_the_later_cloud_is_seen)
{
    const PointSet points = some_points({}, 1);
    const auto view = fit_view({points}, 1.5);
    const auto picture = draw_clouds({{&points, GREEN, 5}, {&points, RED, 5}}, view, W, H);
    EXPECT_EQ(count(picture, GREEN), 0u);
    for (const auto& p : points) EXPECT_TRUE(seen_at(picture, view.project(p, W, H), RED));
}

TEST(points_in_world, all_cloud_layers_moved_and_finite_only)
{
    metric_map_t map;
    auto a = mrpt::maps::CSimplePointsMap::Create(), b = mrpt::maps::CSimplePointsMap::Create();
    a->insertPoint(1, 0, 0);
    a->insertPoint(NAN, 0, 0);
    b->insertPoint(0, 2, 0);
    b->insertPoint(0, INFINITY, 0);
    map.layers["a"] = a;
    map.layers["b"] = b;
    map.layers["grid"] = mrpt::maps::COccupancyGridMap2D::Create();
    const auto points = points_in_world(map, CPose3D(10, 0, 0, M_PI_2, 0, 0));
    ASSERT_EQ(points.size(), 2u);
    EXPECT_NEAR((points[0] - TPoint3D(10, 1, 0)).norm(), 0, 1e-12);
    EXPECT_NEAR((points[1] - TPoint3D(8, 0, 0)).norm(), 0, 1e-12);
    EXPECT_THROW(points_in_world(map, CPose3D(NAN, 0, 0, 0, 0, 0)), std::invalid_argument);
}

TEST(point_size_for, falls_with_the_number_of_points)
{
    EXPECT_EQ(point_size_for(0, 800, 600), LARGEST_POINT_PX);
    EXPECT_EQ(point_size_for(1, 800, 600), LARGEST_POINT_PX);
    EXPECT_GT(point_size_for(20000, 800, 600), point_size_for(40000, 800, 600));
    EXPECT_EQ(point_size_for(100000000, 800, 600), SMALLEST_POINT_PX);
}
