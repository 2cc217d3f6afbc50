// How far verdicts can be trusted: counts over many synthetic pairs of scans.
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mrpt/core/bits_math.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <map>
#include <regex>

#include "../tests/icp/degenerate_worlds.h"
#include "common/Aligner.h"
#include "common/laser_2d.h"
#include "common/lidar_worlds.h"
#include "common/overlap.h"
#include "laser_rawlog.h"

namespace
{
using namespace mp2p_icp;
using namespace mp2p_icp_bench;
using namespace mp2p_icp::synthetic;
using mrpt::poses::CPose3D;

/// A pipeline, and the sensor that it is for.
class Subject
{
 public:
    explicit Subject(const std::string& pipeline)
        : aligner_(pipeline), flat_(pipeline.find("2d") != std::string::npos)
    {
    }
    bool flat() const { return flat_; }
    CPose3D sensor() const { return flat_ ? CPose3D(0.3, -0.2, 1, 0, 0, 0) : sensor_pose(); }

    metric_map_t scan(const TriangleMesh& mesh, const CPose3D& from, uint64_t seed) const
    {
        const RayTracer world(mesh);
        if (!flat_) return aligner_.filtered(lidar_scan(world, from, seed));
        LaserScanner2D laser;
        laser.max_range = 30, laser.sigma = 0.02, laser.seed = seed;
        return mp2p_icp_test::map_of_scan(aligner_.pipeline(), laser_observation(world, from, laser));
    }
    /// A flat pose moves in its plane only.
    CPose3D moved(double metres, double degrees, SeededRandom& random) const
    {
        if (!flat_) return moved_by(metres, degrees, random);
        const double heading = random.uniform(-M_PI, M_PI), side = random.uniform() < 0.5 ? -1 : 1;
        return {
            metres * std::cos(heading), metres * std::sin(heading), 0, side * mrpt::DEG2RAD(degrees), 0, 0};
    }
    /// Of flat scans, with the prior that the motion is planar.
    Results align(const metric_map_t& local, const metric_map_t& global, const CPose3D& guess) const
    {
        if (!flat_) return aligner_.align(local, global, guess);
        return aligner_.align(local, global, guess, mp2p_icp_test::planar_prior(guess));
    }
    double overlap_at(const CPose3D& guess, const metric_map_t& local, const metric_map_t& global) const
    {
        return overlap_at_first(aligner_.pipeline(), local, global, guess);
    }

 private:
    Aligner aligner_;
    bool flat_;
};

/// How often what was said, and with --reasons why (numbers left out).
class Counts
{
 public:
    Counts(std::string title, bool reasons) : title_(std::move(title)), reasons_(reasons) {}
    void add(const std::string& what, const Results& r)
    {
        counts_[what]++;
        if (reasons_)
            why_[what + ": " +
                 std::regex_replace(r.verdict_reason, std::regex("[-+]?[0-9][0-9.e+-]*"), "#")]++;
    }
    /// What may be said beside.
    void add_if(bool it_is, const std::string& what) { beside_[what] += it_is; }
    void print() const
    {
        std::printf("%-30s", title_.c_str());
        for (const auto* counts : {&counts_, &beside_})
            for (const auto& [what, count] : *counts) std::printf("  %zu %s", count, what.c_str());
        std::printf("\n");
        for (const auto& [why, count] : why_) std::printf("    %zu %s\n", count, why.c_str());
        std::fflush(stdout);
    }

