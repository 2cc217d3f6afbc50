// How far verdicts can be trusted: counts over many synthetic pairs of LiDAR scans, and over many starts of a
// real pair.
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/RayTracer.h>
#include <mp2p_icp/synthetic/random_pose.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mrpt/core/bits_math.h>

#include <cstdio>
#include <exception>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <stdexcept>

#include "../tests/icp/degenerate_worlds.h"

using namespace mp2p_icp;
using namespace mp2p_icp::synthetic;
using mrpt::poses::CPose3D;

namespace
{
const char* const HELP =
    R"(Counts the verdicts of a shipped pipeline: of worlds that leave motions free, of healthy ones, of scans that do not
overlap, of scans of different places laid on each other; and, given two clouds and the true pose, of many starts.

Usage: bench-verdicts [PIPELINE] [--count N] [--starts TARGET SOURCE TRUTH] [--help]

  PIPELINE    name of a shipped pipeline for LiDAR scans. icp-3d-point-to-plane by default
  --count N   pairs of each kind. 100 by default
  --starts TARGET SOURCE TRUTH   two clouds, and a text file with the 4x4 pose of the source in the target

Example: bench-verdicts icp-coarse-to-fine --count 200
)";

struct Options
{
    std::string pipeline = "icp-3d-point-to-plane";
    size_t count = 100;
    std::vector<std::string> starts;
    bool help = false;
};

Options parse(const std::vector<std::string>& arguments)
{
    Options o;
    for (size_t i = 0; i < arguments.size(); i++)
    {
        const auto value = [&]() -> const std::string&
        {
            if (i + 1 == arguments.size()) throw std::invalid_argument(arguments[i] + " needs a value");
            return arguments[++i];
        };
        if (arguments[i] == "--help")
            o.help = true;
        else if (arguments[i] == "--count")
            o.count = std::stoul(value());
        else if (arguments[i] == "--starts")
            o.starts = {value(), value(), value()};
        else if (arguments[i].rfind("--", 0) == 0)
            throw std::invalid_argument("unknown option " + arguments[i]);
        else
            o.pipeline = arguments[i];
    }
    return o;
}

/// A shipped pipeline, with its filters.
class Aligner
{
 public:
    explicit Aligner(const std::string& name)
        : pipeline_(
              pipeline_from_yaml(yaml_from_text(shipped_pipeline(name), name), {}, mrpt::system::LVL_ERROR))
    {
    }

    metric_map_t filtered(metric_map_t map) const
    {
        const auto filters = pipeline_.filters.find("filters");
        if (filters != pipeline_.filters.end()) mp2p_icp_filters::apply_filter_pipeline(filters->second, map);
        return map;
    }
    Results align(const metric_map_t& local, const metric_map_t& global, const CPose3D& guess) const
    {
        Results result;
        pipeline_.icp->align(local, global, guess.asTPose(), pipeline_.parameters, result);
        return result;
    }

 private:
    Pipeline pipeline_;
};

metric_map_t scan(const TriangleMesh& mesh, const CPose3D& from, uint64_t seed)
{
    RotatingLidar lidar;
    lidar.rings = 64, lidar.azimuth_steps = 450, lidar.lowest_deg = -50, lidar.highest_deg = 40;
    lidar.max_range = 40, lidar.sigma = 0.02, lidar.seed = seed;
    metric_map_t map;
    map.layers[metric_map_t::PT_LAYER_RAW] = scan_from(RayTracer(mesh), from, lidar).points;
    return map;
}

CPose3D moved_by(double metres, double degrees, SeededRandom& random)
{
    const Eigen::Vector3d t =
        metres * Eigen::Vector3d(random.gaussian(), random.gaussian(), random.gaussian()).normalized();
    const Eigen::Vector3d axis =
        Eigen::Vector3d(random.gaussian(), random.gaussian(), random.gaussian()).normalized();
    return make_pose(Eigen::AngleAxisd(mrpt::DEG2RAD(degrees), axis).toRotationMatrix(), t);
}

using Counts = std::map<std::string, size_t>;

void print(const std::string& title, const Counts& counts)
{
    std::printf("%-44s", title.c_str());
    for (const auto& [what, count] : counts) std::printf("  %zu %s", count, what.c_str());
    std::printf("\n");
    std::fflush(stdout);
}

TriangleMesh healthy_world(uint64_t seed)
{
    return seed % 2 ? room_with_boxes(9, 7, 3, 8, seed) : street(120, seed);
}
const CPose3D SENSOR(0.3, -0.2, 1.4, 0, 0.02, 0.01);

void degenerate(const Aligner& aligner, size_t count)
{
    for (const auto& world : mp2p_icp_test::degenerate_worlds())
    {
        Counts counts;
        for (uint64_t seed = 1; seed <= count; seed++)
        {
            SeededRandom random(seed);
            const CPose3D step = moved_by(random.uniform(0.05, 0.3), random.uniform(0, 4), random);
            const Results r = aligner.align(aligner.filtered(scan(world.mesh, SENSOR + step, 2 * seed + 1)),
                                            aligner.filtered(scan(world.mesh, SENSOR, 2 * seed)), CPose3D());
            const bool exact = r.verdict == Verdict::under_constrained && r.unobservable.size() == world.free;
            counts[exact ? "exactly the free motions"
                         : to_string(r.verdict) + ", " + std::to_string(r.unobservable.size()) + " free"]++;
        }
        print(world.name + " (" + std::to_string(world.free) + " free)", counts);
    }
}

