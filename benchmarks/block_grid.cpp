// Times of the block grid on one thread, beside those of the voxel filter and of nanoflann on the same
// clouds.
//
// All contenders of one table take turns in one run, many rounds long, so that what else the machine does
// falls on all of them alike: trust the ratios more than the milliseconds.
#include <mp2p_icp/block_grid.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/FilterDecimateVoxels.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <functional>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "with_threads.h"

using namespace mp2p_icp;

namespace
{
const char* const HELP =
    R"(Times decimation, normals and nearest-neighbour search of the block grid, on one thread, beside
FilterDecimateVoxels and the KD-tree, on random clouds and on the pair of clouds that is given.

Usage: bench-block-grid [TARGET SOURCE] [--voxel METRES] [--rounds COUNT] [--help]

  TARGET SOURCE    two files of point clouds that overlap; SOURCE is searched in TARGET as it is
  --voxel METRES   side of the voxels for them. 0.25 by default
  --rounds COUNT   how often every contender runs, in turns; medians are over these. 31 by default
  --help           this text

Example: bench-block-grid target.ply source.ply --rounds 101
)";

struct Options
{
    std::vector<std::string> files;
    double voxel = 0.25;
    size_t rounds = 31;
    bool help = false;
};

Options parse(const std::vector<std::string>& arguments)
{
    Options o;
    for (size_t i = 0; i < arguments.size(); i++)
    {
        const std::string& a = arguments[i];
        const auto value = [&]()
        {
            if (i + 1 == arguments.size()) throw std::invalid_argument(a + " needs a value");
            return std::stod(arguments[++i]);
        };
        if (a == "--help")
            o.help = true;
        else if (a == "--voxel")
            o.voxel = value();
        else if (a == "--rounds")
            o.rounds = static_cast<size_t>(std::max(1.0, value()));
        else if (a.rfind("--", 0) == 0)
            throw std::invalid_argument("unknown option " + a);
        else
            o.files.push_back(a);
    }
    if (o.files.size() != 0 && o.files.size() != 2) throw std::invalid_argument("give two files, or none");
    return o;
}

struct Contender
{
    std::string name;
    std::function<void()> work;
    size_t compared_with;  ///< number of the contender that its ratio refers to; its own: none
};

