#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/lidar_worlds.h"
#include "comparisons.h"
#include "measured_run.h"

namespace compare_peers
{
using mrpt::poses::CPose3D;

namespace
{
constexpr double WRONG_M = 0.5;

/// 0.5 to 2 m, mostly level, and 1 to 10 degrees about any axis.
CPose3D motion_of(mp2p_icp::SeededRandom& random)
{
    const double length = random.uniform(0.5, 2.0), heading = random.uniform(-M_PI, M_PI),
                 climb = random.uniform(-0.1, 0.1), angle = mrpt::DEG2RAD(random.uniform(1, 10));
    const double x = random.gaussian(), y = random.gaussian(), z = random.gaussian();
    const Eigen::Vector3d t(std::cos(heading), std::sin(heading), climb), axis(x, y, z);
    return mp2p_icp::make_pose(Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix(),
                               length * t.normalized());
}

struct SyntheticPair
{
    Clouds clouds;
    CPose3D truth;
};

Points scanned(const mp2p_icp::synthetic::RayTracer& world, const CPose3D& from, uint64_t seed)
{
    mp2p_icp::synthetic::RotatingLidar lidar;
    lidar.rings = 64, lidar.azimuth_steps = 1024, lidar.lowest_deg = -25, lidar.highest_deg = 15;
    lidar.max_range = 80, lidar.sigma = 0.02, lidar.seed = seed;
    const auto cloud = scan_from(world, from, lidar).points;
    Points points(cloud->size());
    for (size_t i = 0; i < points.size(); i++)
        cloud->getPointFast(i, points[i].x(), points[i].y(), points[i].z());
    return points;
}

SyntheticPair synthetic_pair(uint64_t seed)
{
    mp2p_icp::SeededRandom random(seed);
    const CPose3D motion = motion_of(random);
    const double x = random.uniform(-20, 20), y = random.uniform(-2, 2), yaw = random.uniform(-M_PI, M_PI);
    const CPose3D at(x, y, 1.8, yaw, 0, 0);
    const mp2p_icp::synthetic::RayTracer world(mp2p_icp::synthetic::street(120, seed));
    return {{scanned(world, at + motion, 2 * seed + 1), scanned(world, at, 2 * seed)}, motion};
}

/// Errors of one method, by pair; NaN where there is no result.
struct Errors
{
    std::vector<double> m, deg;
};

/// Mean of the differences and half the width of its 95 % interval.
void print_difference(const std::string& what, const std::vector<double>& differences, const char* unit)
{
    const auto n = static_cast<double>(differences.size());
    double mean = 0, square = 0;
    for (const double d : differences) mean += d / n;
    for (const double d : differences) square += mrpt::square(d - mean);
    std::printf("  %s %+.5f +- %.5f %s", what.c_str(), mean, 1.96 * std::sqrt(square / (n - 1) / n), unit);
}

/// Over the pairs that neither has wrong: a wrong one says nothing of exactness.
void compare_errors(const Method& our_method, const Errors& ours, const Method& their_method,
                    const Errors& theirs)
{
    std::vector<double> m, deg;
    for (size_t i = 0; i < ours.m.size(); i++)
        if (ours.m[i] < WRONG_M && theirs.m[i] < WRONG_M)
            m.push_back(ours.m[i] - theirs.m[i]), deg.push_back(ours.deg[i] - theirs.deg[i]);
    std::printf("%-24s minus %-22s", our_method.name.c_str(), their_method.name.c_str());
    print_difference("translation", m, "m;");
    print_difference("rotation", deg, "deg;");
    std::printf("  %zu pairs\n", m.size());
}

std::vector<Errors> errors_on(uint64_t pairs, uint64_t seed, const std::vector<Method>& methods,
                              const Task& task)
{
    std::vector<Errors> errors(methods.size());
    for (uint64_t number = 0; number < pairs; number++)
    {
        const auto pair = synthetic_pair(seed + number);
        const auto load = [&] { return pair.clouds; };
        for (size_t m = 0; m < methods.size(); m++)
        {
            const auto result = measured_run(methods[m], load, task, 1);
            const auto error = [&](auto of)
            { return result ? of(result->mrpt_pose(), pair.truth) : std::nan(""); };
            errors[m].m.push_back(error(mp2p_icp_bench::error_m));
            errors[m].deg.push_back(error(mp2p_icp_bench::error_deg));
        }
    }
    return errors;
}
}  // namespace

void compare_on_synthetic(uint64_t pairs, uint64_t seed, const std::vector<Method>& methods,
                          const std::vector<double>& voxels, const Task& task)
{
    for (const double voxel : voxels)
    {
        Task now = task;
        now.voxel = voxel;
        std::printf("\n%s; seeds %ju to %ju\n", voxel_name(voxel).c_str(), seed, seed + pairs - 1);
        const auto errors = errors_on(pairs, seed, methods, now);
        for (size_t m = 0; m < methods.size(); m++)
            std::printf(
                "%-24s median error %.4f m, %.4f deg; right to %g m: %td of %zu\n", methods[m].name.c_str(),
                median(errors[m].m), median(errors[m].deg), WRONG_M,
                std::count_if(errors[m].m.begin(), errors[m].m.end(), [](double e) { return e < WRONG_M; }),
                errors[m].m.size());
        for (size_t a = 0; a < methods.size(); a++)
            for (size_t b = 0; b < methods.size(); b++)
                if (methods[a].ours && !methods[b].ours)
                    compare_errors(methods[a], errors[a], methods[b], errors[b]);
    }
}
}  // namespace compare_peers
