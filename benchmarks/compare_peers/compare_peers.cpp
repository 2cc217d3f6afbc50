// The same clouds, voxel size and largest pairing distance for PCL, Open3D and this library: times,
// iterations, errors and memory, medians over interleaved runs.
//   compare-peers LOCAL GLOBAL [--truth T_GLOBAL_LOCAL.txt] [--voxel M] [--max-distance M] [--runs N]
//     [--pipeline NAME_OR_FILE...] [--neighbors K]
//   compare-peers --pairs N      of ray-traced LiDAR scans, whose truth is exact: who is nearest to it?
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mrpt/core/bits_math.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>

#include "measured_run.h"

namespace
{
using namespace compare_peers;
using mrpt::poses::CPose3D;

double median(std::vector<double> values)
{
    if (values.empty()) return std::nan("");
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

double error_m(const Eigen::Matrix4d& pose, const Eigen::Matrix4d& truth)
{
    return (pose.topRightCorner<3, 1>() - truth.topRightCorner<3, 1>()).norm();
}
double error_deg(const Eigen::Matrix4d& pose, const Eigen::Matrix4d& truth)
{
    return mrpt::RAD2DEG(
        mp2p_icp::rotation_angle(truth.topLeftCorner<3, 3>().transpose() * pose.topLeftCorner<3, 3>()));
}

Points points_of(const mrpt::maps::CPointsMap& cloud)
{
    Points points(cloud.size());
    for (size_t i = 0; i < points.size(); i++)
        cloud.getPointFast(i, points[i].x(), points[i].y(), points[i].z());
    return points;
}
Points points_of_file(const std::string& path)
{
    return points_of(*mp2p_icp::load_map(path).map->point_layer("raw"));
}

Eigen::Matrix4d matrix_of_file(const std::string& path)
{
    Eigen::Matrix4d T;
    std::ifstream text(path);
    for (int i = 0; i < 16; i++) text >> T(i / 4, i % 4);
    if (!text) throw std::runtime_error(path + ": expected 16 numbers");
    return T;
}

std::vector<Method> all_methods(const std::vector<std::string>& pipelines)
{
    std::vector<Method> all;
    for (const auto& some : {pcl_methods(), open3d_methods(), our_methods(pipelines)})
        all.insert(all.end(), some.begin(), some.end());
    return all;
}

// ---- One pair of files ------------------------------------------------------------------------------------

void print_row(const std::string& name, int threads, const std::vector<Measurement>& runs,
               const std::optional<Eigen::Matrix4d>& truth)
{
    const auto middle = [&](const auto& value)
    {
        std::vector<double> values;
        for (const auto& m : runs) values.push_back(value(m));
        return median(values);
    };
    std::printf("%-24s %7d %10.1f %9.1f %9.1f %6.0f %8.2f %7.3f %7.1f %5zu\n", name.c_str(), threads,
                middle([](auto& m) { return m.prepare_ms; }), middle([](auto& m) { return m.align_ms; }),
                middle([](auto& m) { return m.total_ms(); }), middle([](auto& m) { return m.iterations; }),
                middle([&](auto& m) { return truth ? 100 * error_m(m.pose(), *truth) : std::nan(""); }),
                middle([&](auto& m) { return truth ? error_deg(m.pose(), *truth) : std::nan(""); }),
                middle([](auto& m) { return m.peak_mb; }), runs.size());
}

void compare_on_files(const std::string& local, const std::string& global, const std::string& truth_file,
                      const std::vector<Method>& methods, const Task& task, int runs)
{
    std::optional<Eigen::Matrix4d> truth;
    if (!truth_file.empty()) truth = matrix_of_file(truth_file);
    const auto load = [&]() { return Clouds{points_of_file(local), points_of_file(global)}; };
    std::map<std::pair<size_t, int>, std::vector<Measurement>> results;
    for (int run = 0; run < runs; run++)
        for (const int threads : {1, 2})
            for (size_t m = 0; m < methods.size(); m++)
                if (const auto result = measured_run(methods[m], load, task, threads))
                    results[{m, threads}].push_back(*result);
    std::printf("%-24s %7s %10s %9s %9s %6s %8s %7s %7s %5s\n", "method", "threads", "prepare ms", "align ms",
                "total ms", "iter.", "error cm", "deg", "peak MB", "runs");
    for (const auto& [key, measured] : results)
        print_row(methods[key.first].name, key.second, measured, truth);
}

// ---- Ray-traced pairs -------------------------------------------------------------------------------------

/// 0.5 to 2 m, mostly level, and 1 to 10 degrees about any axis.
CPose3D motion_of(mp2p_icp::SeededRandom& random)
{
    const double length = random.uniform(0.5, 2.0), heading = random.uniform(-M_PI, M_PI),
                 climb = random.uniform(-0.1, 0.1), angle = mrpt::DEG2RAD(random.uniform(1, 10));
    const Eigen::Vector3d axis(random.gaussian(), random.gaussian(), random.gaussian());
    const Eigen::Vector3d t(std::cos(heading), std::sin(heading), climb);
    return mp2p_icp::make_pose(Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix(),
                               length * t.normalized());
}

struct SyntheticPair
{
    Clouds clouds;
    Eigen::Matrix4d truth;
};

SyntheticPair synthetic_pair(uint64_t number)
{
    using namespace mp2p_icp::synthetic;
    mp2p_icp::SeededRandom random(number);
    const CPose3D motion = motion_of(random);
    const CPose3D at(random.uniform(-20, 20), random.uniform(-2, 2), 1.8, random.uniform(-M_PI, M_PI), 0, 0);
    const RayTracer world(street(120, number));
    RotatingLidar lidar;
    lidar.rings = 64, lidar.azimuth_steps = 1024, lidar.lowest_deg = -25, lidar.highest_deg = 15;
    lidar.max_range = 80, lidar.sigma = 0.02, lidar.seed = 2 * number;
    SyntheticPair pair;
    pair.clouds.global = points_of(*scan_from(world, at, lidar).points);
    lidar.seed++;
    pair.clouds.local = points_of(*scan_from(world, at + motion, lidar).points);
    pair.truth = motion.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>().asEigen();
    return pair;
}

/// Mean of the differences and half the width of its 95 % interval.
void print_difference(const std::string& what, const std::vector<double>& ours,
                      const std::vector<double>& theirs, const std::string& unit)
{
    const auto n = static_cast<double>(ours.size());
    double mean = 0, square = 0;
    for (size_t i = 0; i < ours.size(); i++) mean += (ours[i] - theirs[i]) / n;
    for (size_t i = 0; i < ours.size(); i++) square += mrpt::square(ours[i] - theirs[i] - mean);
    std::printf("  %s: %.5f +- %.5f %s, mean and 95 %% interval of %zu pairs\n", what.c_str(), mean,
                1.96 * std::sqrt(square / (n - 1) / n), unit.c_str(), ours.size());
}

/// Errors of one method, by pair; NaN where there is no result.
struct Errors
{
    std::vector<double> m, deg;
};

/// Over the pairs that both have right to half a metre: a wrong one says nothing of exactness.
void compare_errors(const std::string& ours_name, const Errors& ours, const std::string& their_name,
                    const Errors& theirs)
{
    Errors a, b;
    for (size_t i = 0; i < ours.m.size(); i++)
        if (ours.m[i] < 0.5 && theirs.m[i] < 0.5)
        {
            a.m.push_back(ours.m[i]), a.deg.push_back(ours.deg[i]);
            b.m.push_back(theirs.m[i]), b.deg.push_back(theirs.deg[i]);
        }
    std::cout << ours_name << " minus " << their_name << ":\n";
    print_difference("translation error", a.m, b.m, "m");
    print_difference("rotation error", a.deg, b.deg, "deg");
}

void compare_on_synthetic(uint64_t pairs, const std::vector<Method>& methods, const Task& task)
{
    std::vector<Errors> errors(methods.size());
    for (uint64_t number = 1; number <= pairs; number++)
    {
        const auto pair = synthetic_pair(number);
        for (size_t m = 0; m < methods.size(); m++)
        {
            const auto result = measured_run(
                methods[m], [&] { return pair.clouds; }, task, 1);
            errors[m].m.push_back(result ? error_m(result->pose(), pair.truth) : std::nan(""));
            errors[m].deg.push_back(result ? error_deg(result->pose(), pair.truth) : std::nan(""));
        }
    }
    size_t best = methods.size();
    for (size_t m = 0; m < methods.size(); m++)
    {
        const double middle = median(errors[m].m);
        std::printf("%-24s median error %.4f m, %.4f deg; right to 0.5 m: %td of %zu\n",
                    methods[m].name.c_str(), middle, median(errors[m].deg),
                    std::count_if(errors[m].m.begin(), errors[m].m.end(), [](double e) { return e < 0.5; }),
                    errors[m].m.size());
        if (!methods[m].ours && (best == methods.size() || middle < median(errors[best].m))) best = m;
    }
    for (size_t m = 0; m < methods.size(); m++)
        if (methods[m].ours) compare_errors(methods[m].name, errors[m], methods[best].name, errors[best]);
}
}  // namespace

int main(int argc, char** argv)
{
    CLI::App app("The same clouds for PCL, Open3D and mp2p_icp");
    std::string local, global, truth;
    std::vector<std::string> pipelines = {"icp-3d-lidar", "icp-3d-point-to-plane", "icp-3d-multi-primitive"};
    Task task;
    int runs = 10;
    uint64_t pairs = 0;
    app.add_option("local", local)->check(CLI::ExistingFile);
    app.add_option("global", global)->check(CLI::ExistingFile);
    app.add_option("--truth", truth, "4x4 matrix, local wrt global")->check(CLI::ExistingFile);
    app.add_option("--voxel", task.voxel, "m")->check(CLI::PositiveNumber);
    app.add_option("--max-distance", task.max_distance, "m")->check(CLI::PositiveNumber);
    app.add_option("--neighbors", task.neighbors, "for the peers' normals and covariances")
        ->check(CLI::Range(3, 1000));
    app.add_option("--pipeline", pipelines, "ours: shipped names or files");
    app.add_option("--runs", runs)->check(CLI::PositiveNumber);
    app.add_option("--pairs", pairs, "so many ray-traced pairs in place of files");
    CLI11_PARSE(app, argc, argv);
    try
    {
        if (pairs > 0)
            compare_on_synthetic(pairs, all_methods(pipelines), task);
        else if (!global.empty())
            compare_on_files(local, global, truth, all_methods(pipelines), task, runs);
        else
            throw std::invalid_argument("two clouds, or --pairs");
    }
    catch (const std::exception& e)
    {
        std::cerr << "compare-peers: " << e.what() << "\n";
        return 1;
    }
}
