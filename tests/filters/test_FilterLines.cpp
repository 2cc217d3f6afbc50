#include <mp2p_icp_filters/FilterLines.h>
#include <mp2p_icp_filters/FilterPlanes.h>

#include "filter_test_tools.h"
#include "true_faces.h"
#include "with_threads.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::metric_map_t;

namespace
{
metric_map_t map_of(const ScannedWorld& world)
{
    metric_map_t m;
    m.layers["raw"] = world.scan.points;
    FilterPlanes().filter(m);
    m.lines.resize(1);  // replaced
    return m;
}

void expect_same(const std::vector<mp2p_icp::fitted_line_t>& a, const std::vector<mp2p_icp::fitted_line_t>& b)
{
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); i++)
    {
        EXPECT_EQ(a[i].pBase, b[i].pBase);
        EXPECT_EQ(a[i].director, b[i].director);
        EXPECT_EQ(a[i].fit->covariance, b[i].fit->covariance);
    }
}
}  // namespace

TEST(FilterLines, WritesIntersectionsThenPoles)
{
    const auto world = scanned_street(1);
    auto m = map_of(world);
    make_filter<FilterLines>("output_layer_pole_points: poles\n").filter(m);
    auto expected = intersect_planes(*world.scan.points, m.planes);
    const size_t intersections = expected.size();
    size_t points = 0;
    for (const auto& pole : extract_poles(*world.scan.points))
    {
        expected.push_back(pole.line);
        points += pole.inliers.size();
    }
    EXPECT_GE(intersections, 1u);
    EXPECT_GT(expected.size(), intersections);
    expect_same(m.lines, expected);
    EXPECT_EQ(m.point_layer("poles")->size(), points);
    make_filter<FilterLines>("find_poles: false\n").filter(m);
    EXPECT_EQ(m.lines.size(), intersections);
    make_filter<FilterLines>("intersect_planes: false\n").filter(m);
    EXPECT_EQ(m.lines.size(), expected.size() - intersections);
}

TEST(FilterLines, TheSameBitsOnAnyNumberOfThreads)
{
    auto m = map_of(scanned_street(1));
    FilterLines().filter(m);
    const auto once = m.lines;
    for (const int threads : {1, 2, 8})
        with_threads(threads,
                     [&]()
                     {
                         FilterLines().filter(m);
                         expect_same(m.lines, once);
                     });
}

TEST(FilterLines, WallsAndCornersOfA2dScan)
{
    metric_map_t m;
    const auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i <= 40; i++)
    {
        const float s = 0.05f * static_cast<float>(i);
        cloud->insertPoint(2, -1 + s, 0.3f);
        cloud->insertPoint(2 - s, 1, 0.3f);
    }
    m.layers["laser"] = cloud;
    make_filter<FilterLines>("input_pointcloud_layer: laser\nscan_2d: true\noutput_layer_corners: corners\n")
        .filter(m);
    ASSERT_EQ(m.lines.size(), 2u);
    EXPECT_NEAR(m.lines[0].pBase.x, 2, 1e-6);
    EXPECT_NEAR(m.lines[0].director.y, 1, 1e-6);
    EXPECT_NEAR(m.lines[1].pBase.y, 1, 1e-6);
    const auto corners = layer_fields(m, "corners");
    ASSERT_EQ(corners.size(), 1u);
    EXPECT_NEAR(corners[0][0], 2, 1e-5);
    EXPECT_NEAR(corners[0][1], 1, 1e-5);
    EXPECT_NEAR(corners[0][2], 0.3, 1e-5);
}

TEST(FilterLines, AnEmptyLayerGivesNoneAndBadOnesAreErrors)
{
    metric_map_t m;
    m.layers["raw"] = cloud_of({});
    m.lines.resize(1);
    for (const char* params :
         {"output_layer_pole_points: poles", "scan_2d: true\noutput_layer_corners: corners"})
    {
        make_filter<FilterLines>(params).filter(m);
        EXPECT_TRUE(m.lines.empty());
    }
    EXPECT_EQ(m.point_layer("poles")->size() + m.point_layer("corners")->size(), 0u);
    expect_problem<std::invalid_argument>(
        [&]() { make_filter<FilterLines>("input_pointcloud_layer: none").filter(m); },
        {"FilterLines", "'none'"});
    expect_refused<FilterLines>("pole_voxel_size: 0", {"pole_voxel_size"});
    expect_refused<FilterLines>("segment_maximum_gap: -1", {"segment_maximum_gap"});
    expect_refused<FilterLines>("intersection_minimum_angle_deg: 90", {"intersection_minimum_angle_deg"});
}
