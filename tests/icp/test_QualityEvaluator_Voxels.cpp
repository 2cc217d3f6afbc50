#include <gtest/gtest.h>
#include <mp2p_icp/QualityEvaluator_Voxels.h>
#include <mp2p_icp/errors.h>

#include "expect_problem.h"
#include "quality_worlds.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
QualityEvaluator_Voxels with_resolution(double metres)
{
    QualityEvaluator_Voxels q;
    q.resolution = metres;
    return q;
}

/// A wall 5 m in front of the sensor, and others.
metric_map_t walls(const std::vector<std::pair<double, double>>& x_and_half_size)
{
    auto map = map_of_points(wall_at(5, 1));
    for (const auto& [x, half_size] : x_and_half_size) add_points(map, wall_at(x, half_size));
    return map;
}

QualityEvaluator::Result at_identity(const QualityEvaluator& q, const metric_map_t& global,
                                     const metric_map_t& local)
{
    return q.evaluate(global, local, CPose3D(), {}, {});
}
}  // namespace

TEST(QualityEvaluator_Voxels, right_poses_score_high_and_wrong_ones_clearly_lower)
{
    const QualityEvaluator_Voxels q;
    for (uint64_t seed = 1; seed <= repetitions(2, 30); seed++)
    {
        SCOPED_TRACE(seed);
        expect_separation(q, room_pair(seed), 0.85, 0.10);
        expect_separation(q, street_pair(seed), 0.85, 0.10);
        expect_separation(q, laser_pair(seed), 0.75, 0.30);
    }
}

TEST(QualityEvaluator_Voxels, falls_with_the_error_on_average)
{
    expect_falling(QualityEvaluator_Voxels(), {room_pair(1), street_pair(2)});
}

TEST(QualityEvaluator_Voxels, another_place_and_a_mirrored_room_score_lower)
{
    const QualityEvaluator_Voxels q;
    for (uint64_t seed = 1; seed <= repetitions(2, 30); seed++)
    {
        SCOPED_TRACE(seed);
        const double right = score(q, room_pair(seed), CPose3D());
        const auto as_if = [&](const char* what, const ScanPair& pair)
        {
            const double wrong = score(q, pair, CPose3D());
            std::printf("%s: %.3f\n", what, wrong);
            return wrong;
        };
        EXPECT_LT(as_if("mirrored room", room_pair(test_room(seed), mirrored(test_room(seed)), seed)),
                  right - 0.05)
            << "walls, floor and ceiling do fit: only the boxes tell";
        EXPECT_LT(as_if("another room",
                        room_pair(test_room(seed), synthetic::room_with_boxes(8, 6, 3, 8, seed + 100), seed)),
                  right - 0.25);
        const double street = score(q, street_pair(seed), CPose3D());
        EXPECT_LT(as_if("another street", street_pair(seed, seed + 100, 1.5)), street - 0.25);
        EXPECT_LT(as_if("the street 30 m on", street_pair(seed, seed, 31.5)), street - 0.25);
    }
}

TEST(QualityEvaluator_Voxels, what_stands_behind_or_in_front_of_a_global_surface_counts_against)
{
    const auto q = with_resolution(0.2);
    const metric_map_t near = walls({{-3, 1}}), far = walls({{-5, 1}});
    const auto quality = [&](const metric_map_t& global, const metric_map_t& local)
    { return at_identity(q, global, local).quality; };
    EXPECT_GT(quality(near, near), 0.99);
    EXPECT_GT(quality(far, far), 0.99);
    // Two walls of equally many voxels: one fits, the other does not. A voxel or two at a rim may differ.
    EXPECT_NEAR(quality(walls({{-3, 2}}), far), 0.5, 0.03) << "seen through the global wall";
    EXPECT_NEAR(quality(walls({{-5, 2}}), near), 1 / 1.5, 0.03) << "in front of it, at half the weight";
    EXPECT_GT(quality(walls({}), near), 0.99) << "where the global map knows nothing";
}

TEST(QualityEvaluator_Voxels, without_free_space_only_what_touches_counts)
{
    auto q = with_resolution(0.2);
    const auto local = map_of_points(wall_at(5, 1)), global = map_of_points(wall_at(3, 2));
    EXPECT_EQ(at_identity(q, global, local).quality, 0.0);
    EXPECT_FALSE(at_identity(q, global, local).hard_discard) << "they contradict, so they do overlap";
    q.use_free_space = false;
    expect_no_overlap(at_identity(q, global, local));
}

TEST(QualityEvaluator_Voxels, rays_are_not_used_from_an_origin_that_sees_through_the_local_surfaces)
{
    const auto q = with_resolution(0.2);
    auto global = map_of_points(wall_at(3, 2)), local = map_of_points(wall_at(3, 2));
    for (const double x : {5, 6, 7}) add_points(local, wall_at(x, 1));  // hidden from the origin by the other
    EXPECT_GT(at_identity(q, global, local).quality, 0.99);
    QualityEvaluator_Voxels moved = q;
    moved.sensor_x = 4;  // between them
    EXPECT_GT(at_identity(moved, local, local).quality, 0.99);
}

