#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/FilterDecimateVoxels.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "filter_test_tools.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::metric_map_t;
using mrpt::maps::CPointsMapXYZI;
using mrpt::maps::CSimplePointsMap;

namespace
{
const std::vector<DecimateMethod> ALL_METHODS = {DecimateMethod::FirstPoint, DecimateMethod::ClosestToAverage,
                                                 DecimateMethod::VoxelAverage, DecimateMethod::RandomPoint};
const float NaN = std::numeric_limits<float>::quiet_NaN();

FilterDecimateVoxels filter_of(DecimateMethod method, double side)
{
    FilterDecimateVoxels f;
    f.output_pointcloud_layer = "out";
    f.decimate_method = method;
    f.voxel_filter_resolution = side;
    return f;
}

std::vector<std::vector<float>> decimated(const FilterDecimateVoxels& f,
                                          const mrpt::maps::CMetricMap::Ptr& raw)
{
    metric_map_t m;
    m.layers["raw"] = raw;
    f.filter(m);
    return layer_fields(m, "out");
}

/// Random points with an intensity, around `centre`.
CPointsMapXYZI::Ptr random_cloud(size_t n, uint64_t seed, double centre, double size)
{
    mp2p_icp::SeededRandom random(seed);
    const auto m = CPointsMapXYZI::Create();
    for (size_t i = 0; i < n; i++)
    {
        const double x = random.uniform(-size, size), y = random.uniform(-size, size),
                     z = random.uniform(-size, size);
        m->insertPoint(static_cast<float>(centre + x), static_cast<float>(-centre + y),
                       static_cast<float>(z));
        m->setPointIntensity(i, static_cast<float>(random.uniform()));
    }
    return m;
}

using Cell = std::array<long, 3>;

/// The slow, obvious grouping: the indices of the points of each cell.
std::map<Cell, std::vector<size_t>> cells_of(const mrpt::maps::CPointsMap& m, double side)
{
    std::map<Cell, std::vector<size_t>> cells;
    for (size_t i = 0; i < m.size(); i++)
    {
        float p[3] = {0, 0, 0};
        m.getPointFast(i, p[0], p[1], p[2]);
        Cell c;
        for (size_t a = 0; a < 3; a++) c[a] = std::lround(std::floor(static_cast<double>(p[a]) / side));
        cells[c].push_back(i);
    }
    return cells;
}

std::vector<double> mean_of(const mrpt::maps::CPointsMap& m, const std::vector<size_t>& indices)
{
    std::vector<double> mean;
    std::vector<float> f;
    for (const size_t i : indices)
    {
        m.getPointAllFields(i, f);
        mean.resize(f.size(), 0);
        for (size_t k = 0; k < f.size(); k++) mean[k] += static_cast<double>(f[k]);
    }
    for (auto& v : mean) v /= static_cast<double>(indices.size());
    return mean;
}

double distance_sq(const std::vector<float>& p, const std::vector<double>& q)
{
    double sum = 0;
    for (size_t a = 0; a < 3; a++) sum += std::pow(static_cast<double>(p[a]) - q[a], 2);
    return sum;
}
}  // namespace

// ---- Against the oracle, near the origin, and far away ----------------------------------------------------

class DecimateAgainstOracle : public ::testing::TestWithParam<std::tuple<double, double>>
{
 protected:
    const double centre_ = std::get<0>(GetParam()), side_ = std::get<1>(GetParam());
    const CPointsMapXYZI::Ptr raw_ = random_cloud(4000, 7, centre_, 3.0);
    const std::vector<std::vector<float>> in_ = all_fields(*raw_);

    /// Cells in the order of their first points, as the output has them.
    std::vector<std::vector<size_t>> expected_groups() const
    {
        std::map<size_t, std::vector<size_t>> by_first;
        for (const auto& [cell, indices] : cells_of(*raw_, side_)) by_first[indices[0]] = indices;
        std::vector<std::vector<size_t>> groups;
        for (const auto& [first, indices] : by_first) groups.push_back(indices);
        return groups;
    }
};

TEST_P(DecimateAgainstOracle, FirstPoint)
{
    const auto out = decimated(filter_of(DecimateMethod::FirstPoint, side_), raw_);
    const auto groups = expected_groups();
    ASSERT_EQ(out.size(), groups.size());
    for (size_t g = 0; g < groups.size(); g++) ASSERT_EQ(out[g], in_[groups[g][0]]);
}

