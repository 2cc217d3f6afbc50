// The same clouds, voxel sizes and largest pairing distance for PCL, Open3D and this library.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>

#include "comparisons.h"

namespace compare_peers
{
std::string voxel_name(double voxel)
{
    char text[32];
    std::snprintf(text, sizeof(text), "voxels of %g m", voxel);
    return voxel > 0 ? text : "undecimated";
}

double median(std::vector<double> values)
{
    if (values.empty()) return std::nan("");
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

namespace
{
struct Options
{
    FilePair files;
    std::vector<std::string> pipelines = {"icp-3d-lidar", "icp-3d-point-to-plane", "icp-3d-multi-primitive"};
    std::vector<double> voxels = {0.1, 0.25, 0.5, 1, 0};
    Task task;
    int rounds = 10;
    uint64_t pairs = 0, seed = 1;
};

void declare(CLI::App& app, Options& o)
{
    app.option_defaults()->always_capture_default();
    app.add_option("local", o.files.local, "Cloud")->check(CLI::ExistingFile);
    app.add_option("global", o.files.global, "Cloud")->check(CLI::ExistingFile);
    app.add_option("--truth", o.files.truth,
                   "Text file with the 4x4 pose of the local cloud in the global one")
        ->check(CLI::ExistingFile);
    app.add_option("--voxels", o.voxels, "m; 0: undecimated")->check(CLI::NonNegativeNumber);
    app.add_option("--max-distance", o.task.max_distance, "m")->check(CLI::PositiveNumber);
    app.add_option("--neighbors", o.task.neighbors, "For the peers' normals and covariances")
        ->check(CLI::Range(3, 1000));
    app.add_option("--pipelines", o.pipelines, "Ours: shipped names or files");
    app.add_option("--rounds", o.rounds, "Every method once per round")->check(CLI::PositiveNumber);
    app.add_option("--pairs", o.pairs, "So many ray-traced pairs in place of files");
    app.add_option("--seed", o.seed, "Of the first ray-traced pair; the next ones follow");
    app.footer(R"(
Examples:
  Times, iterations, errors and memory on two clouds, with one and two threads:
    compare-peers local.ply global.ply --truth T_global_local.txt --rounds 10
  Errors on ray-traced LiDAR scans, whose truth is exact:
    compare-peers --pairs 20 --seed 100 --voxels 0.25)");
}

std::vector<Method> all_methods(const std::vector<std::string>& pipelines)
{
    std::vector<Method> all;
    for (const auto& some : {pcl_methods(), open3d_methods(), our_methods(pipelines)})
        all.insert(all.end(), some.begin(), some.end());
    return all;
}

void run(const Options& o)
{
    const auto methods = all_methods(o.pipelines);
    if (o.pairs > 0)
        compare_on_synthetic(o.pairs, o.seed, methods, o.voxels, o.task);
    else if (!o.files.global.empty())
        compare_on_files(o.files, methods, o.voxels, o.task, o.rounds);
    else
        throw std::invalid_argument("two clouds, or --pairs");
}
}  // namespace
}  // namespace compare_peers

int main(int argc, char** argv)
{
    CLI::App app("The same clouds for PCL, Open3D and mp2p_icp");
    compare_peers::Options options;
    compare_peers::declare(app, options);
    CLI11_PARSE(app, argc, argv);
    try
    {
        compare_peers::run(options);
    }
    catch (const std::exception& e)
    {
        std::cerr << "compare-peers: " << e.what() << "\n";
        return 1;
    }
}
