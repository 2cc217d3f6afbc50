#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/FilterBoundingBox.h>

#include <cmath>
#include <limits>

#include "filter_test_tools.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::metric_map_t;
using Fields = std::vector<std::vector<float>>;

namespace
{
const std::string BOX = "bounding_box_min: [-1, -2, -3]\nbounding_box_max: [1, 2, 3]\n";

FilterBoundingBox both_sides(const std::string& box = BOX)
{
    return make_filter<FilterBoundingBox>(box +
                                          "inside_pointcloud_layer: in\noutside_pointcloud_layer: out\n");
}

metric_map_t map_of(const mrpt::maps::CPointsMap::Ptr& raw)
{
    metric_map_t m;
    m.layers["raw"] = raw;
    return m;
}
}  // namespace

TEST(FilterBoundingBox, DividesAsAPointByPointCheckDoes)
{
    mp2p_icp::SeededRandom random(1);
    const auto raw = mrpt::maps::CPointsMapXYZI::Create();
    Fields inside, outside;
    for (size_t i = 0; i < 3000; i++)
    {
        const float x = static_cast<float>(random.uniform(-3, 3)),
                    y = static_cast<float>(random.uniform(-4, 4)),
                    z = static_cast<float>(random.uniform(-5, 5)),
                    intensity = static_cast<float>(random.uniform());
        raw->insertPoint(x, y, z);
        raw->setPointIntensity(i, intensity);
        (std::abs(x) <= 1 && std::abs(y) <= 2 && std::abs(z) <= 3 ? inside : outside)
            .push_back({x, y, z, intensity});
    }
    auto m = map_of(raw);
    both_sides().filter(m);
    EXPECT_GT(inside.size(), 100u);
    EXPECT_EQ(layer_fields(m, "in"), inside);  // order and intensity too
    EXPECT_EQ(layer_fields(m, "out"), outside);
    EXPECT_EQ(raw->size(), 3000u);
}

TEST(FilterBoundingBox, PointsOnAFaceAreInside)
{
    const auto up = [](float v) { return std::nextafter(v, 100.0f); };
    const auto down = [](float v) { return std::nextafter(v, -100.0f); };
    auto m = map_of(cloud_of({{1, 2, 3},
                              {-1, -2, -3},
                              {up(1), 0, 0},
                              {0, up(2), 0},
                              {0, 0, up(3)},
                              {down(-1), 0, 0},
                              {0, down(-2), 0},
                              {0, 0, down(-3)}}));
    both_sides().filter(m);
    EXPECT_EQ(m.point_layer("in")->size(), 2u);
    EXPECT_EQ(m.point_layer("out")->size(), 6u);
}

TEST(FilterBoundingBox, ALimitThatIsNotExactInBinaryIsOnTheFloatOfThePoint)
{
    // 0.1f is greater than 0.1, and 0.7f less than 0.7: in double, either point would be outside of a box
    // that ends there.
    auto m = map_of(cloud_of({{0.1f, 0, 0}, {0.7f, 0, 0}}));
    both_sides("bounding_box_min: [0, 0, 0]\nbounding_box_max: [0.1, 0, 0]\n").filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{0.1f, 0, 0}}));
    both_sides("bounding_box_min: [0.7, 0, 0]\nbounding_box_max: [1, 0, 0]\n").filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{0.7f, 0, 0}}));
}

TEST(FilterBoundingBox, ColoursAreKept)
{
    const auto raw = mrpt::maps::CColouredPointsMap::Create();
    raw->insertPointRGB(0, 0, 0, 0.1f, 0.2f, 0.3f);
    raw->insertPointRGB(9, 0, 0, 0.4f, 0.5f, 0.6f);
    auto m = map_of(raw);
    both_sides().filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{0, 0, 0, 0.1f, 0.2f, 0.3f}}));
    EXPECT_EQ(layer_fields(m, "out"), (Fields{{9, 0, 0, 0.4f, 0.5f, 0.6f}}));
}

TEST(FilterBoundingBox, InfiniteLimitsAreOpenSides)
{
    auto m = map_of(cloud_of({{1e30f, 0, 0}, {-1, 0, 0}}));
    both_sides("bounding_box_min: [0, -.inf, -.inf]\nbounding_box_max: [.inf, .inf, .inf]\n").filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{1e30f, 0, 0}}));
}

TEST(FilterBoundingBox, PointsThatAreNotFiniteGoNowhere)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    auto m =
        map_of(cloud_of({{nan, 0, 0}, {0, 0, 0}, {0, std::numeric_limits<float>::infinity(), 0}, {9, 9, 9}}));
    both_sides().filter(m);
    EXPECT_EQ(m.point_layer("in")->size(), 1u);
    EXPECT_EQ(m.point_layer("out")->size(), 1u);
}

TEST(FilterBoundingBox, AnEmptyLayerGivesEmptyLayers)
{
    auto m = map_of(mrpt::maps::CPointsMapXYZI::Create());
    both_sides().filter(m);
    for (const char* name : {"in", "out"})
    {
        EXPECT_TRUE(m.point_layer(name)->empty());
        EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::maps::CPointsMapXYZI>(m.layers[name]));
    }
}

TEST(FilterBoundingBox, OutputsReplaceLayersAndMayBeTheInput)
{
    const auto raw = cloud_of({{0, 0, 0}, {9, 9, 9}});
    auto m = map_of(raw);
    m.layers["out"] = cloud_of({{1, 1, 1}, {2, 2, 2}, {3, 3, 3}});
    make_filter<FilterBoundingBox>(BOX + "inside_pointcloud_layer: raw\noutside_pointcloud_layer: out\n")
        .filter(m);
    EXPECT_EQ(layer_fields(m, "raw"), (Fields{{0, 0, 0}}));
    EXPECT_EQ(layer_fields(m, "out"), (Fields{{9, 9, 9}}));
    EXPECT_EQ(raw->size(), 2u);
}

