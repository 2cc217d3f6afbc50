// From how far away pipelines find the right pose, from the same starts: of ray-traced rooms and streets, or
// of a given pair of clouds.
#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/load_map.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>

#include "common/Aligner.h"
#include "common/lidar_worlds.h"

namespace
{
using namespace mp2p_icp;
using namespace mp2p_icp_bench;
using mrpt::poses::CPose3D;

constexpr double RIGHT_M = 0.10, RIGHT_DEG = 0.6;

/// Planes and lines alone. The matchers reach as far as the starts, and less with each iteration.
const char* const PRIMITIVES = R"(
class_name: mp2p_icp::ICP
params: {maxIterations: 100, minAbsStep_trans: 1e-4, minAbsStep_rot: 1e-5}
solvers: [SOLVER]
matchers:
  - class: mp2p_icp::Matcher_Planes
    params:
      distanceThreshold: max(0.3, 4 * 0.8^ICP_ITERATION)
      angleThresholdDeg: max(8, 60 * 0.8^ICP_ITERATION)
      minimumOverlap: 0.3
  - class: mp2p_icp::Matcher_Lines
    params:
      distanceThreshold: max(0.3, 4 * 0.8^ICP_ITERATION)
      angleThresholdDeg: max(8, 60 * 0.8^ICP_ITERATION)
      minimumOverlap: 0.3
quality:
  - class: mp2p_icp::QualityEvaluator_PairedRatio
    params:
      reuse_icp_pairings: false
      threshold: 0.5
      pointLayerMatches: [{global: decimated, local: decimated}]
      absolute_minimum_pairing_ratio: 0.5
filters:
  - {class_name: mp2p_icp_filters::FilterPlanes, params: {input_pointcloud_layer: raw}}
  - {class_name: mp2p_icp_filters::FilterLines, params: {input_pointcloud_layer: raw}}
  - class_name: mp2p_icp_filters::FilterDecimateVoxels
    params:
      input_pointcloud_layer: raw
      output_pointcloud_layer: decimated
      voxel_filter_resolution: 0.25
      decimate_method: DecimateMethod::VoxelAverage
)";

const std::map<std::string, std::string> PRIMITIVES_SOLVED_BY = {
    {"primitives-certified", "{class: mp2p_icp::Solver_Certified, params: ~}"},
    {"primitives-gauss-newton", "{class: mp2p_icp::Solver_GaussNewton, params: {maxIterations: 20}}"}};

/// The shipped pipeline without its points.
Pipeline multi_primitive_without_points()
{
    Pipeline pipeline = quiet_pipeline(shipped_pipeline("icp-3d-multi-primitive"), "icp-3d-multi-primitive");
    auto& matchers = pipeline.icp->matchers();
    const auto pairs_points = [](const Matcher::Ptr& m)
    { return std::dynamic_pointer_cast<Matcher_Points_Base>(m) != nullptr; };
    matchers.erase(std::remove_if(matchers.begin(), matchers.end(), pairs_points), matchers.end());
    return pipeline;
}

Aligner aligner_of(const std::string& name)
{
    if (name == "multi-primitive-without-points") return Aligner(multi_primitive_without_points());
    const auto solver = PRIMITIVES_SOLVED_BY.find(name);
    if (solver == PRIMITIVES_SOLVED_BY.end()) return Aligner(name);
    const std::string hole = "SOLVER";
    std::string text = PRIMITIVES;
    text.replace(text.find(hole), hole.size(), solver->second);
    return Aligner(quiet_pipeline(text, name));
}

/// How far from the truth a start is.
struct Level
{
    double metres, degrees;
    bool within;  ///< uniform in the ball and up to the angle, not exactly there

    std::string name() const
    {
        char text[64];
        std::snprintf(text, sizeof(text), "%s %g m, %g deg", within ? "within" : "at", metres, degrees);
        return text;
    }
    CPose3D draw(SeededRandom& random) const
    {
        const double m = within ? metres * std::cbrt(random.uniform()) : metres,
                     deg = within ? degrees * random.uniform() : degrees;
        return moved_by(m, deg, random);
    }
};