TEST_P(DecimateAgainstOracle, VoxelAverage)
{
    const auto out = decimated(filter_of(DecimateMethod::VoxelAverage, side_), raw_);
    const auto groups = expected_groups();
    ASSERT_EQ(out.size(), groups.size());
    for (size_t g = 0; g < groups.size(); g++)
    {
        const auto mean = mean_of(*raw_, groups[g]);
        for (size_t k = 0; k < 4; k++)
            ASSERT_EQ(out[g][k], static_cast<float>(mean[k]));  // one rounding, at the end
    }
}

TEST_P(DecimateAgainstOracle, ClosestToAverage)
{
    const auto out = decimated(filter_of(DecimateMethod::ClosestToAverage, side_), raw_);
    const auto groups = expected_groups();
    ASSERT_EQ(out.size(), groups.size());
    for (size_t g = 0; g < groups.size(); g++)
    {
        const auto mean = mean_of(*raw_, groups[g]);
        double best = std::numeric_limits<double>::infinity();
        for (const size_t i : groups[g]) best = std::min(best, distance_sq(in_[i], mean));
        // The means are summed alike, up to the last bits of double.
        ASSERT_NEAR(distance_sq(out[g], mean), best, 1e-9);
        const auto is_out = [&](size_t i) { return in_[i] == out[g]; };
        ASSERT_TRUE(std::any_of(groups[g].begin(), groups[g].end(), is_out))
            << "must be a point of the input";
    }
}

TEST_P(DecimateAgainstOracle, RandomPoint)
{
    const auto out = decimated(filter_of(DecimateMethod::RandomPoint, side_), raw_);
    const auto groups = expected_groups();
    ASSERT_EQ(out.size(), groups.size());
    for (size_t g = 0; g < groups.size(); g++)
    {
        const auto is_out = [&](size_t i) { return in_[i] == out[g]; };
        ASSERT_TRUE(std::any_of(groups[g].begin(), groups[g].end(), is_out)) << "must be a point of the cell";
    }
}

INSTANTIATE_TEST_SUITE_P(CentresAndSides, DecimateAgainstOracle,
                         ::testing::Combine(::testing::Values(0.0, 1e4),
                                            ::testing::Values(0.1, 0.5, 1.7, 100.0)));

// ---- Cells ------------------------------------------------------------------------------------------------

TEST(FilterDecimateVoxels, CellsAroundTheOriginAreAsWideAsOthers)
{
    // 100 points per metre from -10 to 10: every cell of 1 m has its 100, and none 200.
    const auto raw = CSimplePointsMap::Create();
    for (int i = -1000; i < 1000; i++)
        raw->insertPoint(static_cast<float>(i) / 128.0f + 1.0f / 256, 0.5f, -0.5f);
    const auto out = decimated(filter_of(DecimateMethod::FirstPoint, 1.0), raw);
    std::map<int, int> per_cell;
    for (const auto& p : out) per_cell[static_cast<int>(std::floor(p[0]))]++;
    EXPECT_EQ(out.size(), 16u);  // -1000/128 = -7.8 ... 7.8
    for (const auto& [cell, count] : per_cell) EXPECT_EQ(count, 1) << cell;
    EXPECT_TRUE(per_cell.count(-1) && per_cell.count(0)) << "the cells on both sides of the origin are two";
}

TEST(FilterDecimateVoxels, EightPointsAroundTheOriginAreEightCells)
{
    const auto raw = CSimplePointsMap::Create();
    for (int i = 0; i < 8; i++)
        raw->insertPoint(i & 1 ? 0.1f : -0.1f, i & 2 ? 0.1f : -0.1f, i & 4 ? 0.1f : -0.1f);
    for (const auto method : ALL_METHODS) EXPECT_EQ(decimated(filter_of(method, 1.0), raw).size(), 8u);
}

TEST(FilterDecimateVoxels, APointOnAFaceBelongsToTheCellAbove)
{
    // Sides and coordinates that are exact in binary, on both sides of zero.
    for (const float face : {-2.0f, -0.5f, 0.0f, 0.5f, 3.0f})
    {
        const auto raw = cloud_of(
            {{face, 0.1f, 0.1f}, {face + 0.25f, 0.1f, 0.1f}, {std::nextafter(face, -100.0f), 0.1f, 0.1f}});
        const auto out = decimated(filter_of(DecimateMethod::FirstPoint, 0.5), raw);
        ASSERT_EQ(out.size(), 2u) << face;
        EXPECT_EQ(out[0][0], face);
        EXPECT_EQ(out[1][0], std::nextafter(face, -100.0f));
    }
}