TEST(FilterBoundingBox, OnlyTheNamedOutputsAreWritten)
{
    auto m = map_of(cloud_of({{0, 0, 0}, {9, 9, 9}}));
    make_filter<FilterBoundingBox>(BOX + "outside_pointcloud_layer: out\n").filter(m);
    EXPECT_EQ(m.layers.size(), 2u);
    EXPECT_EQ(layer_fields(m, "out"), (Fields{{9, 9, 9}}));
}

TEST(FilterBoundingBox, OldAndNewKeysGiveTheSame)
{
    const auto raw = cloud_of({{0, 0, 0}, {9, 9, 9}, {0.5f, 0, 0}});
    for (const bool inside : {true, false})
    {
        auto by_old = map_of(raw), by_new = map_of(raw);
        make_filter<FilterBoundingBox>(
            BOX + "input_pointcloud_layer: raw\noutput_pointcloud_layer: o\nkeep_bbox_contents: " +
            (inside ? "true\n" : "false\n"))
            .filter(by_old);
        make_filter<FilterBoundingBox>(
            BOX + (inside ? "inside_pointcloud_layer: o\n" : "outside_pointcloud_layer: o\n"))
            .filter(by_new);
        EXPECT_EQ(by_old.layers.size(), 2u);
        EXPECT_EQ(layer_fields(by_old, "o"), layer_fields(by_new, "o"));
        EXPECT_EQ(by_old.point_layer("o")->size(), inside ? 2u : 1u);
    }
}

TEST(FilterBoundingBox, AMissingLayerIsNamed)
{
    metric_map_t m;
    expect_problem<std::invalid_argument>([&]() { both_sides().filter(m); }, {"FilterBoundingBox", "'raw'"});
}

TEST(FilterBoundingBox, MistakesAreRefusedWithTheirPlace)
{
    expect_refused<FilterBoundingBox>(BOX, {"test.yaml", "inside_pointcloud_layer", "at least one"});
    expect_refused<FilterBoundingBox>(BOX + "inside_pointcloud_layer: a\noutside_pointcloud_layer: a\n",
                                      {"differ"});
    expect_refused<FilterBoundingBox>(BOX + "inside_pointcloud_layer: a\nkeep_bbox_contents: true\n",
                                      {"together"});
    expect_refused<FilterBoundingBox>(
        BOX + "inside_pointcloud_layer: a\noutput_pointcloud_layer: b\nkeep_bbox_contents: true\n",
        {"older"});
    expect_refused<FilterBoundingBox>("inside_pointcloud_layer: a\nbounding_box_min: [0, 0, 0]\n",
                                      {"bounding_box_max", "missing"});
    expect_refused<FilterBoundingBox>(
        "inside_pointcloud_layer: a\nbounding_box_min: [0, 5, 0]\nbounding_box_max: [1, 4, 1]\n",
        {"bounding_box_min", "exceed", "in y", "5", "4"});
    expect_refused<FilterBoundingBox>(
        "inside_pointcloud_layer: a\nbounding_box_min: [0, 0, 0]\nbounding_box_max: [1, 1]\n",
        {"test.yaml:3", "params.bounding_box_max", "3"});
    expect_refused<FilterBoundingBox>(BOX + "inside_pointcloud_layer: a\nbounding_box_mni: 3\n",
                                      {"test.yaml:4", "did you mean 'bounding_box_min'"});
}

TEST(FilterBoundingBox, FormulasSeeTheVariablesOfTheirSource)
{
    auto f = both_sides("bounding_box_min: ['robot_x-1', -9, -9]\nbounding_box_max: ['robot_x+1', 9, 9]\n");
    auto m = map_of(cloud_of({{0, 0, 0}, {5, 0, 0}}));
    expect_problem<std::runtime_error>([&]() { f.filter(m); }, {"robot_x"});
    EXPECT_EQ(m.layers.size(), 1u);
    mp2p_icp::ParameterSource source;
    source.updateVariable("robot_x", 4.5);
    f.attachToParameterSource(source);
    f.filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{5, 0, 0}}));

    auto crossed = both_sides("bounding_box_min: ['robot_x', 0, 0]\nbounding_box_max: [1, 1, 1]\n");
    crossed.attachToParameterSource(source);
    expect_problem<std::runtime_error>([&]() { crossed.filter(m); }, {"bounding_box_min", "4.5"});
}

TEST(FilterBoundingBox, SavedParametersLoadAgain)
{
    const auto f =
        make_filter<FilterBoundingBox>(BOX + "output_pointcloud_layer: o\nkeep_bbox_contents: false\n");
    const auto saved = f.save_parameters();
    FilterBoundingBox g;
    g.initialize(saved);
    EXPECT_EQ(g.outside_pointcloud_layer, "o");
    EXPECT_EQ(g.inside_pointcloud_layer, "");
    EXPECT_EQ(g.bounding_box_max[2].value(), 3.0);
}

TEST(FilterBoundingBox, DescribesEveryKey)
{
    const auto text = FilterBoundingBox().describe_parameters();
    for (const char* key :
         {"input_pointcloud_layer", "inside_pointcloud_layer", "outside_pointcloud_layer", "bounding_box_min",
          "bounding_box_max", "output_pointcloud_layer", "keep_bbox_contents"})
        EXPECT_NE(text.find(std::string("  ") + key + ":"), std::string::npos) << key << " in\n" << text;
}