std::vector<Level> levels_of(const std::vector<std::string>& texts, bool within)
{
    std::vector<Level> levels;
    for (const auto& text : texts)
    {
        Level level{0, 0, within};
        char rest = 0;
        if (std::sscanf(text.c_str(), "%lf:%lf%c", &level.metres, &level.degrees, &rest) != 2)
            throw std::invalid_argument("a start is METRES:DEGREES, such as 2:15, not '" + text + "'");
        levels.push_back(level);
    }
    return levels;
}

struct Run
{
    bool right = false, aligned = false;
    size_t iterations = 0;
};

/// [level][pipeline][run]
using Table = std::vector<std::vector<std::vector<Run>>>;

struct Scene
{
    metric_map_t local, global;
    CPose3D truth;
};

/// The second sensor is up to 0.5 m and 5 degrees away from the first.
Scene ray_traced_scene(uint64_t seed)
{
    SeededRandom random(seed);
    const double metres = random.uniform(0.1, 0.5), degrees = random.uniform(0, 5);
    const CPose3D truth = moved_by(metres, degrees, random);
    const synthetic::RayTracer world(room_or_street(seed));
    return {lidar_scan(world, sensor_pose() + truth, 2 * seed + 1),
            lidar_scan(world, sensor_pose(), 2 * seed), truth};
}

void add_runs(const Scene& scene, uint64_t seed, size_t starts, const std::vector<Level>& levels,
              const std::vector<Aligner>& aligners, Table& table)
{
    for (size_t a = 0; a < aligners.size(); a++)
    {
        const metric_map_t local = aligners[a].filtered(scene.local),
                           global = aligners[a].filtered(scene.global);
        SeededRandom random(seed);  // the same starts for all
        for (size_t level = 0; level < levels.size(); level++)
            for (size_t i = 0; i < starts; i++)
            {
                const Results r = aligners[a].align(local, global, scene.truth + levels[level].draw(random));
                const bool right = error_m(r.optimal_tf.mean, scene.truth) < RIGHT_M &&
                                   error_deg(r.optimal_tf.mean, scene.truth) < RIGHT_DEG;
                table[level][a].push_back({right, r.trusted(), r.nIterations});
            }
    }
}

template <class Which>
size_t count(const std::vector<Run>& runs, const Which& which)
{
    return static_cast<size_t>(std::count_if(runs.begin(), runs.end(), which));
}

void print_row(const Level& level, const std::string& name, const std::vector<Run>& runs)
{
    const size_t right = count(runs, [](const Run& r) { return r.right; });
    double iterations = 0;
    for (const auto& r : runs) iterations += static_cast<double>(r.iterations);
    const auto n = static_cast<double>(runs.size());
    std::printf("%-22s %-30s %5zu %6zu %6.1f %% %14zu %16zu %10.1f\n", level.name().c_str(), name.c_str(),
                runs.size(), right, 100 * static_cast<double>(right) / n,
                count(runs, [](const Run& r) { return !r.right && r.aligned; }),
                count(runs, [](const Run& r) { return r.right && !r.aligned; }), iterations / n);
}

/// The first pipeline against another one, start by start.
void print_paired(const std::string& name, const std::string& other_name, const std::vector<Run>& runs,
                  const std::vector<Run>& others)
{
    size_t only = 0, only_other = 0, both = 0, fewer = 0, more = 0;
    double difference = 0;
    for (size_t i = 0; i < runs.size(); i++)
    {
        only += runs[i].right && !others[i].right, only_other += others[i].right && !runs[i].right;
        if (!runs[i].right || !others[i].right) continue;
        both++, fewer += runs[i].iterations < others[i].iterations;
        more += runs[i].iterations > others[i].iterations;
        difference += static_cast<double>(runs[i].iterations) - static_cast<double>(others[i].iterations);
    }
    std::printf(
        "  %s and %s: right alone %zu and %zu; of %zu that both have right, fewer iterations %zu and "
        "%zu, on average %+.1f\n",
        name.c_str(), other_name.c_str(), only, only_other, both, fewer, more,
        difference / static_cast<double>(std::max<size_t>(1, both)));
}

