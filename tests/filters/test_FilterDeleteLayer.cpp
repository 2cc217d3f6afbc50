#include <mp2p_icp_filters/FilterDeleteLayer.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include "filter_test_tools.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::metric_map_t;

namespace
{
metric_map_t three_layers()
{
    metric_map_t m;
    m.layers["a"] = cloud_of({{1, 2, 3}});
    m.layers["b"] = cloud_of({});
    m.layers["grid"] = mrpt::maps::COccupancyGridMap2D::Create();
    return m;
}
}  // namespace

TEST(FilterDeleteLayer, RemovesOneLayerOrAList)
{
    auto m = three_layers();
    make_filter<FilterDeleteLayer>("pointcloud_layer_to_remove: a\n").filter(m);
    EXPECT_EQ(m.layers.size(), 2u);
    EXPECT_EQ(m.layers.count("a"), 0u);
    m = three_layers();
    make_filter<FilterDeleteLayer>("pointcloud_layer_to_remove: [b, grid]\n").filter(m);
    EXPECT_EQ(m.layers.size(), 1u);
    EXPECT_EQ(m.layers.count("a"), 1u);
}

TEST(FilterDeleteLayer, AMissingLayerIsAnErrorAndThenNoneIsRemoved)
{
    auto m = three_layers();
    const auto f = make_filter<FilterDeleteLayer>("pointcloud_layer_to_remove: [a, c]\n");
    expect_problem<std::invalid_argument>([&]() { f.filter(m); },
                                          {"FilterDeleteLayer", "'c'", "'a', 'b', 'grid'"});
    EXPECT_EQ(m.layers.size(), 3u);
}

TEST(FilterDeleteLayer, AMissingLayerMayBeAllowed)
{
    auto m = three_layers();
    make_filter<FilterDeleteLayer>(
        "pointcloud_layer_to_remove: [a, c]\nerror_on_missing_input_layer: false\n")
        .filter(m);
    EXPECT_EQ(m.layers.size(), 2u);
}

TEST(FilterDeleteLayer, MistakesAreRefusedWithTheirPlace)
{
    expect_refused<FilterDeleteLayer>("error_on_missing_input_layer: false\n",
                                      {"pointcloud_layer_to_remove", "missing"});
    expect_refused<FilterDeleteLayer>("pointcloud_layer_to_remove: []\n",
                                      {"pointcloud_layer_to_remove", "at least one"});
    expect_refused<FilterDeleteLayer>("pointcloud_layer_to_remove: a\nerror_on_missing_layer: false\n",
                                      {"test.yaml:2", "did you mean 'error_on_missing_input_layer'"});
    expect_refused<FilterDeleteLayer>("pointcloud_layer_to_remove: a\nerror_on_missing_input_layer: maybe\n",
                                      {"test.yaml:2", "maybe"});
}

TEST(FilterDeleteLayer, DescribesEveryKey)
{
    const auto text = FilterDeleteLayer().describe_parameters();
    for (const char* key : {"pointcloud_layer_to_remove", "error_on_missing_input_layer"})
        EXPECT_NE(text.find(std::string("  ") + key + ":"), std::string::npos) << key;
}
