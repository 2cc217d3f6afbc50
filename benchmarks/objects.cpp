// How often pipelines find the pose of an object: on exact copies of its points, and on independent samples
// of its surface.
#include <mp2p_icp/synthetic/load_obj_mesh.h>
#include <mp2p_icp/synthetic/random_pose.h>
#include <mp2p_icp/synthetic/sample_by_area.h>
#include <mrpt/core/bits_math.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iostream>

#include "common/Aligner.h"
#include "common/lidar_worlds.h"

namespace
{
using namespace mp2p_icp;
using namespace mp2p_icp_bench;
using mrpt::poses::CPose3D;

struct Options
{
    std::vector<std::string> pipelines = {"icp-object"};
    std::string mesh = "/usr/share/glmark2/models/bunny.obj";
    size_t points = 1000, runs = 1000;
    uint64_t seed = 1;
    double shift = 0.25, angle_deg = 20, noise = 0;
};

metric_map_t map_of(const mrpt::maps::CSimplePointsMap& points, double noise, SeededRandom& random)
{
    auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (size_t i = 0; i < points.size(); i++)
    {
        float p[3];
        points.getPointFast(i, p[0], p[1], p[2]);
        for (float& coordinate : p) coordinate += static_cast<float>(random.gaussian(noise));
        cloud->insertPointFast(p[0], p[1], p[2]);
    }
    metric_map_t map;
    map.layers[metric_map_t::PT_LAYER_RAW] = cloud;
    return map;
}

struct ObjectPair
{
    metric_map_t local, global;
    CPose3D truth;
};

/// \param copy are the local points the global ones, or drawn anew?
ObjectPair object_pair(const synthetic::ObjectMesh& object, const Options& o, bool copy, uint64_t seed)
{
    SeededRandom random(seed);
    const auto global = synthetic::sample_by_area(object.mesh, o.points, random());
    auto local = synthetic::sample_by_area(object.mesh, o.points, random());
    if (copy) local = mrpt::maps::CSimplePointsMap::Create(*global);
    const double shift = o.shift * object.size, angle = mrpt::DEG2RAD(o.angle_deg);
    const CPose3D truth = synthetic::random_pose({shift, shift, shift, angle, angle, angle}, random);
    local->changeCoordinatesReference(-truth);
    ObjectPair pair;
    pair.global = map_of(*global, o.noise * object.size, random);
    pair.local = map_of(*local, o.noise * object.size, random);
    pair.truth = truth;
    return pair;
}

struct Tally
{
    size_t right_1_deg = 0, right_2_deg = 0, wrong_but_aligned = 0, right_but_distrusted = 0;
    std::vector<double> m, deg, iterations;
};

void add_run(const synthetic::ObjectMesh& object, const ObjectPair& pair, const std::string& pipeline,
             Tally& tally)
{
    Aligner aligner(pipeline);
    ParameterSource variables;
    variables.updateVariables(extent_variables(pair.local, pair.global));
    aligner.attach(variables);
    const Results r = aligner.align(aligner.filtered(pair.local), aligner.filtered(pair.global), {});
    const double m = error_m(r.optimal_tf.mean, pair.truth) / object.size,
                 deg = error_deg(r.optimal_tf.mean, pair.truth);
    tally.m.push_back(m), tally.deg.push_back(deg);
    tally.iterations.push_back(static_cast<double>(r.nIterations));
    const bool right = m < 0.01 && deg < 2;
    tally.right_1_deg += m < 0.01 && deg < 1, tally.right_2_deg += right;
    tally.wrong_but_aligned += !right && r.trusted(), tally.right_but_distrusted += right && !r.trusted();
}

double median(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

void print(const std::string& pipeline, bool copy, const Tally& t)
{
    const auto share = [&](size_t count)
    { return 100 * static_cast<double>(count) / static_cast<double>(t.m.size()); };
    std::printf("%-20s %-20s %6zu %9.1f %% %9.1f %% %14zu %17zu %12.3f %8.3f %10.0f\n", pipeline.c_str(),
                copy ? "exact copy" : "independent samples", t.m.size(), share(t.right_1_deg),
                share(t.right_2_deg), t.wrong_but_aligned, t.right_but_distrusted, 100 * median(t.m),
                median(t.deg), median(t.iterations));
    std::fflush(stdout);
}

void run(const Options& o)
{
    const synthetic::ObjectMesh object = synthetic::load_object_mesh(o.mesh);
    std::printf("%s, %zu points, starts within %g of its size and %g deg, noise %g of its size, seed %ju\n",
                o.mesh.c_str(), o.points, o.shift, o.angle_deg, o.noise, o.seed);
    std::printf("%-20s %-20s %6s %11s %11s %14s %17s %12s %8s %10s\n", "pipeline", "clouds", "runs",
                "1 %, 1 deg", "1 %, 2 deg", "wrong, aligned", "right, distrusted", "median error", "deg",
                "iterations");
    for (const auto& pipeline : o.pipelines)
        for (const bool copy : {true, false})
        {
            Tally tally;
            for (uint64_t run = 0; run < o.runs; run++)
                add_run(object, object_pair(object, o, copy, o.seed + run), pipeline, tally);
            print(pipeline, copy, tally);
        }
}
}  // namespace

int main(int argc, char** argv)
{
    Options o;
    CLI::App app(
        "How often pipelines find the pose of an object: errors below 1 % of its size and 1 or 2 degrees");
    app.option_defaults()->always_capture_default();
    app.add_option("pipelines", o.pipelines, "Names of shipped pipelines, or files");
    app.add_option("--mesh", o.mesh, "Triangle mesh (.obj)")->check(CLI::ExistingFile);
    app.add_option("--points", o.points, "Per cloud")->check(CLI::PositiveNumber);
    app.add_option("--runs", o.runs, "Of each kind")->check(CLI::PositiveNumber);
    app.add_option("--shift", o.shift, "Largest start along each axis, of the object's longest side")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--angle", o.angle_deg, "Largest yaw, pitch and roll of the start, degrees")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--noise", o.noise, "Standard deviation of each coordinate, of the object's longest side")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--seed", o.seed, "Of the first run; the next ones follow");
    app.footer("\nExample:\n  bench-objects icp-object --mesh dragon.obj --runs 200 --noise 0.005 --seed 7");
    CLI11_PARSE(app, argc, argv);
    try
    {
        run(o);
    }
    catch (const std::exception& e)
    {
        std::cerr << "bench-objects: " << e.what() << "\n";
        return 1;
    }
}