struct Options
{
    std::vector<std::string> pipelines = {"primitives-certified", "primitives-gauss-newton"};
    std::vector<std::string> files, at, within;
    uint64_t seed = 1, pairs = 40;
    size_t starts = 5;
};

void run(const Options& o)
{
    std::vector<Level> levels = levels_of(o.within, true);
    for (const auto& level : levels_of(o.at, false)) levels.push_back(level);
    std::vector<Aligner> aligners;
    for (const auto& name : o.pipelines) aligners.push_back(aligner_of(name));
    Table table(levels.size(), std::vector<std::vector<Run>>(aligners.size()));
    if (!o.files.empty())
        add_runs({*load_map(o.files[0]).map, *load_map(o.files[1]).map, pose_of_file(o.files[2])}, o.seed,
                 o.starts, levels, aligners, table);
    else
        for (uint64_t p = 0; p < o.pairs; p++)
            add_runs(ray_traced_scene(o.seed + p), o.seed + p, o.starts, levels, aligners, table);

    std::printf("seed %ju; right: within %g m and %g deg of the truth\n", o.seed, RIGHT_M, RIGHT_DEG);
    std::printf("%-22s %-30s %5s %6s %8s %14s %16s %10s\n", "starts", "pipeline", "runs", "right", "",
                "wrong, aligned", "right, distrusted", "iterations");
    for (size_t level = 0; level < levels.size(); level++)
    {
        for (size_t a = 0; a < aligners.size(); a++)
            print_row(levels[level], o.pipelines[a], table[level][a]);
        for (size_t a = 1; a < aligners.size(); a++)
            print_paired(o.pipelines[0], o.pipelines[a], table[level][0], table[level][a]);
    }
}
}  // namespace

int main(int argc, char** argv)
{
    Options o;
    CLI::App app("From how far away pipelines find the right pose, from the same starts");
    app.option_defaults()->always_capture_default();
    app.add_option(
        "pipelines", o.pipelines,
        "Names of shipped pipelines, files, or of one that pairs planes and lines alone: "
        "primitives-certified, primitives-gauss-newton (far starts), multi-primitive-without-points");
    app.add_option("--files", o.files, "Two clouds, and a text file with the 4x4 pose of LOCAL in GLOBAL")
        ->expected(3)
        ->type_name("LOCAL GLOBAL TRUTH");
    app.add_option("--pairs", o.pairs, "So many ray-traced rooms and streets in place of files");
    app.add_option("--starts", o.starts, "Per pair and distance")->check(CLI::PositiveNumber);
    app.add_option("--at", o.at, "Starts so far from the truth, in metres and degrees")->type_name("M:DEG");
    app.add_option("--within", o.within, "Uniform in the ball of that radius, and up to that angle")
        ->type_name("M:DEG");
    app.add_option("--seed", o.seed, "Of worlds, noise and starts");
    app.footer(R"(
Examples:
  The certified solver and Gauss-Newton on planes and lines, at growing distances:
    bench-starts
  Starts on two files:
    bench-starts icp-coarse-to-fine --files local.ply global.ply truth.txt --starts 200 --within 2:15 --at 2:15
  Iterations of planes and lines, and of points:
    bench-starts multi-primitive-without-points icp-3d-lidar --at 0.5:5 --pairs 200 --starts 1)");
    CLI11_PARSE(app, argc, argv);
    if (o.at.empty() && o.within.empty()) o.at = {"0.5:10", "1:15", "2:20", "2:30", "3:40", "3:50", "4:60"};
    try
    {
        run(o);
    }
    catch (const std::exception& e)
    {
        std::cerr << "bench-starts: " << e.what() << "\n";
        return 1;
    }
}