void healthy(const Aligner& aligner, size_t count)
{
    Counts counts;
    for (uint64_t seed = 1; seed <= count; seed++)
    {
        SeededRandom random(seed);
        const CPose3D step = moved_by(random.uniform(0.1, 0.5), random.uniform(0, 5), random);
        const auto mesh = healthy_world(seed);
        const Results r = aligner.align(aligner.filtered(scan(mesh, SENSOR + step, 2 * seed + 1)),
                                        aligner.filtered(scan(mesh, SENSOR, 2 * seed)), CPose3D());
        const bool right = (translation_of(r.optimal_tf.mean) - translation_of(step)).norm() < 0.05 &&
                           rotation_angle(rotation_of(r.optimal_tf.mean - step)) < 0.01;
        counts[to_string(r.verdict) + (right ? " and right" : " and wrong (5 cm, 0.57 deg)")]++;
        counts["with a free motion"] += !r.unobservable.empty();
    }
    print("healthy rooms and streets", counts);
}

/// The same world, the local scan put where fewer than 5 % of its points have a neighbour.
void no_overlap(const Aligner& aligner, size_t count)
{
    Counts counts;
    for (uint64_t seed = 1; seed <= count; seed++)
    {
        const auto global = aligner.filtered(scan(healthy_world(seed), SENSOR, 2 * seed)),
                   local = aligner.filtered(scan(healthy_world(seed), SENSOR, 2 * seed + 1));
        const CPose3D guess(seed % 3 ? 100.0 : 0, seed % 3 ? 0 : 120.0, 20, 0.3, 0, 0);
        const Results r = aligner.align(local, global, guess);
        counts[to_string(r.verdict)]++;
        counts["with the guess changed"] += rotation_of(r.optimal_tf.mean) != rotation_of(guess) ||
                                            translation_of(r.optimal_tf.mean) != translation_of(guess);
    }
    print("no overlap", counts);
}

void different_places(const Aligner& aligner, size_t count)
{
    Counts counts;
    for (uint64_t seed = 1; seed <= count; seed++)
    {
        // Rooms of different sizes, and streets: each is laid on another one.
        const auto world = [&](uint64_t s)
        {
            SeededRandom random(1000 * s + 17);
            return s % 2 ? room_with_boxes(random.uniform(6, 14), random.uniform(6, 14),
                                           random.uniform(2.4, 4), 8, s)
                         : street(120, s);
        };
        const Results r = aligner.align(aligner.filtered(scan(world(seed + 500), SENSOR, 2 * seed + 1)),
                                        aligner.filtered(scan(world(seed), SENSOR, 2 * seed)), CPose3D());
        counts[to_string(r.verdict)]++;
    }
    print("different places", counts);
}

CPose3D pose_from_file(const std::string& path)
{
    std::ifstream in(path);
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; i++) in >> m(i / 4, i % 4);
    if (!in) throw std::runtime_error("cannot read 16 numbers from '" + path + "'");
    return make_pose(m.topLeftCorner<3, 3>(), m.topRightCorner<3, 1>());
}

void starts(const Aligner& aligner, const std::vector<std::string>& files, bool at_the_edge)
{
    const auto load = [&](const std::string& path) { return aligner.filtered(*load_map(path).map); };
    const metric_map_t target = load(files[0]), source = load(files[1]);
    const CPose3D truth = pose_from_file(files[2]);
    Counts counts;
    for (uint64_t seed = 1; seed <= 200; seed++)
    {
        SeededRandom random(seed);
        const double metres = at_the_edge ? 2 : 2 * std::cbrt(random.uniform(0, 1)),
                     degrees = at_the_edge ? 15 : random.uniform(0, 15);
        const Results r = aligner.align(source, target, truth + moved_by(metres, degrees, random));
        const bool right = (translation_of(r.optimal_tf.mean) - translation_of(truth)).norm() < 0.10 &&
                           rotation_angle(rotation_of(r.optimal_tf.mean - truth)) < mrpt::DEG2RAD(0.6);
        counts[right ? "right" : r.trusted() ? "wrong and called aligned" : "wrong and not trusted"]++;
        counts["right and not trusted"] += right && !r.trusted();
    }
    print(at_the_edge ? "starts at 2 m and 15 deg" : "starts within 2 m and 15 deg", counts);
}

int run(const Options& options)
{
    if (options.help) return std::cout << HELP, 0;
    const Aligner aligner(options.pipeline);
    if (!options.starts.empty())
    {
        starts(aligner, options.starts, false);
        starts(aligner, options.starts, true);
        return 0;
    }
    degenerate(aligner, options.count);
    healthy(aligner, options.count);
    no_overlap(aligner, options.count);
    different_places(aligner, options.count);
    return 0;
}
}  // namespace

int main(int argc, char** argv)
try
{
    return run(parse({argv + 1, argv + argc}));
}
catch (const std::exception& e)
{
    std::cerr << "bench-verdicts: " << e.what() << "\n";
    return 1;
}
