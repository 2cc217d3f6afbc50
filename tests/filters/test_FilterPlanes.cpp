#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/FilterPlanes.h>

#include "filter_test_tools.h"
#include "true_faces.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::metric_map_t;

namespace
{
metric_map_t map_of(const mrpt::maps::CPointsMap::Ptr& raw)
{
    metric_map_t m;
    m.layers["raw"] = raw;
    return m;
}
}  // namespace

TEST(FilterPlanes, WritesWhatExtractPlanesFinds)
{
    const auto world = scanned_room(2);
    auto m = map_of(world.scan.points);
    m.planes.emplace_back();  // replaced
    m.lines.emplace_back();   // kept
    make_filter<FilterPlanes>("output_layer_plane_points: flat\noutput_layer_other_points: other\n")
        .filter(m);
    const auto found = extract_planes(*world.scan.points);
    ASSERT_GE(found.size(), 6u);
    ASSERT_EQ(m.planes.size(), found.size());
    size_t inliers = 0;
    std::vector<std::vector<float>> centroids;
    for (size_t i = 0; i < found.size(); i++)
    {
        EXPECT_EQ(m.planes[i].plane.coefs, found[i].plane.plane.coefs);
        EXPECT_EQ(m.planes[i].fit->covariance, found[i].plane.fit->covariance);
        inliers += found[i].inliers.size();
        const mrpt::math::TPoint3Df c(found[i].plane.centroid);
        centroids.push_back({c.x, c.y, c.z});
    }
    EXPECT_EQ(layer_fields(m, "plane_centroids"), centroids);
    EXPECT_EQ(m.point_layer("flat")->size(), inliers);
    EXPECT_EQ(m.point_layer("other")->size(), world.scan.points->size() - inliers);
    EXPECT_EQ(m.lines.size(), 1u);
}

TEST(FilterPlanes, PointsKeepTheirFieldsAndNotFiniteOnesGoNowhere)
{
    mp2p_icp::SeededRandom random(1);
    const auto raw = mrpt::maps::CPointsMapXYZI::Create();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (size_t i = 0; i < 1500; i++)
    {
        raw->insertPoint(i % 3 ? static_cast<float>(random.uniform(-2, 2)) : nan,
                         static_cast<float>(random.uniform(-2, 2)), -1);
        raw->setPointIntensity(i, 0.5f);
    }
    auto m = map_of(raw);
    make_filter<FilterPlanes>("output_layer_plane_points: flat\noutput_layer_other_points: other\n")
        .filter(m);
    ASSERT_EQ(m.planes.size(), 1u);
    EXPECT_EQ(m.point_layer("flat")->size() + m.point_layer("other")->size(), 1000u);
    EXPECT_EQ(layer_fields(m, "flat").at(0).at(3), 0.5f);
}

TEST(FilterPlanes, TheSensorMayStandElsewhere)
{
    const auto world = scanned_room(2);
    auto m = map_of(world.scan.points);
    auto filter = make_filter<FilterPlanes>("sensor_position: [0, 0, 'h']\n");
    mp2p_icp::ParameterSource source;
    filter.attachToParameterSource(source);
    EXPECT_THROW(filter.filter(m), std::runtime_error);
    source.updateVariable("h", -50);  // below the floor
    filter.filter(m);
    ASSERT_GE(m.planes.size(), 1u);
    for (const auto& plane : m.planes)
        EXPECT_GT(plane.normal().dot(Eigen::Vector3d(0, 0, -50) - mp2p_icp::to_eigen(plane.centroid)), 0);
    source.updateVariable("h", std::numeric_limits<double>::quiet_NaN());
    EXPECT_THROW(filter.filter(m), std::runtime_error);
}

TEST(FilterPlanes, AnEmptyLayerGivesNoneAndAMissingOneIsAnError)
{
    auto m = map_of(cloud_of({}));
    m.planes.emplace_back();
    make_filter<FilterPlanes>("output_layer_plane_points: flat\n").filter(m);
    EXPECT_TRUE(m.planes.empty());
    EXPECT_EQ(m.point_layer("plane_centroids")->size(), 0u);
    EXPECT_EQ(m.point_layer("flat")->size(), 0u);
    expect_problem<std::invalid_argument>(
        [&]() { make_filter<FilterPlanes>("input_pointcloud_layer: none").filter(m); },
        {"FilterPlanes", "'none'", "'raw'"});
}

TEST(FilterPlanes, ParametersOutOfRangeAreRefused)
{
    expect_refused<FilterPlanes>("voxel_size: 0", {"voxel_size"});
    expect_refused<FilterPlanes>("voxel_levels: 9", {"voxel_levels"});
    expect_refused<FilterPlanes>("maximum_angle_deg: 50", {"maximum_angle_deg"});
    expect_refused<FilterPlanes>("sensor_position: [1, 2]", {"sensor_position"});
    expect_refused<FilterPlanes>("voxelsize: 1", {"voxelsize", "voxel_size"});
    EXPECT_EQ(make_filter<FilterPlanes>("voxel_size: 0.5").plane_parameters.voxel_size, 0.5);
}