TEST(FilterDecimateVoxels, APointTooFarAwayToNumberIsRefusedAndAFarOneIsNot)
{
    const auto raw = cloud_of({{0, 0, 0}, {1e30f, 0, 0}});
    expect_problem<std::invalid_argument>([&]()
                                          { decimated(filter_of(DecimateMethod::FirstPoint, 0.1), raw); },
                                          {"FilterDecimateVoxels", "point 1", "too far away"});
    EXPECT_EQ(
        decimated(filter_of(DecimateMethod::FirstPoint, 0.1), cloud_of({{0, 0, 0}, {1e7f, 0, 0}})).size(),
        2u);
}

TEST(FilterDecimateVoxels, ManyCellsOfALargeAreaStayApart)
{
    const auto raw = CSimplePointsMap::Create();
    for (int x = -150; x < 150; x++)
        for (int y = -150; y < 150; y++)
            raw->insertPoint(static_cast<float>(x) * 64 + 1, static_cast<float>(y) * 64 + 1, 0);
    EXPECT_EQ(decimated(filter_of(DecimateMethod::FirstPoint, 64.0), raw).size(), 90000u);
    EXPECT_EQ(decimated(filter_of(DecimateMethod::FirstPoint, 128.0), raw).size(), 22500u);
}

// ---- Degenerate input -------------------------------------------------------------------------------------

TEST(FilterDecimateVoxels, AnEmptyLayerGivesAnEmptyLayerOfItsClass)
{
    for (const auto method : ALL_METHODS)
    {
        metric_map_t m;
        m.layers["raw"] = CPointsMapXYZI::Create();
        filter_of(method, 0.5).filter(m);
        EXPECT_TRUE(m.point_layer("out")->empty());
        EXPECT_TRUE(std::dynamic_pointer_cast<CPointsMapXYZI>(m.layers["out"]));
    }
}

TEST(FilterDecimateVoxels, OnePointStaysAsItIs)
{
    const auto raw = CPointsMapXYZI::Create();
    raw->insertPoint(-1.3f, 2.7f, 9.1f);
    raw->setPointIntensity(0, 0.3f);
    for (const auto method : ALL_METHODS) EXPECT_EQ(decimated(filter_of(method, 0.5), raw), all_fields(*raw));
}

TEST(FilterDecimateVoxels, PointsThatAreNotFiniteAreLeftOut)
{
    const float inf = std::numeric_limits<float>::infinity();
    const auto raw =
        cloud_of({{NaN, 0, 0}, {0.1f, 0.1f, 0.1f}, {0, -inf, 0}, {0.3f, 0.1f, 0.1f}, {0, 0, NaN}});
    for (const auto method : ALL_METHODS)
    {
        const auto out = decimated(filter_of(method, 1.0), raw);
        ASSERT_EQ(out.size(), 1u);
        const float x = method == DecimateMethod::VoxelAverage ? 0.2f : out[0][0];
        EXPECT_NEAR(out[0][0], x, 1e-7f);
        EXPECT_TRUE(std::isfinite(out[0][0]) && std::isfinite(out[0][1]) && std::isfinite(out[0][2]));
        EXPECT_TRUE(decimated(filter_of(method, 1.0), cloud_of({{NaN, NaN, NaN}})).empty());
    }
}

TEST(FilterDecimateVoxels, OfSeveralPointsEquallyCloseToTheAverageTheFirstIsTaken)
{
    const auto raw =
        cloud_of({{0.75f, 0.5f, 0.5f}, {0.25f, 0.5f, 0.5f}, {0.5f, 0.75f, 0.5f}, {0.5f, 0.25f, 0.5f}});
    EXPECT_EQ(decimated(filter_of(DecimateMethod::ClosestToAverage, 1.0), raw)[0],
              (std::vector<float>{0.75f, 0.5f, 0.5f}));
}

// ---- Fields, classes, layers ------------------------------------------------------------------------------

