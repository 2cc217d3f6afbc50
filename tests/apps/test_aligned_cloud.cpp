#include <mrpt/maps/CPointsMapXYZI.h>

#include "aligned_cloud.h"
#include "run_tools.h"

using namespace mp2p_icp_apps;
using namespace mp2p_icp_test;

namespace
{
mp2p_icp::metric_map_t map_with(const std::string& layer, const mrpt::math::TPoint3Df& point,
                                const mrpt::math::TPoint3D& offset)
{
    auto cloud = mrpt::maps::CPointsMapXYZI::Create();
    cloud->insertPoint(point.x, point.y, point.z);
    cloud->setPointIntensity(0, 0.75f);
    mp2p_icp::metric_map_t map;
    map.layers[layer] = cloud;
    map.set_coordinate_offset(offset);
    return map;
}
}  // namespace

TEST(aligned_cloud, moves_points_and_keeps_their_fields)
{
    const auto local = map_with("raw", {1, 2, 3}, {0, 0, 0}), global = map_with("raw", {0, 0, 0}, {0, 0, 0});
    const auto moved = aligned_cloud(local, global, pose_deg(10, 20, 30, 90, 0, 0));
    const auto cloud = std::dynamic_pointer_cast<mrpt::maps::CPointsMapXYZI>(moved.point_layer("raw"));
    ASSERT_TRUE(cloud);
    float x, y, z;
    cloud->getPoint(0, x, y, z);
    EXPECT_NEAR(x, 10 - 2, 1e-5);
    EXPECT_NEAR(y, 20 + 1, 1e-5);
    EXPECT_NEAR(z, 30 + 3, 1e-5);
    EXPECT_EQ(cloud->getPointIntensity(0), 0.75f);
    float untouched = 0;
    local.point_layer("raw")->getPoint(0, untouched, y, z);
    EXPECT_EQ(untouched, 1);
}

TEST(aligned_cloud, honours_the_offsets_of_both_maps)
{
    const mrpt::math::TPoint3D of_local(5e5, 4.6e6, 100), of_global(5e5 + 7, 4.6e6 - 3, 90);
    const auto local = map_with("raw", {1, 2, 3}, of_local), global = map_with("raw", {0, 0, 0}, of_global);
    const auto pose = CPose3D(of_local) + pose_deg(0.5, 0.25, 0, 30, 0, 0) +
                      CPose3D(-of_local.x, -of_local.y, -of_local.z, 0, 0, 0);
    const auto moved = aligned_cloud(local, global, pose);
    EXPECT_EQ(moved.coordinate_offset(), of_global);
    float x, y, z;
    moved.point_layer("raw")->getPoint(0, x, y, z);
    const auto expected = pose.composePoint(mrpt::math::TPoint3D(1, 2, 3) + of_local) - of_global;
    EXPECT_NEAR(x, expected.x, 1e-5);
    EXPECT_NEAR(y, expected.y, 1e-5);
    EXPECT_NEAR(z, expected.z, 1e-5);
}

TEST(aligned_cloud, prefers_the_raw_layer_and_needs_some_points)
{
    auto map = map_with("a", {1, 1, 1}, {0, 0, 0});
    EXPECT_EQ(main_cloud_layer(map), "a");
    map.layers["raw"] = mrpt::maps::CSimplePointsMap::Create();
    EXPECT_EQ(main_cloud_layer(map), "a");
    map.point_layer("raw")->insertPoint(1, 2, 3);
    EXPECT_EQ(main_cloud_layer(map), "raw");
    EXPECT_THROW(main_cloud_layer(mp2p_icp::metric_map_t()), std::invalid_argument);
}