double milliseconds(const std::function<void()>& work)
{
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// Runs all in turns. Ratios are medians of the ratios within a round.
void print_table(const std::string& title, const std::vector<Contender>& contenders, size_t rounds)
{
    std::vector<std::vector<double>> times(contenders.size());
    for (const auto& c : contenders) c.work();  // once to warm up
    for (size_t r = 0; r < rounds; r++)
        for (size_t c = 0; c < contenders.size(); c++) times[c].push_back(milliseconds(contenders[c].work));
    const auto median = [](std::vector<double> v)
    {
        std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
        return v[v.size() / 2];
    };
    std::printf("%s\n  %-44s %9s %9s %7s\n", title.c_str(), "", "min, ms", "median", "ratio");
    for (size_t c = 0; c < contenders.size(); c++)
    {
        std::printf("  %-44s %9.3f %9.3f", contenders[c].name.c_str(),
                    *std::min_element(times[c].begin(), times[c].end()), median(times[c]));
        std::vector<double> ratios;
        for (size_t r = 0; r < rounds; r++)
            ratios.push_back(times[contenders[c].compared_with][r] / times[c][r]);
        if (contenders[c].compared_with != c) std::printf(" %6.2fx", median(ratios));
        std::printf("\n");
    }
}

mrpt::maps::CSimplePointsMap::Ptr cloud_of(const PointArrays& points)
{
    auto cloud = mrpt::maps::CSimplePointsMap::Create();
    cloud->setAllPoints(points.x, points.y, points.z);
    return cloud;
}

/// Searches of all of `queries`, one after the other.
struct Searches
{
    const PointArrays& queries;
    std::vector<float> max_dist_sq, dist_sq;
    std::vector<uint32_t> ids;

    Searches(const PointArrays& q, float limit)
        : queries(q), max_dist_sq(q.size(), limit), dist_sq(q.size()), ids(q.size())
    {
    }
    void in(const NearestNeighborIndex& index)
    {
        index.nearest(queries, 0, queries.size(), 1, max_dist_sq.data(), ids.data(), dist_sq.data());
    }
    void in(const BlockGrid& grid)
    {
        for (size_t i = 0; i < queries.size(); i++)
        {
            const GridNeighbor n = grid.nearest(queries.x[i], queries.y[i], queries.z[i], max_dist_sq[i]);
            ids[i] = n.id, dist_sq[i] = n.dist_sq;
        }
    }
    void with_bounds_in(const BlockGrid& grid)
    {
        for (size_t i = 0; i < queries.size(); i++)
            dist_sq[i] =
                grid.nearest_and_bound(queries.x[i], queries.y[i], queries.z[i], max_dist_sq[i]).others;
    }
};

BlockGridOptions grid_options(double voxel, GridElements elements, bool moments)
{
    BlockGridOptions o;
    o.voxel_size = voxel, o.elements = elements, o.moments = moments;
    return o;
}

/// Search in `points` as they are; both kinds of index must agree.
void bench_search(const std::string& title, const PointArrays& points, const PointArrays& queries,
                  double voxel, float near_sq, size_t rounds)
{
    const auto cloud = cloud_of(points);
    BlockGrid grid;
    NearestNeighborIndex::ConstPtr tree;
    const BlockGridOptions options = grid_options(voxel, GridElements::Points, false);
    Searches near(queries, near_sq), far(queries, std::numeric_limits<float>::infinity());
    print_table(title + ", " + std::to_string(points.size()) + " points, " + std::to_string(queries.size()) +
                    " searches, voxels of " + std::to_string(voxel) + " m",
                {{"KD-tree, built", [&]() { tree = make_kdtree_index(cloud); }, 0},
                 {"grid, built", [&]() { grid.rebuild(points, options); }, 0},
                 {"KD-tree, near", [&]() { near.in(*tree); }, 2},
                 {"grid, near", [&]() { near.in(grid); }, 2},
                 {"grid, near, with bounds", [&]() { near.with_bounds_in(grid); }, 2},
                 {"KD-tree, any distance", [&]() { far.in(*tree); }, 5},
                 {"grid, any distance", [&]() { far.in(grid); }, 5}},
                rounds);
    near.in(grid), far.in(grid);
    const auto near_ids = near.ids, far_ids = far.ids;
    near.in(*tree), far.in(*tree);
    if (near_ids != near.ids || far_ids != far.ids) throw std::runtime_error("the indexes do not agree");
}

void bench_pair(const Options& o)
{
    const auto target = load_map(o.files[0]).map, source = load_map(o.files[1]).map;
    const auto target_points = target->point_layer("raw"), source_points = source->point_layer("raw");
    mp2p_icp_filters::FilterDecimateVoxels filter;
    filter.initialize(yaml_from_text(
        "{input_pointcloud_layer: raw, output_pointcloud_layer: out, decimate_method: VoxelAverage, "
        "voxel_filter_resolution: " +
        std::to_string(o.voxel) + "}"));
    BlockGrid target_grid, source_grid;
    std::vector<VoxelSurface> surfaces;
    const auto with_moments = grid_options(o.voxel, GridElements::VoxelMeans, true),
               without = grid_options(o.voxel, GridElements::VoxelMeans, false);
    print_table("Pair, " + std::to_string(target_points->size()) + " and " +
                    std::to_string(source_points->size()) + " points, voxels of " + std::to_string(o.voxel) +
                    " m",
                {{"FilterDecimateVoxels, target", [&]() { filter.filter(*target); }, 0},
                 {"grid, target, with index and moments",
                  [&]() { target_grid.rebuild(*target_points, with_moments); }, 0},
                 {"the same, in fresh memory", [&]() { BlockGrid(*target_points, with_moments); }, 0},
                 {"grid, source, with index", [&]() { source_grid.rebuild(*source_points, without); }, 0},
                 {"grid, surfaces of the target", [&]() { target_grid.surfaces(surfaces); }, 4}},
                o.rounds);
    bench_search("Source means in target means", target_grid.means(), source_grid.means(), o.voxel, 1,
                 o.rounds);
}

PointArrays random_cloud(size_t n, uint64_t seed)
{
    SeededRandom random(seed);
    PointArrays out;
    out.resize(n);
    for (size_t i = 0; i < n; i++)
        for (auto* v : {&out.x, &out.y, &out.z}) (*v)[i] = static_cast<float>(random.uniform(-10, 10));
    return out;
}

void run(const Options& o)
{
    if (!o.files.empty()) bench_pair(o);
    // About 16 points per block.
    bench_search("Uniform in a cube of 20 m", random_cloud(100000, 1), random_cloud(10000, 2), 0.27, 0.25f,
                 o.rounds);
}
}  // namespace

int main(int argc, char** argv)
{
    try
    {
        const Options o = parse(std::vector<std::string>(argv + 1, argv + argc));
        if (o.help)
            std::cout << HELP;
        else
            mp2p_icp_test::with_threads(1, [&]() { run(o); });
        return 0;
    }
    catch (const std::exception& e)
    {
        std::cerr << "bench-block-grid: " << e.what() << "\n";
        return 1;
    }
}