TEST(FilterDecimateVoxels, ColoursAreKeptAndAveraged)
{
    const auto raw = mrpt::maps::CColouredPointsMap::Create();
    raw->insertPointRGB(0.25f, 0.5f, 0.5f, 1.0f, 0.0f, 0.5f);
    raw->insertPointRGB(0.75f, 0.5f, 0.5f, 0.0f, 0.5f, 0.5f);
    EXPECT_EQ(decimated(filter_of(DecimateMethod::FirstPoint, 1.0), raw),
              (std::vector<std::vector<float>>{{0.25f, 0.5f, 0.5f, 1.0f, 0.0f, 0.5f}}));
    EXPECT_EQ(decimated(filter_of(DecimateMethod::VoxelAverage, 1.0), raw),
              (std::vector<std::vector<float>>{{0.5f, 0.5f, 0.5f, 0.5f, 0.25f, 0.5f}}));
}

TEST(FilterDecimateVoxels, TheOutputReplacesALayerAndMayBeTheInput)
{
    metric_map_t m;
    const auto raw = cloud_of({{0.1f, 0, 0}, {0.2f, 0, 0}, {5, 0, 0}});
    m.layers["raw"] = raw;
    m.layers["out"] = cloud_of({{77, 0, 0}});
    filter_of(DecimateMethod::FirstPoint, 1.0).filter(m);
    EXPECT_EQ(m.point_layer("out")->size(), 2u);
    auto in_place = filter_of(DecimateMethod::FirstPoint, 1.0);
    in_place.output_pointcloud_layer = "raw";
    in_place.filter(m);
    EXPECT_EQ(m.point_layer("raw")->size(), 2u);
    EXPECT_EQ(raw->size(), 3u) << "others may share the input cloud";
}

TEST(FilterDecimateVoxels, SeveralLayersShareTheirCellsInAllMethods)
{
    metric_map_t m;
    const auto a = CPointsMapXYZI::Create();
    a->insertPoint(0.25f, 0.5f, 0.5f), a->setPointIntensity(0, 0.5f);
    a->insertPoint(3.25f, 0.5f, 0.5f), a->setPointIntensity(1, 0.25f);
    const auto b = CPointsMapXYZI::Create();
    b->insertPoint(-4.0f, 0.5f, 0.5f), b->setPointIntensity(0, 0.125f);
    b->insertPoint(0.75f, 0.5f, 0.5f), b->setPointIntensity(1, 1.0f);
    m.layers["a"] = a, m.layers["b"] = b;
    for (const auto method : ALL_METHODS)
    {
        auto f = filter_of(method, 1.0);
        f.input_pointcloud_layer = {"a", "b"};
        f.filter(m);
        const auto out = layer_fields(m, "out");
        ASSERT_EQ(out.size(), 3u);
        EXPECT_TRUE(std::dynamic_pointer_cast<CPointsMapXYZI>(m.layers["out"]));
        EXPECT_EQ(out[1], (std::vector<float>{3.25f, 0.5f, 0.5f, 0.25f}));
        EXPECT_EQ(out[2], (std::vector<float>{-4.0f, 0.5f, 0.5f, 0.125f}));
        std::vector<float> expected = {0.25f, 0.5f, 0.5f, 0.5f};
        if (method == DecimateMethod::VoxelAverage) expected = {0.5f, 0.5f, 0.5f, 0.75f};
        if (method == DecimateMethod::RandomPoint && out[0] != expected) expected = {0.75f, 0.5f, 0.5f, 1.0f};
        EXPECT_EQ(out[0], expected);
    }
}

TEST(FilterDecimateVoxels, LayersOfOtherClassesJoinTheFirst)
{
    metric_map_t m;
    m.layers["a"] = cloud_of({{0.5f, 0, 0}});
    const auto b = CPointsMapXYZI::Create();
    b->insertPoint(9.5f, 0, 0);
    m.layers["b"] = b;
    auto f = filter_of(DecimateMethod::VoxelAverage, 1.0);
    f.input_pointcloud_layer = {"a", "b"};
    f.filter(m);
    EXPECT_TRUE(std::dynamic_pointer_cast<CSimplePointsMap>(m.layers["out"]));
    EXPECT_EQ(layer_fields(m, "out"), (std::vector<std::vector<float>>{{0.5f, 0, 0}, {9.5f, 0, 0}}));
}