TEST(QualityEvaluator_Voxels, too_small_an_overlap_is_discarded)
{
    auto q = with_resolution(0.2);
    const metric_map_t local = walls({{-3, 1}}), global = walls({});  // knows half of it
    q.minimum_overlap = 0.4;
    EXPECT_FALSE(at_identity(q, global, local).hard_discard);
    q.minimum_overlap = 0.6;
    expect_no_overlap(at_identity(q, global, local));
    q.minimum_overlap = 0;
    expect_no_overlap(at_identity(q, map_of_points(wall_at(-5, 1)), map_of_points(wall_at(5, 1))));
}

TEST(QualityEvaluator_Voxels, the_resolution_follows_the_size_of_the_cloud)
{
    const QualityEvaluator_Voxels q;
    const auto surface = wavy_surface(3000, 1), other = wavy_surface(3000, 2);
    const auto quality = [&](double scale, double error)
    {
        auto global = mrpt::maps::CSimplePointsMap::Create(), local = global->Create();
        for (size_t i = 0; i < surface->size(); i++)
        {
            mrpt::math::TPoint3D p, o;
            surface->getPoint(i, p), other->getPoint(i, o);
            global->insertPoint(p * scale), local->insertPoint(o * scale);
        }
        return q.evaluate(map_of(global), map_of(local), CPose3D(0, 0, error * scale), {}, {}).quality;
    };
    for (const double error : {0.0, 0.1})
        for (const double scale : {0.01, 100.0}) EXPECT_NEAR(quality(scale, error), quality(1, error), 0.02);
    EXPECT_GT(quality(0.01, 0), 0.9);
    EXPECT_LT(quality(0.01, 0.1), 0.3);
}

TEST(QualityEvaluator_Voxels, survives_bad_input)
{
    expect_to_survive_bad_input(QualityEvaluator_Voxels());
}

TEST(QualityEvaluator_Voxels, far_away_coordinates_do_not_matter)
{
    expect_same_far_away(QualityEvaluator_Voxels());
}

TEST(QualityEvaluator_Voxels, same_bits_on_any_number_of_threads)
{
    expect_same_bits_on_any_threads(QualityEvaluator_Voxels());
}

TEST(QualityEvaluator_Voxels, serves_icp)
{
    expect_to_serve_icp(std::make_shared<QualityEvaluator_Voxels>(), "mp2p_icp::QualityEvaluator_Voxels");
}

TEST(QualityEvaluator_Voxels, looks_at_the_layers_it_is_told)
{
    auto q = with_resolution(0.2);
    metric_map_t local = map_of_points(wall_at(5, 1)), global = map_of_points(wall_at(5, 1));
    local.layers["other"] = map_of_points(wall_at(-3, 1)).point_layer("raw");
    global.layers["more"] = map_of_points(wall_at(-5, 2)).point_layer("raw");
    q.pointLayers = {"raw"};
    EXPECT_GT(at_identity(q, global, local).quality, 0.99);
    q.pointLayers = {"other"};
    expect_problem_with<std::invalid_argument>({"other"}, [&]() { at_identity(q, global, local); });
    q.pointLayers = {};
    EXPECT_LT(at_identity(q, global, local).quality, 0.8) << "the other wall is in front of a global one";
}

TEST(QualityEvaluator_Voxels, parameters_survive_saving_and_loading_and_are_checked)
{
    QualityEvaluator_Voxels a, b;
    a.initialize(
        yaml_from_text("pointLayers: [raw, more]\nresolution: 0.5\nuse_free_space: false\n"
                       "minimum_overlap: 0.3\nsensor_x: 1\nsensor_y: 2\nsensor_z: 3\n"));
    b.initialize(a.save_parameters());
    EXPECT_EQ(b.pointLayers, (std::vector<std::string>{"raw", "more"}));
    EXPECT_EQ(b.resolution, 0.5);
    EXPECT_FALSE(b.use_free_space);
    EXPECT_EQ(b.minimum_overlap, 0.3);
    EXPECT_EQ(b.sensor_x + 10 * b.sensor_y + 100 * b.sensor_z, 321);
    expect_problem_with<ConfigError>({"resolutoin", "resolution"},
                                     [&]() { a.initialize(yaml_from_text("resolutoin: 1\n")); });
    expect_problem_with<ConfigError>({"resolution"},
                                     [&]() { a.initialize(yaml_from_text("resolution: -1\n")); });
}

TEST(QualityEvaluator_Voxels, separates_on_real_lidar_scans)
{
    const auto truth_file = shared_data("lidar_pair/T_target_source.txt");
    MP2P_ICP_SKIP_WITHOUT(truth_file);
    const ScanPair pair = real_lidar_pair(truth_file);
    expect_separation(QualityEvaluator_Voxels(), pair, 0.75, 0.12);
}
