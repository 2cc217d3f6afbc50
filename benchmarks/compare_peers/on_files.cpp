#include <mp2p_icp/load_map.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <tuple>

#include "common/lidar_worlds.h"
#include "comparisons.h"
#include "measured_run.h"

namespace compare_peers
{
using mrpt::poses::CPose3D;

namespace
{
/// Of one voxel size, number of threads and method, in the order of the rounds; empty where it failed.
using Rounds = std::vector<std::optional<Measurement>>;
using Table = std::map<std::tuple<size_t, int, size_t>, Rounds>;

Points points_of_file(const std::string& path)
{
    const auto cloud = mp2p_icp::load_map(path).map->point_layer("raw");
    Points points(cloud->size());
    for (size_t i = 0; i < points.size(); i++)
        cloud->getPointFast(i, points[i].x(), points[i].y(), points[i].z());
    return points;
}

template <class Value>
double median_of(const Rounds& rounds, const Value& value)
{
    std::vector<double> values;
    for (const auto& m : rounds)
        if (m) values.push_back(value(*m));
    return median(values);
}

void print_row(const std::string& name, int threads, const Rounds& rounds,
               const std::optional<CPose3D>& truth)
{
    using M = const Measurement&;
    const auto error = [&](auto of)
    { return median_of(rounds, [&](M m) { return truth ? of(m.mrpt_pose(), *truth) : std::nan(""); }); };
    const auto count =
        std::count_if(rounds.begin(), rounds.end(), [](const auto& m) { return m.has_value(); });
    std::printf("%-24s %7d %10.2f %9.2f %9.2f %6.0f %8.2f %7.3f %7.1f %6td\n", name.c_str(), threads,
                median_of(rounds, [](M m) { return m.prepare_ms; }),
                median_of(rounds, [](M m) { return m.align_ms; }),
                median_of(rounds, [](M m) { return m.total_ms(); }),
                median_of(rounds, [](M m) { return m.iterations; }), 100 * error(mp2p_icp_bench::error_m),
                error(mp2p_icp_bench::error_deg), median_of(rounds, [](M m) { return m.peak_mb; }), count);
}

/// How long ours takes, of the time of the peer that is the fastest in the same round: median of the rounds.
void print_ratio(const Method& method, int threads, const Rounds& ours,
                 const std::vector<const Rounds*>& peers)
{
    std::vector<double> ratios;
    for (size_t round = 0; round < ours.size(); round++)
    {
        double fastest = INFINITY;
        for (const auto* peer : peers)
            if ((*peer)[round]) fastest = std::min(fastest, (*peer)[round]->total_ms());
        if (ours[round]) ratios.push_back(ours[round]->total_ms() / fastest);
    }
    std::printf("  %s, %d threads: %.3f of the time of the fastest peer\n", method.name.c_str(), threads,
                median(ratios));
}

void print_table(const Table& table, size_t voxel, const std::vector<Method>& methods,
                 const std::optional<CPose3D>& truth)
{
    std::printf("%-24s %7s %10s %9s %9s %6s %8s %7s %7s %6s\n", "method", "threads", "prepare ms", "align ms",
                "total ms", "iter.", "error cm", "deg", "peak MB", "rounds");
    for (const int threads : {1, 2})
    {
        std::vector<const Rounds*> peers;
        for (size_t m = 0; m < methods.size(); m++)
        {
            const Rounds& rounds = table.at({voxel, threads, m});
            print_row(methods[m].name, threads, rounds, truth);
            if (!methods[m].ours) peers.push_back(&rounds);
        }
        for (size_t m = 0; m < methods.size(); m++)
            if (methods[m].ours) print_ratio(methods[m], threads, table.at({voxel, threads, m}), peers);
    }
}
}  // namespace

void compare_on_files(const FilePair& files, const std::vector<Method>& methods,
                      const std::vector<double>& voxels, const Task& task, int rounds)
{
    std::optional<CPose3D> truth;
    if (!files.truth.empty()) truth = mp2p_icp_bench::pose_of_file(files.truth);
    const auto load = [&]() { return Clouds{points_of_file(files.local), points_of_file(files.global)}; };
    Table table;
    for (int round = 0; round < rounds; round++)
        for (size_t v = 0; v < voxels.size(); v++)
            for (const int threads : {1, 2})
                for (size_t m = 0; m < methods.size(); m++)
                {
                    Task now = task;
                    now.voxel = voxels[v];
                    table[{v, threads, m}].push_back(measured_run(methods[m], load, now, threads));
                }
    for (size_t v = 0; v < voxels.size(); v++)
    {
        std::printf("\n%s\n", voxel_name(voxels[v]).c_str());
        print_table(table, v, methods, truth);
    }
}
}  // namespace compare_peers