TEST(FilterDecimateVoxels, AMissingLayerIsAnErrorUnlessToldOtherwise)
{
    metric_map_t m;
    m.layers["a"] = cloud_of({{0.5f, 0, 0}});
    auto f = filter_of(DecimateMethod::FirstPoint, 1.0);
    f.input_pointcloud_layer = {"a", "b"};
    expect_problem<std::invalid_argument>([&]() { f.filter(m); }, {"FilterDecimateVoxels", "'b'", "'a'"});
    EXPECT_EQ(m.layers.count("out"), 0u);
    f.error_on_missing_input_layer = false;
    f.filter(m);
    EXPECT_EQ(m.point_layer("out")->size(), 1u);
    f.input_pointcloud_layer = {"b"};
    f.filter(m);
    EXPECT_TRUE(m.point_layer("out")->empty());
}

TEST(FilterDecimateVoxels, ALayerThatIsNotACloudIsRefused)
{
    metric_map_t m;
    m.layers["raw"] = mrpt::maps::COccupancyGridMap2D::Create();
    expect_problem<std::invalid_argument>([&]() { filter_of(DecimateMethod::FirstPoint, 1.0).filter(m); },
                                          {"FilterDecimateVoxels", "COccupancyGridMap2D"});
}

TEST(FilterDecimateVoxels, SmallLayersAreTakenAsTheyAre)
{
    metric_map_t m;
    m.layers["small"] = cloud_of({{0.1f, 0, 0}, {0.2f, 0, 0}, {NaN, 0, 0}});
    m.layers["large"] = cloud_of({{0.3f, 0, 0}, {0.4f, 0, 0}, {0.5f, 0, 0}, {5, 0, 0}});
    for (const auto method : ALL_METHODS)
    {
        auto f = filter_of(method, 1.0);
        f.input_pointcloud_layer = {"large", "small"};
        f.minimum_input_points_to_filter = 4;  // of the layer with NaN there are 3, of the other exactly 4
        f.filter(m);
        const auto out = layer_fields(m, "out");
        ASSERT_EQ(out.size(), 4u);
        EXPECT_EQ(out[2][0], 0.1f);
        EXPECT_EQ(out[3][0], 0.2f);
        f.minimum_input_points_to_filter = 5;
        f.filter(m);
        EXPECT_EQ(m.point_layer("out")->size(), 6u);
    }
}

TEST(FilterDecimateVoxels, FlatteningSetsTheHeightAndKeepsOtherFields)
{
    const auto raw = CPointsMapXYZI::Create();
    raw->insertPoint(0.5f, 0.25f, 3.0f), raw->setPointIntensity(0, 0.75f);
    raw->insertPoint(0.5f, 0.25f, 9.0f), raw->setPointIntensity(1, 0.5f);
    auto f = filter_of(DecimateMethod::FirstPoint, 1.0);
    f.flatten_to = -1.5;
    EXPECT_EQ(decimated(f, raw),
              (std::vector<std::vector<float>>{{0.5f, 0.25f, -1.5f, 0.75f}, {0.5f, 0.25f, -1.5f, 0.5f}}));
}

// ---- Random picks -----------------------------------------------------------------------------------------

TEST(FilterDecimateVoxels, RandomPicksRepeatAndFollowTheSeed)
{
    const auto raw = random_cloud(3000, 3, 0, 3);
    auto f = filter_of(DecimateMethod::RandomPoint, 1.0);
    const auto first = decimated(f, raw);
    EXPECT_EQ(first, decimated(f, raw));
    f.seed = 1;
    const auto second = decimated(f, raw);
    ASSERT_EQ(first.size(), second.size());
    size_t different = 0;
    for (size_t i = 0; i < first.size(); i++) different += first[i] != second[i];
    EXPECT_GT(different, first.size() / 2);  // some 14 points per cell
}

TEST(FilterDecimateVoxels, ARandomPickDependsOnItsCellAlone)
{
    const auto raw = random_cloud(3000, 4, 0, 3);
    const auto f = filter_of(DecimateMethod::RandomPoint, 1.0);
    std::map<Cell, std::vector<float>> picks;
    for (const auto& p : decimated(f, raw))
        picks[{std::lround(std::floor(p[0])), std::lround(std::floor(p[1])), std::lround(std::floor(p[2]))}] =
            p;
    // Only the points with x < 0, with others in front: the cells that remain must keep their picks.
    const auto half = CPointsMapXYZI::Create();
    half->insertPoint(50, 50, 50);
    for (size_t i = 0; i < raw->size(); i++)
    {
        float x = 0, y = 0, z = 0;
        raw->getPointFast(i, x, y, z);
        if (x >= 0) continue;
        half->insertPoint(x, y, z);
        half->setPointIntensity(half->size() - 1, raw->getPointIntensity(i));
    }
    size_t checked = 0;
    for (const auto& p : decimated(f, half))
    {
        if (p[0] > 10) continue;
        EXPECT_EQ(p, (picks[{std::lround(std::floor(p[0])), std::lround(std::floor(p[1])),
                             std::lround(std::floor(p[2]))}]));
        checked++;
    }
    EXPECT_EQ(checked, 3u * 6 * 6);
}

