#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>

#include "pipeline_choice.h"
#include "run_tools.h"

using namespace mp2p_icp_apps;
using namespace mp2p_icp_test;

namespace
{
const std::string TWO_LISTS = std::string(EXACT_PIPELINE) + R"(
for_local:
  - class_name: mp2p_icp_filters::FilterDecimateVoxels
    params: {input_pointcloud_layer: raw, output_pointcloud_layer: few, voxel_filter_resolution: 1, decimate_method: FirstPoint}
for_global:
  - class_name: mp2p_icp_filters::FilterDeleteLayer
    params: {pointcloud_layer_to_remove: raw}
  - class_name: mp2p_icp_filters::FilterDeleteLayer
    params: {pointcloud_layer_to_remove: other}
)";

std::string message_of(const std::function<void()>& work)
{
    try
    {
        work();
    }
    catch (const std::invalid_argument& e)
    {
        return e.what();
    }
    return "no exception";
}

mp2p_icp::metric_map_t map_of(const std::map<std::string, size_t>& layers)
{
    mp2p_icp::metric_map_t map;
    for (const auto& [name, count] : layers)
    {
        auto points = mrpt::maps::CSimplePointsMap::Create();
        for (size_t i = 0; i < count; i++) points->insertPoint(static_cast<float>(i), 0, 0);
        map.layers[name] = points;
    }
    return map;
}
}  // namespace

TEST(load_pipeline, takes_shipped_names_and_files)
{
    for (const auto& name : mp2p_icp::shipped_pipeline_names()) EXPECT_EQ(load_pipeline(name).name, name);
    const Folder folder;
    EXPECT_EQ(load_pipeline(folder.text("p.yaml", EXACT_PIPELINE)).pipeline.parameters.maxIterations, 200u);
    const auto message = message_of([] { load_pipeline("icp-3d-lidr"); });
    EXPECT_TRUE(contains(message, "'icp-3d-lidr'") && contains(message, "did you mean 'icp-3d-lidar'"))
        << message;
}

TEST(choose_filters, takes_the_named_list)
{
    const Folder folder;
    const auto p = load_pipeline(folder.text("p.yaml", TWO_LISTS));
    EXPECT_EQ(choose_filters(p, "", "for_local", "--x").size(), 1u);
    EXPECT_EQ(choose_filters(p, "", "for_global", "--x").size(), 2u);
    EXPECT_EQ(choose_filters(p, "", std::nullopt, "--x").size(), 0u);
    const auto message = message_of([&] { choose_filters(p, "", "for_lokal", "--x"); });
    EXPECT_TRUE(contains(message, "--x") && contains(message, "'for_lokal'") &&
                contains(message, "did you mean 'for_local'") && contains(message, "for_global, for_local"))
        << message;
    // The usual name is an error, too, once it is asked for.
    EXPECT_TRUE(contains(message_of([&] { choose_filters(p, "", "filters", "--x"); }), "'filters'"));
}

TEST(choose_filters, a_file_wins_over_the_pipeline)
{
    const Folder folder;
    const auto p = load_pipeline(folder.text("p.yaml", TWO_LISTS));
    const std::string entry =
        "  - class_name: mp2p_icp_filters::FilterDeleteLayer\n    params: {pointcloud_layer_to_remove: "
        "raw}\n";
    const auto file = folder.text("f.yaml", "filters:\n" + entry + entry + entry + "for_local:\n" + entry);
    EXPECT_EQ(choose_filters(p, file, std::nullopt, "--x").size(), 3u);
    EXPECT_EQ(choose_filters(p, file, "for_local", "--x").size(), 1u);
    const auto message = message_of([&] { choose_filters(p, file, "for_global", "--x"); });
    EXPECT_TRUE(contains(message, "f.yaml") && contains(message, "for_global")) << message;
}

TEST(check_layers_meet, tells_the_layers_of_both_maps)
{
    mp2p_icp::ICP icp;
    auto matcher = std::make_shared<mp2p_icp::Matcher_Points_DistanceThreshold>(1.0);
    icp.matchers().push_back(matcher);
    EXPECT_NO_THROW(check_layers_meet(icp, map_of({{"raw", 1}}), map_of({{"raw", 1}, {"x", 1}})));
    const auto message = message_of(
        [&] {
            check_layers_meet(icp, map_of({{"raw", 1}}), map_of({{"2d_lidar", 1}}));
        });
    EXPECT_TRUE(contains(message, "local: raw") && contains(message, "global: 2d_lidar")) << message;
    matcher->enabled = false;
    const auto none = message_of([&] { check_layers_meet(icp, map_of({{"raw", 1}}), map_of({{"raw", 1}})); });
    EXPECT_TRUE(contains(none, "no matcher")) << none;
    matcher->enabled = true;
    matcher->weight_pt2pt_layers["2d_lidar"]["raw"] = 1;
    EXPECT_NO_THROW(check_layers_meet(icp, map_of({{"raw", 1}}), map_of({{"2d_lidar", 1}})));
}

TEST(global_points_used, counts_each_layer_that_is_read_once)
{
    mp2p_icp::ICP icp;
    auto matcher = std::make_shared<mp2p_icp::Matcher_Points_DistanceThreshold>(1.0);
    auto off = std::make_shared<mp2p_icp::Matcher_Points_DistanceThreshold>(1.0);
    off->weight_pt2pt_layers["c"]["a"] = 1, off->enabled = false;
    icp.matchers() = {matcher, matcher, off};
    const auto local = map_of({{"a", 3}}), global = map_of({{"a", 5}, {"b", 7}, {"c", 100}});
    EXPECT_EQ(global_points_used(icp, local, global), 5u);
    matcher->weight_pt2pt_layers["a"]["a"] = 1, matcher->weight_pt2pt_layers["b"]["a"] = 1;
    EXPECT_EQ(global_points_used(icp, local, global), 12u);
}
