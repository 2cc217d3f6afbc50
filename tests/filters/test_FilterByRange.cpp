#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/FilterByRange.h>

#include <cmath>
#include <limits>

#include "filter_test_tools.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::metric_map_t;
using Fields = std::vector<std::vector<float>>;

namespace
{
FilterByRange both_sides(const std::string& ranges)
{
    return make_filter<FilterByRange>(
        "input_pointcloud_layer: raw\noutput_layer_between: in\noutput_layer_outside: out\n" + ranges);
}

metric_map_t map_of(const mrpt::maps::CPointsMap::Ptr& raw)
{
    metric_map_t m;
    m.layers["raw"] = raw;
    return m;
}
}  // namespace

TEST(FilterByRange, DividesAsAPointByPointCheckDoes)
{
    mp2p_icp::SeededRandom random(1);
    const auto raw = mrpt::maps::CPointsMapXYZI::Create();
    Fields between, outside;
    for (size_t i = 0; i < 3000; i++)
    {
        const float x = static_cast<float>(random.uniform(-9, 9)),
                    y = static_cast<float>(random.uniform(-9, 9)),
                    z = static_cast<float>(random.uniform(-9, 9)),
                    intensity = static_cast<float>(random.uniform());
        raw->insertPoint(x, y, z);
        raw->setPointIntensity(i, intensity);
        const double r =
            std::hypot(static_cast<double>(x) - 1, static_cast<double>(y) + 2, static_cast<double>(z) - 3);
        (r >= 4 && r <= 8 ? between : outside).push_back({x, y, z, intensity});
    }
    auto m = map_of(raw);
    both_sides("range_min: 4\nrange_max: 8\ncenter: [1, -2, 3]\n").filter(m);
    EXPECT_GT(between.size(), 500u);
    EXPECT_EQ(layer_fields(m, "in"), between);
    EXPECT_EQ(layer_fields(m, "out"), outside);
}

TEST(FilterByRange, PointsAtALimitAreBetween)
{
    auto m = map_of(cloud_of({{3, 4, 0},
                              {0, 0, std::nextafter(5.0f, 9.0f)},
                              {0, -2, 0},
                              {std::nextafter(2.0f, 0.0f), 0, 0},
                              {0.7f, 0, 0}}));
    both_sides("range_min: 2\nrange_max: 5\n").filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{3, 4, 0}, {0, -2, 0}}));
    EXPECT_EQ(m.point_layer("out")->size(), 3u);
    both_sides("range_min: 0.7\nrange_max: 0.7\n").filter(m);  // not exact in binary
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{0.7f, 0, 0}}));
}

TEST(FilterByRange, ThePointAtTheCentreIsAtRangeZero)
{
    auto m = map_of(cloud_of({{0, 0, 0}, {1, 0, 0}}));
    both_sides("range_min: 0\nrange_max: 0.5\n").filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{0, 0, 0}}));
}

TEST(FilterByRange, PointsThatAreNotFiniteGoNowhereAndEmptyStaysEmpty)
{
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    auto m = map_of(cloud_of({{nan, 0, 0}, {1, 0, 0}, {inf, 0, 0}, {9, 0, 0}}));
    both_sides("range_min: 0\nrange_max: 5\n").filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{1, 0, 0}}));
    EXPECT_EQ(layer_fields(m, "out"), (Fields{{9, 0, 0}}));
    both_sides("range_min: 5\nrange_max: .inf\n").filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{9, 0, 0}}));
    m.layers["raw"] = mrpt::maps::CColouredPointsMap::Create();
    both_sides("range_min: 0\nrange_max: 5\n").filter(m);
    EXPECT_TRUE(m.point_layer("in")->empty());
    EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::maps::CColouredPointsMap>(m.layers["out"]));
}

TEST(FilterByRange, ColoursAreKept)
{
    const auto raw = mrpt::maps::CColouredPointsMap::Create();
    raw->insertPointRGB(1, 0, 0, 0.1f, 0.2f, 0.3f);
    auto m = map_of(raw);
    make_filter<FilterByRange>(
        "input_pointcloud_layer: raw\noutput_layer_between: raw\nrange_min: 0\nrange_max: 5\n")
        .filter(m);
    EXPECT_EQ(layer_fields(m, "raw"), (Fields{{1, 0, 0, 0.1f, 0.2f, 0.3f}}));
}

TEST(FilterByRange, FormulasSeeTheVariablesOfTheirSource)
{
    auto f = both_sides("range_min: 'R/2'\nrange_max: R\ncenter: [robot_x, 0, 0]\n");
    auto m = map_of(cloud_of({{10, 0, 0}, {13, 0, 0}}));
    expect_problem<std::runtime_error>([&]() { f.filter(m); }, {"R"});
    mp2p_icp::ParameterSource source;
    f.attachToParameterSource(source);
    source.updateVariables({{"R", 4.0}, {"robot_x", 10.0}});
    f.filter(m);
    EXPECT_EQ(layer_fields(m, "in"), (Fields{{13, 0, 0}}));
    source.updateVariable("R", -4);
    expect_problem<std::runtime_error>([&]() { f.filter(m); }, {"range_min", "R/2"});
}

TEST(FilterByRange, MistakesAreRefusedWithTheirPlace)
{
    const std::string layers = "input_pointcloud_layer: raw\noutput_layer_between: a\n";
    expect_refused<FilterByRange>(layers + "range_min: 5\nrange_max: 4\n", {"range_min", "exceed"});
    expect_refused<FilterByRange>(layers + "range_min: -1\nrange_max: 4\n",
                                  {"test.yaml:3", "params.range_min"});
    expect_refused<FilterByRange>(layers + "range_min: 1\n", {"range_max", "missing"});
    expect_refused<FilterByRange>(layers + "range_min: 1\nrange_max: 2\ncentre: [0, 0, 0]\n",
                                  {"test.yaml:5", "did you mean 'center'"});
    expect_refused<FilterByRange>("input_pointcloud_layer: raw\nrange_min: 1\nrange_max: 2\n",
                                  {"at least one"});
    expect_refused<FilterByRange>(layers + "output_layer_outside: a\nrange_min: 1\nrange_max: 2\n",
                                  {"differ"});
    expect_refused<FilterByRange>("output_layer_between: a\nrange_min: 1\nrange_max: 2\n",
                                  {"input_pointcloud_layer", "missing"});
}

TEST(FilterByRange, DescribesEveryKey)
{
    const auto text = FilterByRange().describe_parameters();
    for (const char* key : {"input_pointcloud_layer", "output_layer_between", "output_layer_outside",
                            "range_min", "range_max", "center"})
        EXPECT_NE(text.find(std::string("  ") + key + ":"), std::string::npos) << key;
}