TEST(FilterDecimateVoxels, RandomPicksAreUniform)
{
    // 9000 cells with three points each: every position is picked 3000 times, give or take 5 sigma (45 each).
    const auto raw = CSimplePointsMap::Create();
    for (int c = 0; c < 9000; c++)
        for (int k = 0; k < 3; k++)
            raw->insertPoint(static_cast<float>(c % 90), static_cast<float>(c / 90),
                             0.25f * static_cast<float>(k));
    std::map<float, int> picked;
    for (const auto& p : decimated(filter_of(DecimateMethod::RandomPoint, 1.0), raw)) picked[p[2]]++;
    ASSERT_EQ(picked.size(), 3u);
    for (const auto& [z, count] : picked) EXPECT_NEAR(count, 3000, 225) << z;
}

// ---- Parameters -------------------------------------------------------------------------------------------

namespace
{
const char* NEW_KEYS = R"(
input_pointcloud_layer: raw
output_pointcloud_layer: out
voxel_filter_resolution: 0.5
decimate_method: DecimateMethod::VoxelAverage
)";
}

TEST(FilterDecimateVoxels, OldAndNewKeysGiveTheSame)
{
    const auto raw = random_cloud(2000, 5, 0, 3);
    const std::string old_keys = R"(
input_pointcloud_layer: raw
output_pointcloud_layer: out
voxel_filter_resolution: 0.5
use_voxel_average: AVERAGE
bounding_box_min: [-10, -10, -10]
bounding_box_max: [10, 10, 10]
error_on_missing_input_layer: true
)";
    const auto with = [&](const std::string& value)
    { return std::string(old_keys).replace(old_keys.find("AVERAGE"), 7, value); };
    const auto average = decimated(make_filter<FilterDecimateVoxels>(NEW_KEYS), raw);
    EXPECT_EQ(decimated(make_filter<FilterDecimateVoxels>(with("true")), raw), average);
    const auto random = decimated(filter_of(DecimateMethod::RandomPoint, 0.5), raw);
    EXPECT_EQ(decimated(make_filter<FilterDecimateVoxels>(with("false")), raw), random);
    EXPECT_NE(random, average);
}

