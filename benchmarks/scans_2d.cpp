// Consecutive scans of a 2-D laser, aligned in three ways: points, point to line, and walls alone. Where
// different pieces of a scan give the same pose, it can be believed, though nobody knows the truth.
//   bench-scans_2d FILE.rawlog [--least-motion M] [--stride N] [--aperture-deg A] [--odometry] [--list]
//   [--apart N] [--pipelines A B C]
// --least-motion: leaves out scans nearer than so many metres and 5 degrees to the one before, by odometry.
// --apart: pairs each scan not with the next one, but with the Nth: of another place, if N is large.
// --odometry: starts from the odometry, not from the identity. --aperture-deg: of the scans, in place of what
// the rawlog says.
#include <mrpt/core/bits_math.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <iostream>

#include "common/Aligner.h"
#include "common/overlap.h"
#include "laser_rawlog.h"

namespace
{
using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mrpt::poses::CPose3D;

struct Pair
{
    CPose3D odometry;
    std::array<Results, 3> results;
    double overlap = 0;
};

void print_share(const std::string& what, size_t count, size_t of)
{
    std::cout << "  " << what << ": " << count << " of " << of << " ("
              << 100 * static_cast<double>(count) / static_cast<double>(std::max<size_t>(1, of)) << " %)\n";
}

void print_agreement(const std::string& what, const std::vector<Pair>& pairs, size_t a, size_t b)
{
    size_t within_5 = 0, within_2 = 0, of = 0;
    for (const auto& p : pairs)
    {
        const auto &x = p.results[a], &y = p.results[b];
        if (p.overlap < 0.6 || !determines_plane(x) || !determines_plane(y)) continue;
        of++;
        within_5 += agree(x.optimal_tf.mean, y.optimal_tf.mean, 0.05, 1.0);
        within_2 += agree(x.optimal_tf.mean, y.optimal_tf.mean, 0.02, 0.3);
    }
    print_share(what + " within 5 cm and 1 deg", within_5, of);
    print_share(what + " within 2 cm and 0.3 deg", within_2, of);
}
}  // namespace

int main(int argc, char** argv)
{
    std::string path;
    double least_motion = 0, aperture_deg = 0;
    size_t stride = 1, apart = 1;
    bool list = false, odometry = false;
    std::vector<std::string> names = {"icp-2d-laser", "icp-2d-point-to-line", "icp-2d-walls"};
    CLI::App app("Points, point to line and walls on consecutive 2-D scans");
    app.add_option("rawlog", path)->required();
    app.add_option("--least-motion", least_motion);
    app.add_option("--pipelines", names, "for points, point to line, and walls")->expected(3);
    app.add_option("--stride", stride);
    app.add_option("--apart", apart);
    app.add_option("--aperture-deg", aperture_deg);
    app.add_flag("--list", list);
    app.add_flag("--odometry", odometry);
    app.footer(
        "\nExample:\n  bench-scans_2d tour.rawlog --apart 2 --pipelines icp-2d-laser icp-2d-point-to-line "
        "icp-2d-walls");
    CLI11_PARSE(app, argc, argv);

    std::vector<LaserScan> scans;
    for (const auto& s : laser_scans(path))
    {
        const CPose3D moved = scans.empty() ? CPose3D(1e6, 0, 0) : s.odometry - scans.back().odometry;
        if (moved.norm() < least_motion && std::abs(moved.yaw()) < mrpt::DEG2RAD(5.0)) continue;
        scans.push_back(s);
        if (aperture_deg > 0) s.scan->aperture = static_cast<float>(mrpt::DEG2RAD(aperture_deg));
    }
    std::vector<Pipeline> pipelines;
    for (const auto& name : names) pipelines.push_back(mp2p_icp_bench::Aligner(name).pipeline());

    std::vector<Pair> pairs;
    std::array<double, 3> seconds{};
    std::array<size_t, 3> iterations{};
    for (size_t k = 0; k + apart < scans.size(); k += stride)
    {
        Pair pair;
        pair.odometry = scans[k + apart].odometry - scans[k].odometry;
        for (size_t m = 0; m < names.size(); m++)
        {
            const auto start = std::chrono::steady_clock::now();
            const auto global = map_of_scan(pipelines[m], *scans[k].scan),
                       local = map_of_scan(pipelines[m], *scans[k + apart].scan);
            const CPose3D guess = odometry ? pair.odometry : CPose3D();
            pipelines[m].icp->align(local, global, guess.asTPose(), pipelines[m].parameters, pair.results[m],
                                    planar_prior(guess));
            seconds[m] += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            iterations[m] += pair.results[m].nIterations;
            if (m > 0) continue;
            const std::string walls = global.layers.count("dense") ? "dense" : "raw";  // filled in, or not
            pair.overlap = mp2p_icp_bench::overlap({local, "raw"}, {global, walls},
                                                   pair.results[m].optimal_tf.mean, 0.2);
        }
        pairs.push_back(pair);
        if (!list) continue;
        std::cout << k << " overlap " << pair.overlap << " odometry " << pair.odometry << "\n";
        for (const auto& r : pair.results)
            std::cout << "    " << to_string(r.verdict) << " " << r.optimal_tf.mean << " "
                      << r.finalPairings.contents_summary() << " q " << r.quality
                      << (determines_plane(r) ? "" : " FREE") << "\n";
    }

    const auto count = [&](auto&& is)
    { return static_cast<size_t>(std::count_if(pairs.begin(), pairs.end(), is)); };
    const auto enough = [](const Pair& p) { return p.overlap >= 0.6; };
    std::cout << pairs.size() << " pairs; of the " << count(enough) << " with an overlap of 60 %:\n";
    for (size_t m = 0; m < names.size(); m++)
    {
        print_share(names[m] + " calls aligned, of all",
                    count([&](const Pair& p) { return p.results[m].trusted(); }), pairs.size());
        print_share(names[m] + " determines x, y, yaw",
                    count([&](const Pair& p) { return enough(p) && determines_plane(p.results[m]); }),
                    count(enough));
        std::cout << "    " << 1e3 * seconds[m] / static_cast<double>(pairs.size()) << " ms and "
                  << static_cast<double>(iterations[m]) / static_cast<double>(pairs.size())
                  << " iterations each\n";
    }
    print_agreement("points and point to line", pairs, 0, 1);
    print_agreement("points and walls", pairs, 0, 2);
    print_agreement("point to line and walls", pairs, 1, 2);
}