 private:
    std::string title_;
    bool reasons_;
    std::map<std::string, size_t> counts_, beside_, why_;
};

struct Options
{
    std::string pipeline = "icp-3d-point-to-plane";
    uint64_t seed = 1;
    size_t count = 100;
    bool reasons = false;
};

bool names_exactly(const mp2p_icp_test::DegenerateWorld& world, const Results& r)
{
    if (r.verdict != Verdict::under_constrained || r.unobservable.size() != world.free) return false;
    std::vector<std::string> named;
    for (const auto& twist : r.unobservable)
        if (!twist.name.empty()) named.push_back(twist.name);
    std::sort(named.begin(), named.end());
    return world.named.empty() || named == world.named;
}

void degenerate(const Subject& subject, const Options& o)
{
    for (const auto& world : mp2p_icp_test::degenerate_worlds())
    {
        Counts counts(world.name + " (" + std::to_string(world.free) + " free)", o.reasons);
        for (uint64_t seed = o.seed; seed < o.seed + o.count; seed++)
        {
            SeededRandom random(seed);
            const double metres = random.uniform(0.05, 0.3), degrees = random.uniform(0, 4);
            const CPose3D step = subject.moved(metres, degrees, random);
            const Results r = subject.align(subject.scan(world.mesh, subject.sensor() + step, 2 * seed + 1),
                                            subject.scan(world.mesh, subject.sensor(), 2 * seed), CPose3D());
            counts.add(names_exactly(world, r)
                           ? "exactly the free motions"
                           : to_string(r.verdict) + ", " + std::to_string(r.unobservable.size()) + " free",
                       r);
        }
        counts.print();
    }
}

void healthy(const Subject& subject, const Options& o)
{
    Counts counts("healthy rooms and streets", o.reasons);
    for (uint64_t seed = o.seed; seed < o.seed + o.count; seed++)
    {
        SeededRandom random(seed);
        const double metres = random.uniform(0.1, 0.5), degrees = random.uniform(0, 5);
        const CPose3D step = subject.moved(metres, degrees, random);
        const auto mesh = room_or_street(seed);
        const Results r = subject.align(subject.scan(mesh, subject.sensor() + step, 2 * seed + 1),
                                        subject.scan(mesh, subject.sensor(), 2 * seed), CPose3D());
        const bool right =
            error_m(r.optimal_tf.mean, step) < 0.05 && error_deg(r.optimal_tf.mean, step) < 0.6;
        counts.add(to_string(r.verdict) + (right ? " and right" : " and wrong (5 cm, 0.6 deg)"), r);
        counts.add_if(!r.unobservable.empty(), "with a free motion");
    }
    counts.print();
}

/// A guess where fewer than 5 % of the local points are within the matcher's distance: none, or some.
CPose3D guess_without_overlap(const Subject& subject, const metric_map_t& local, const metric_map_t& global,
                              bool some, SeededRandom& random)
{
    for (;;)
    {
        const double metres = random.uniform(3, 80), degrees = random.uniform(0, 180);
        const CPose3D guess(subject.moved(metres, degrees, random).asTPose());  // as align() takes it
        const double overlap = subject.overlap_at(guess, local, global);
        if (overlap < 0.05 && (overlap > 0) == some) return guess;
    }
}

void no_overlap(const Subject& subject, const Options& o)
{
    Counts counts("less than 5 % overlap", o.reasons);
    double overlap = 0;
    for (uint64_t seed = o.seed; seed < o.seed + o.count; seed++)
    {
        const auto mesh = room_or_street(seed);
        const auto global = subject.scan(mesh, subject.sensor(), 2 * seed),
                   local = subject.scan(mesh, subject.sensor(), 2 * seed + 1);
        SeededRandom random(seed);
        const CPose3D guess = guess_without_overlap(subject, local, global, seed / 2 % 2, random);
        const Results r = subject.align(local, global, guess);
        const bool found = error_m(r.optimal_tf.mean, {}) < 0.05 && error_deg(r.optimal_tf.mean, {}) < 0.6;
        counts.add(to_string(r.verdict) + (!r.trusted() ? "" : found ? " and right" : " and wrong"), r);
        counts.add_if(rotation_of(r.optimal_tf.mean) != rotation_of(guess) ||
                          translation_of(r.optimal_tf.mean) != translation_of(guess),
                      "with the guess changed");
        overlap += subject.overlap_at(guess, local, global) / static_cast<double>(o.count);
    }
    counts.print();
    std::printf("    mean overlap at the guess: %.2f %%\n", 100 * overlap);
}

/// Rooms of different sizes, and streets: each is laid on another one of its kind.
void different_places(const Subject& subject, const Options& o)
{
    Counts rooms("different rooms", o.reasons), streets("different streets", o.reasons);
    const auto place = [](uint64_t seed)
    {
        SeededRandom random(1000 * seed + 17);
        const double x = random.uniform(6, 14), y = random.uniform(6, 14), z = random.uniform(2.4, 4);
        return seed % 2 ? room_with_boxes(x, y, z, 8, seed) : street(120, seed);
    };
    for (uint64_t seed = o.seed; seed < o.seed + o.count; seed++)
    {
        const Results r = subject.align(subject.scan(place(seed + 1'000'000), subject.sensor(), 2 * seed + 1),
                                        subject.scan(place(seed), subject.sensor(), 2 * seed), CPose3D());
        (seed % 2 ? rooms : streets).add(to_string(r.verdict), r);
    }
    rooms.print(), streets.print();
}

void run(const Options& o)
{
    const Subject subject(o.pipeline);
    std::printf("%s, seeds %ju to %ju\n", o.pipeline.c_str(), o.seed, o.seed + o.count - 1);
    if (!subject.flat()) degenerate(subject, o);
    healthy(subject, o);
    no_overlap(subject, o);
    different_places(subject, o);
}
}  // namespace

int main(int argc, char** argv)
{
    Options o;
    CLI::App app(
        "Counts the verdicts of a pipeline on ray-traced scans: of worlds that leave motions free (3-D "
        "only), of "
        "healthy ones, of scans that do not overlap, of scans of different places laid on each other");
    app.option_defaults()->always_capture_default();
    app.add_option("pipeline", o.pipeline,
                   "Name of a shipped pipeline, or file. With 2d in its name, it gets 2-D laser scans");
    app.add_option("--count", o.count, "Pairs of each kind")->check(CLI::PositiveNumber);
    app.add_option("--seed", o.seed, "Of the first pair; the next ones follow");
    app.add_flag("--reasons", o.reasons, "Also counts the sentences that explain verdicts");
    app.footer("\nExample:\n  bench-verdicts icp-coarse-to-fine --count 200 --seed 1000");
    CLI11_PARSE(app, argc, argv);
    try
    {
        run(o);
    }
    catch (const std::exception& e)
    {
        std::cerr << "bench-verdicts: " << e.what() << "\n";
        return 1;
    }
}
