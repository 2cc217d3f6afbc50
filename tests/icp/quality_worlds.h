#pragma once

#include <mp2p_icp/QualityEvaluator.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "icp_test_tools.h"
#include "test_data.h"
#include "with_threads.h"

namespace mp2p_icp_test
{
/// Two scans, 2 cm of noise, and the pose of the local one.
struct ScanPair
{
    std::string name;
    mp2p_icp::metric_map_t global, local;
    CPose3D truth;
    bool planar = false;  ///< moves and turns out of the x-y plane cannot be seen
};

inline mp2p_icp::synthetic::TriangleMesh mirrored(mp2p_icp::synthetic::TriangleMesh mesh)
{
    for (auto& v : mesh.vertices) v.y = -v.y;
    return mesh;
}

template <class Sensor>
ScanPair scan_pair(const std::string& name, const mp2p_icp::synthetic::TriangleMesh& global_world,
                   const mp2p_icp::synthetic::TriangleMesh& local_world, Sensor sensor, const CPose3D& from,
                   const CPose3D& step, uint64_t seed)
{
    using namespace mp2p_icp::synthetic;
    ScanPair pair;
    pair.name = name, pair.truth = step;
    sensor.seed = 2 * seed;
    pair.global = map_of(scan_from(RayTracer(global_world), from, sensor).points);
    sensor.seed = 2 * seed + 1;
    pair.local = map_of(scan_from(RayTracer(local_world), from + step, sensor).points);
    return pair;
}

inline mp2p_icp::synthetic::RotatingLidar small_lidar()
{
    mp2p_icp::synthetic::RotatingLidar lidar;
    lidar.rings = 32, lidar.azimuth_steps = 450, lidar.lowest_deg = -25, lidar.highest_deg = 15;
    lidar.sigma = 0.02;
    return lidar;
}

inline mp2p_icp::synthetic::TriangleMesh test_room(uint64_t seed)
{
    return mp2p_icp::synthetic::room_with_boxes(9, 7, 3, 8, seed);
}

/// From near the centre, which is free of boxes.
inline ScanPair room_pair(const mp2p_icp::synthetic::TriangleMesh& global_world,
                          const mp2p_icp::synthetic::TriangleMesh& local_world, uint64_t seed)
{
    return scan_pair("room", global_world, local_world, small_lidar(), pose_deg(0.3, -0.2, 1.2, 0, 0, 0),
                     pose_deg(0.4, 0.5, 0.1, 12, 1, -1), seed);
}
inline ScanPair room_pair(uint64_t seed)
{
    return room_pair(test_room(seed), test_room(seed), seed);
}

inline ScanPair street_pair(uint64_t seed, uint64_t local_seed, double along)
{
    using mp2p_icp::synthetic::street;
    auto lidar = small_lidar();
    lidar.azimuth_steps = 720;
    ScanPair pair = scan_pair("street", street(120, seed), street(120, local_seed), lidar,
                              pose_deg(0, 1, 1.8, 0, 0, 0), pose_deg(along, -0.5, 0, 5, 0, 0), seed);
    pair.truth = pose_deg(1.5, -0.5, 0, 5, 0, 0);  // where the local scan is pretended to be
    return pair;
}
inline ScanPair street_pair(uint64_t seed)
{
    return street_pair(seed, seed, 1.5);
}

inline ScanPair laser_pair(uint64_t seed)
{
    mp2p_icp::synthetic::LaserScanner2D laser;
    laser.sigma = 0.01;
    ScanPair pair = scan_pair("2-D laser", test_room(seed), test_room(seed), laser,
                              pose_deg(0.3, -0.2, 0.3, 0, 0, 0), pose_deg(0.4, 0.3, 0, 12, 0, 0), seed);
    pair.planar = true;
    return pair;
}

inline mp2p_icp::QualityEvaluator::Result evaluate(const mp2p_icp::QualityEvaluator& q, const ScanPair& pair,
                                                   const CPose3D& pose)
{
    const auto result = q.evaluate(pair.global, pair.local, pose, {}, {});
    EXPECT_TRUE(result.quality >= 0 && result.quality <= 1) << result.quality;
    return result;
}
inline double score(const mp2p_icp::QualityEvaluator& q, const ScanPair& pair, const CPose3D& error)
{
    return evaluate(q, pair, pair.truth + error).quality;
}

/// Mean over moves by so much in four horizontal directions.
inline double mean_score_moved(const mp2p_icp::QualityEvaluator& q, const ScanPair& pair, double metres)
{
    double sum = 0;
    for (int k = 0; k < 4; k++)
        sum += score(q, pair,
                     CPose3D(metres * std::cos(k * M_PI / 2), metres * std::sin(k * M_PI / 2), 0, 0, 0, 0));
    return sum / 4;
}

/// Mean over turns by so much about the three axes, both ways.
inline double mean_score_turned(const mp2p_icp::QualityEvaluator& q, const ScanPair& pair, double degrees)
{
    double sum = 0;
    for (const double d : {-degrees, degrees})
        sum += score(q, pair, pose_deg(0, 0, 0, d, 0, 0)) + score(q, pair, pose_deg(0, 0, 0, 0, d, 0)) +
               score(q, pair, pose_deg(0, 0, 0, 0, 0, d));
    return sum / 6;
}

/// The highest score of a pose wrong by half a metre (any of eight directions, and up), or by five degrees.
inline double best_wrong_score(const mp2p_icp::QualityEvaluator& q, const ScanPair& pair)
{
    std::vector<CPose3D> errors = {pose_deg(0, 0, 0, 5, 0, 0), pose_deg(0, 0, 0, -5, 0, 0)};
    for (int k = 0; k < 8; k++)
        errors.emplace_back(0.5 * std::cos(k * M_PI / 4), 0.5 * std::sin(k * M_PI / 4), 0.0, 0.0, 0.0, 0.0);
    if (!pair.planar)
        for (const auto& error :
             {pose_deg(0, 0, 0.5, 0, 0, 0), pose_deg(0, 0, 0, 0, 5, 0), pose_deg(0, 0, 0, 0, -5, 0),
              pose_deg(0, 0, 0, 0, 0, 5), pose_deg(0, 0, 0, 0, 0, -5)})
            errors.push_back(error);
    double best = 0;
    for (const auto& error : errors) best = std::max(best, score(q, pair, error));
    return best;
}

/// Right poses score at least `right`, wrong ones at most `margin` less than the right one of their world.
inline void expect_separation(const mp2p_icp::QualityEvaluator& q, const ScanPair& pair, double right,
                              double margin)
{
    const double at_truth = score(q, pair, CPose3D()), at_wrong = best_wrong_score(q, pair);
    std::printf("%-10s right %.3f, best of the wrong ones %.3f\n", pair.name.c_str(), at_truth, at_wrong);
    EXPECT_GE(at_truth, right) << pair.name;
    EXPECT_LE(at_wrong, at_truth - margin) << pair.name;
    EXPECT_FALSE(evaluate(q, pair, pair.truth).hard_discard);
}

/// Means over the pairs fall with every step of these errors.
inline void expect_falling(const mp2p_icp::QualityEvaluator& q, const std::vector<ScanPair>& pairs)
{
    const auto falls = [&](const char* what, const std::vector<double>& errors, const auto& mean_score)
    {
        double before = 2;
        for (const double error : errors)
        {
            double mean = 0;
            for (const auto& pair : pairs)
                mean += mean_score(q, pair, error) / static_cast<double>(pairs.size());
            std::printf("%s by %g: %.3f\n", what, error, mean);
            EXPECT_LT(mean, before) << what << " by " << error;
            before = mean;
        }
    };
    falls("moved (m)", {0, 0.1, 0.2, 0.5, 1, 2}, mean_score_moved);
    falls("turned (deg)", {0, 1, 2, 5, 10, 20}, mean_score_turned);
}

inline void add_points(mp2p_icp::metric_map_t& map, const std::vector<mrpt::math::TPoint3Df>& points)
{
    for (const auto& p : points) map.point_layer("raw")->insertPoint(p.x, p.y, p.z);
}

inline mp2p_icp::metric_map_t map_of_points(const std::vector<mrpt::math::TPoint3Df>& points)
{
    auto map = map_of(mrpt::maps::CSimplePointsMap::Create());
    add_points(map, points);
    return map;
}

/// Square wall facing x, with its middle on the x axis.
inline std::vector<mrpt::math::TPoint3Df> wall_at(double x, double half_size)
{
    std::vector<mrpt::math::TPoint3Df> points;
    for (int i = -20; i <= 20; i++)
        for (int j = -20; j <= 20; j++)
            points.emplace_back(static_cast<float>(x), static_cast<float>(half_size * i / 20),
                                static_cast<float>(half_size * j / 20));
    return points;
}

inline void expect_no_overlap(const mp2p_icp::QualityEvaluator::Result& result)
{
    EXPECT_TRUE(result.hard_discard);
    EXPECT_EQ(result.quality, 0.0);
}

/// What no evaluator may stumble over.
inline void expect_to_survive_bad_input(const mp2p_icp::QualityEvaluator& q)
{
    const ScanPair pair = room_pair(1);
    const mp2p_icp::metric_map_t nothing, empty_layer = map_of_points({}), one = map_of_points({{1, 2, 3}});
    const auto at = [&](const mp2p_icp::metric_map_t& g, const mp2p_icp::metric_map_t& l,
                        const CPose3D& pose = CPose3D()) { return q.evaluate(g, l, pose, {}, {}); };
    for (const auto* map : {&nothing, &empty_layer})
    {
        expect_no_overlap(at(*map, pair.local));
        expect_no_overlap(at(pair.global, *map));
        expect_no_overlap(at(*map, *map));
    }
    expect_no_overlap(at(one, one));  // tells nothing about a pose
    expect_no_overlap(at(pair.global, one));
    expect_no_overlap(at(one, pair.local));
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    expect_no_overlap(at(map_of_points({{nan, 0, 0}}), pair.local));
    expect_no_overlap(at(pair.global, map_of_points({{0, 0, 0}, {nan, 0, 0}, {0, inf, 0}})));
    CPose3D lost;
    lost.x(std::numeric_limits<double>::quiet_NaN());
    expect_no_overlap(at(pair.global, pair.local, lost));
    expect_no_overlap(at(pair.global, pair.local, CPose3D(1e15, 0, 0)));

    ScanPair soiled = room_pair(1);
    for (auto* map : {&soiled.global, &soiled.local}) add_points(*map, {{nan, 0, 0}, {0, -inf, nan}});
    add_points(soiled.local, {{0, 0, 0}, {0, 0, 0}});  // what sensors give for no echo
    EXPECT_EQ(score(q, soiled, CPose3D()), score(q, pair, CPose3D()));

    // These are finite, and may count as points; the rest is still recognised.
    for (auto* map : {&soiled.global, &soiled.local})
        add_points(*map, {{3e38f, 3e38f, -3e38f}, {1e20f, 0, 1}});
    EXPECT_NEAR(score(q, soiled, CPose3D()), score(q, pair, CPose3D()), 0.02);
}

/// A map stored 8 km away has coordinates rounded to half a millimetre, far below the noise.
inline void expect_same_far_away(const mp2p_icp::QualityEvaluator& q)
{
    const ScanPair pair = room_pair(2);
    ScanPair away = room_pair(2);
    const CPose3D shift = pose_deg(8000, -8000, 100, 30, 0, 0);
    away.global.point_layer("raw")->changeCoordinatesReference(shift);
    away.truth = shift + pair.truth;
    EXPECT_NEAR(score(q, away, CPose3D()), score(q, pair, CPose3D()), 0.02);
    expect_no_overlap(evaluate(q, away, pair.truth));
}

inline void expect_same_bits_on_any_threads(const mp2p_icp::QualityEvaluator& q)
{
    const ScanPair pair = room_pair(3);
    const CPose3D error = pose_deg(0.1, 0.05, 0, 2, 0, 0);
    const double expected = score(q, pair, error);
    EXPECT_GT(expected, 0.2);
    for (const int threads : {1, 2, 4, 8})
        with_threads(threads, [&]() { EXPECT_EQ(score(q, pair, error), expected) << threads << " threads"; });
}

/// In the loop of ICP, and by its name in the class factory.
inline void expect_to_serve_icp(const std::shared_ptr<mp2p_icp::QualityEvaluator>& q, const char* class_name)
{
    const auto made = mrpt::rtti::classFactory(class_name);
    EXPECT_TRUE(std::dynamic_pointer_cast<mp2p_icp::QualityEvaluator>(made)) << class_name;
    const auto points = wavy_surface(2000, 1);
    const CPose3D truth = pose_deg(0.02, -0.01, 0.02, 3, -2, 1);
    Bench bench;
    bench.icp.quality_evaluators().clear();
    bench.icp.quality_evaluators().push_back({q, 1.0});
    const auto result = bench.align(map_of(seen_from(truth, *points)), map_of(points));
    EXPECT_EQ(result.verdict, mp2p_icp::Verdict::aligned) << result.verdict_reason;
    EXPECT_LT(translation_error(result.optimal_tf.mean, truth), 1e-3);
    EXPECT_GT(result.quality, 0.95);
}

/// The two real LiDAR scans with known truth; empty truth file: absent.
inline ScanPair real_lidar_pair(const std::string& truth_file)
{
    Eigen::Matrix4d T;
    std::ifstream text(truth_file);
    for (int i = 0; i < 16; i++) text >> T(i / 4, i % 4);
    ScanPair pair;
    pair.name = "real LiDAR";
    pair.global = *mp2p_icp::load_map(shared_data("lidar_pair/target.ply")).map;
    pair.local = *mp2p_icp::load_map(shared_data("lidar_pair/source.ply")).map;
    pair.truth = mp2p_icp::make_pose(T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>());
    return pair;
}

}  // namespace mp2p_icp_test