TEST(FilterDecimateVoxels, AllKeysAreRead)
{
    const auto f = make_filter<FilterDecimateVoxels>(R"(
input_pointcloud_layer: [a, b]
output_pointcloud_layer: c
voxel_filter_resolution: 2*0.25
decimate_method: ClosestToAverage
error_on_missing_input_layer: false
minimum_input_points_to_filter: 10
flatten_to: 1.5
use_tsl_robin_map: false
seed: 42
)");
    EXPECT_EQ(f.input_pointcloud_layer, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(f.output_pointcloud_layer, "c");
    EXPECT_EQ(f.voxel_filter_resolution.value(), 0.5);
    EXPECT_EQ(f.decimate_method, DecimateMethod::ClosestToAverage);
    EXPECT_FALSE(f.error_on_missing_input_layer);
    EXPECT_EQ(f.minimum_input_points_to_filter, 10u);
    EXPECT_EQ(f.flatten_to, 1.5);
    EXPECT_EQ(f.seed, 42u);
}

TEST(FilterDecimateVoxels, SavedParametersLoadAgain)
{
    auto f = make_filter<FilterDecimateVoxels>(NEW_KEYS);
    f.seed = 9;
    for (const bool flatten : {false, true})
    {
        if (flatten) f.flatten_to = 0.125;
        const auto saved = f.save_parameters();
        EXPECT_FALSE(saved.has("use_voxel_average")) << "older keys are not written";
        FilterDecimateVoxels g;
        g.initialize(saved);
        EXPECT_EQ(g.decimate_method, DecimateMethod::VoxelAverage);
        EXPECT_EQ(g.seed, 9u);
        EXPECT_EQ(g.flatten_to, f.flatten_to);
        EXPECT_EQ(g.input_pointcloud_layer, f.input_pointcloud_layer);
    }
}

TEST(FilterDecimateVoxels, ANullHeightTurnsFlatteningOff)
{
    auto f = make_filter<FilterDecimateVoxels>(NEW_KEYS + std::string("flatten_to: 2\n"));
    EXPECT_EQ(f.flatten_to, 2.0);
    f.initialize(mp2p_icp::yaml_from_text(NEW_KEYS + std::string("flatten_to: ~\n")));
    EXPECT_FALSE(f.flatten_to);
}

TEST(FilterDecimateVoxels, MistakesAreRefusedWithTheirPlace)
{
    const std::string good = NEW_KEYS;
    expect_refused<FilterDecimateVoxels>(good + "voxel_size: 3\n",
                                         {"test.yaml:6", "params.voxel_size", "unknown key"});
    expect_refused<FilterDecimateVoxels>(good + "decimate_metod: FirstPoint\n",
                                         {"test.yaml:6", "did you mean 'decimate_method'"});
    expect_refused<FilterDecimateVoxels>(good + "use_voxel_average: true\n",
                                         {"use_voxel_average", "only one"});
    expect_refused<FilterDecimateVoxels>(good + "flatten_to: .nan\n", {"test.yaml:6", "flatten_to"});
    expect_refused<FilterDecimateVoxels>(good + "bounding_box_min: [1, 2]\n",
                                         {"test.yaml:6", "bounding_box_min", "3"});
    expect_refused<FilterDecimateVoxels>(good + "seed: -1\n", {"test.yaml:6", "seed"});
    expect_refused<FilterDecimateVoxels>(
        "input_pointcloud_layer: raw\noutput_pointcloud_layer: o\nvoxel_filter_resolution: 1\n",
        {"decimate_method"});
    expect_refused<FilterDecimateVoxels>(
        "input_pointcloud_layer: raw\noutput_pointcloud_layer: o\ndecimate_method: FirstPoint\n",
        {"voxel_filter_resolution"});
    for (const char* bad : {"0", "-1", "'1+'", ".nan"})
    {
        const std::string text =
            std::string(
                "input_pointcloud_layer: raw\noutput_pointcloud_layer: o\nvoxel_filter_resolution: ") +
            bad + "\ndecimate_method: FirstPoint\n";
        expect_refused<FilterDecimateVoxels>(text, {"test.yaml:3", "voxel_filter_resolution"});
    }
    expect_refused<FilterDecimateVoxels>(
        "input_pointcloud_layer: raw\noutput_pointcloud_layer: o\nvoxel_filter_resolution: "
        "1\ndecimate_method: FirstPint\n",
        {"test.yaml:4", "did you mean 'DecimateMethod::FirstPoint'"});
}

TEST(FilterDecimateVoxels, AFormulaSeesTheVariablesOfItsSource)
{
    auto f = make_filter<FilterDecimateVoxels>(
        "input_pointcloud_layer: raw\noutput_pointcloud_layer: out\nvoxel_filter_resolution: "
        "0.1*SIZE\ndecimate_method: FirstPoint\n");
    const auto raw = random_cloud(2000, 6, 0, 3);
    expect_problem<std::runtime_error>([&]() { decimated(f, raw); }, {"SIZE"});
    mp2p_icp::ParameterSource source;
    f.attachToParameterSource(source);
    for (const double size : {5.0, 20.0})
    {
        source.updateVariable("SIZE", size);
        EXPECT_EQ(decimated(f, raw), decimated(filter_of(DecimateMethod::FirstPoint, 0.1 * size), raw));
    }
    source.updateVariable("SIZE", -1);
    expect_problem<std::runtime_error>([&]() { decimated(f, raw); }, {"voxel_filter_resolution", "0.1*SIZE"});
}

TEST(FilterDecimateVoxels, DescribesEveryKey)
{
    const auto text = FilterDecimateVoxels().describe_parameters();
    for (const char* key :
         {"input_pointcloud_layer", "output_pointcloud_layer", "voxel_filter_resolution", "decimate_method",
          "error_on_missing_input_layer", "minimum_input_points_to_filter", "flatten_to", "use_tsl_robin_map",
          "seed", "use_voxel_average", "bounding_box_min", "bounding_box_max"})
        EXPECT_NE(text.find(std::string("  ") + key + ":"), std::string::npos) << key << " in\n" << text;
    EXPECT_NE(text.find("without effect"), std::string::npos);
}
