// Times of the steps of a registration: decimation, index, search, solving, and a whole alignment.
#include <benchmark/benchmark.h>
#include <mp2p_icp/ICP.h>
#include <mp2p_icp/nn_index.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/FilterDecimateVoxels.h>

#include <cmath>
#include <limits>

namespace
{
/// A wavy floor of 100 m, like a LiDAR sees it: denser near the centre.
mrpt::maps::CSimplePointsMap::Ptr cloud(size_t count, uint64_t seed)
{
    mp2p_icp::SeededRandom random(seed);
    auto points = mrpt::maps::CSimplePointsMap::Create();
    points->reserve(count);
    for (size_t i = 0; i < count; i++)
    {
        const double r = 50 * random.uniform() * random.uniform(), a = random.uniform(0, 2 * M_PI);
        const double x = r * std::cos(a), y = r * std::sin(a);
        points->insertPointFast(static_cast<float>(x), static_cast<float>(y),
                                static_cast<float>(std::sin(0.3 * x) * std::cos(0.2 * y + 0.1 * x)));
    }
    return points;
}

void decimate_voxels(benchmark::State& state)
{
    mp2p_icp::metric_map_t map;
    map.layers["raw"] = cloud(static_cast<size_t>(state.range(0)), 1);
    mp2p_icp_filters::FilterDecimateVoxels filter;
    filter.initialize(
        mp2p_icp::yaml_from_text("{input_pointcloud_layer: raw, output_pointcloud_layer: out, "
                                 "voxel_filter_resolution: 0.25, decimate_method: VoxelAverage}"));
    for (auto _ : state) filter.filter(map);
    state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(decimate_voxels)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond);

void build_kdtree(benchmark::State& state)
{
    const auto points = cloud(static_cast<size_t>(state.range(0)), 1);
    for (auto _ : state) benchmark::DoNotOptimize(mp2p_icp::make_kdtree_index(points));
    state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(build_kdtree)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond);

void search_nearest(benchmark::State& state)
{
    const auto points = cloud(10000, 1), asked = cloud(10000, 2);
    const auto index = mp2p_icp::make_kdtree_index(points);
    mp2p_icp::PointArrays queries;
    queries.resize(asked->size());
    for (size_t i = 0; i < asked->size(); i++) asked->getPoint(i, queries.x[i], queries.y[i], queries.z[i]);
    const float limit =
        state.range(0) ? static_cast<float>(state.range(0)) : std::numeric_limits<float>::infinity();
    const std::vector<float> max_dist_sq(queries.size(), limit);
    std::vector<uint32_t> ids(queries.size());
    std::vector<float> dist_sq(queries.size());
    for (auto _ : state)
        index->nearest(queries, 0, queries.size(), 1, max_dist_sq.data(), ids.data(), dist_sq.data());
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(queries.size()));
}
BENCHMARK(search_nearest)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void solve_horn(benchmark::State& state)
{
    mp2p_icp::SeededRandom random(1);
    mp2p_icp::Pairings pairings;
    for (int64_t i = 0; i < state.range(0); i++)
    {
        const mrpt::math::TPoint3D p(random.gaussian(), random.gaussian(), random.gaussian());
        pairings.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, p, {p.y + 1, -p.x, p.z}));
    }
    mp2p_icp::OptimalTF_Result result;
    for (auto _ : state) benchmark::DoNotOptimize(mp2p_icp::optimal_tf_horn(pairings, {}, result));
    state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(solve_horn)->Arg(3)->Arg(100)->Arg(10000);

void align_one_call(benchmark::State& state)
{
    const auto global = cloud(static_cast<size_t>(state.range(0)), 1);
    auto local = cloud(static_cast<size_t>(state.range(0)), 2);
    local->changeCoordinatesReference(mrpt::poses::CPose3D(0.3, -0.2, 0.1, 0.02, 0, 0));
    for (auto _ : state) benchmark::DoNotOptimize(mp2p_icp::align(*local, *global));
}
BENCHMARK(align_one_call)->Arg(20000)->Unit(benchmark::kMillisecond);
}  // namespace

BENCHMARK_MAIN();
