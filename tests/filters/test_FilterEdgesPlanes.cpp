#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp_filters/FilterEdgesPlanes.h>

#include <limits>
#include <set>
#include <sstream>

#include "filter_test_tools.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::metric_map_t;

namespace
{
const std::string KEYS =
    "voxel_filter_resolution: 1\nvoxel_filter_decimation: 1\nfull_pointcloud_decimation: 20\n"
    "voxel_filter_max_e2_e0: 30\nvoxel_filter_max_e1_e0: 30\nvoxel_filter_min_e2_e0: "
    "100\nvoxel_filter_min_e1_e0: 100\n";

/// A voxel full of points on a plane, one on an edge, one round, and one with few points; in this order.
mrpt::maps::CPointsMapXYZI::Ptr four_voxels()
{
    mp2p_icp::SeededRandom random(1);
    const auto cloud = mrpt::maps::CPointsMapXYZI::Create();
    const auto put = [&](double x, double y, double z, float intensity)
    {
        cloud->insertPoint(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        cloud->setPointIntensity(cloud->size() - 1, intensity);
    };
    for (int i = 0; i < 200; i++)
    {
        const double a = random.uniform(0.05, 0.95), b = random.uniform(0.05, 0.95),
                     c = random.uniform(0.05, 0.95);
        const double e = random.gaussian(0.01), f = random.gaussian(0.01);
        put(a, b, 3.5 + e, 1);
        put(5 + a, 5.5 + e, 0.5 + f, 2);
        put(-5 + a, b, c, 3);
        if (i < 4) put(9 + a, 9 + b, 0.5, 4);
    }
    return cloud;
}

std::set<float> intensities(const metric_map_t& m, const std::string& layer)
{
    std::set<float> out;
    for (const auto& point : layer_fields(m, layer)) out.insert(point[3]);
    return out;
}
}  // namespace

TEST(FilterEdgesPlanes, SortsVoxelsByTheirSpread)
{
    metric_map_t m;
    m.layers["raw"] = four_voxels();
    m.planes.resize(3);  // replaced
    make_filter<FilterEdgesPlanes>(KEYS).filter(m);
    EXPECT_EQ(intensities(m, "plane_points"), (std::set<float>{1}));
    EXPECT_EQ(m.point_layer("plane_points")->size(), 200u);
    EXPECT_EQ(intensities(m, "edge_points"), (std::set<float>{2}));
    EXPECT_EQ(m.point_layer("edge_points")->size(), 200u);
    EXPECT_EQ(m.point_layer("full_decim")->size(), 31u);  // of 604
    ASSERT_EQ(m.planes.size(), 1u);
    EXPECT_LT(m.planes[0].normal().z(), -0.999);  // towards the origin
    EXPECT_NEAR(m.planes[0].centroid.z, 3.5, 0.005);
    EXPECT_NEAR(m.planes[0].plane.evaluatePoint(m.planes[0].centroid), 0, 1e-12);
    EXPECT_NEAR(layer_fields(m, "plane_centroids").at(0).at(2), 3.5, 0.005);
}

TEST(FilterEdgesPlanes, ThinsVoxelsOut)
{
    metric_map_t m;
    m.layers["raw"] = four_voxels();
    auto f = make_filter<FilterEdgesPlanes>(KEYS);
    f.voxel_filter_decimation = 7;
    f.filter(m);
    EXPECT_EQ(m.point_layer("plane_points")->size(), 29u);  // of 200
    f.voxel_filter_min_e1 = 1;                              // m^2: no voxel of 1 m has that
    f.filter(m);
    EXPECT_EQ(m.planes.size(), 0u);
    EXPECT_EQ(m.point_layer("plane_points")->size(), 0u);
}

TEST(FilterEdgesPlanes, ExactDataAndHardPlaces)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto exact = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 1; i < 9; i++)
        for (int k = 1; k < 9; k++)
            exact->insertPoint(0.1f * static_cast<float>(i), 0.1f * static_cast<float>(k), 0.5f);
    for (int i = 1; i < 9; i++) exact->insertPoint(0.1f * static_cast<float>(i), 5.5f, 0.5f);
    exact->insertPoint(nan, 0, 0);
    exact->insertPoint(3e38f, -3e38f, 0);
    for (int i = 0; i < 10; i++) exact->insertPoint(8.5f, 8.5f, 8.5f);
    metric_map_t m;
    m.layers["raw"] = exact;
    make_filter<FilterEdgesPlanes>(KEYS).filter(m);
    EXPECT_EQ(m.planes.size(), 1u);
    EXPECT_EQ(m.point_layer("plane_points")->size(), 64u);
    EXPECT_EQ(m.point_layer("edge_points")->size(), 8u);

    m.layers["raw"] = cloud_of({});
    make_filter<FilterEdgesPlanes>(KEYS).filter(m);
    EXPECT_TRUE(m.planes.empty());
    for (const char* layer : {"edge_points", "plane_points", "full_decim", "plane_centroids"})
        EXPECT_EQ(m.point_layer(layer)->size(), 0u) << layer;
}

TEST(FilterEdgesPlanes, KeysOfTheOriginalAreRequired)
{
    EXPECT_EQ(make_filter<FilterEdgesPlanes>(KEYS + "voxel_filter_min_e1: 0.5").voxel_filter_min_e1, 0.5);
    expect_refused<FilterEdgesPlanes>("voxel_filter_resolution: 1", {"voxel_filter_decimation"});
    auto bad = KEYS;
    bad.replace(bad.find("decimation: 1"), 13, "decimation: 0");
    expect_refused<FilterEdgesPlanes>(bad, {"voxel_filter_decimation"});
}

TEST(FilterEdgesPlanes, KeysOfOtherVersionsWithoutEffectAreReadAndForgotten)
{
    const std::string extent =
        "init_extension_min_x: -10\ninit_extension_min_y: -10\ninit_extension_min_z: -10\n"
        "init_extension_max_x: 10\ninit_extension_max_y: 10\ninit_extension_max_z: 10\n";
    const auto plain = make_filter<FilterEdgesPlanes>(KEYS),
               with_more = make_filter<FilterEdgesPlanes>(KEYS + extent + "use_tsl_robin_map: false\n");
    const auto text = [](const FilterEdgesPlanes& f)
    {
        std::ostringstream out;
        f.save_parameters().printAsYAML(out);
        return out.str();
    };
    EXPECT_EQ(text(with_more), text(plain));
    metric_map_t a, b;
    a.layers["raw"] = b.layers["raw"] = four_voxels();
    plain.filter(a), with_more.filter(b);
    EXPECT_EQ(intensities(a, "plane_points"), intensities(b, "plane_points"));
    EXPECT_EQ(a.planes.size(), b.planes.size());
    expect_refused<FilterEdgesPlanes>(KEYS + "init_extension_min_x: wide\n", {"init_extension_min_x"});
    expect_refused<FilterEdgesPlanes>(KEYS + "init_extension_w: 1\n", {"init_extension_w"});
}
