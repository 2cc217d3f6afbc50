#include <gtest/gtest.h>
#include <mp2p_icp/QualityEvaluator_RangeImageSimilarity.h>
#include <mp2p_icp/errors.h>

#include "expect_problem.h"
#include "quality_worlds.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
using Evaluator = QualityEvaluator_RangeImageSimilarity;

QualityEvaluator::Result at(const Evaluator& q, const metric_map_t& global, const metric_map_t& local,
                            const CPose3D& pose = CPose3D())
{
    return q.evaluate(global, local, pose, {}, {});
}

metric_map_t wall(double x, double half_size)
{
    return map_of_points(wall_at(x, half_size));
}

/// Ground 2 m below the sensor, from 4 to 40 m ahead of it; another draw for each seed.
metric_map_t ground(uint64_t seed)
{
    SeededRandom random(seed);
    std::vector<mrpt::math::TPoint3Df> points;
    for (int i = 0; i < 20000; i++)
    {
        const double range = 1 / random.uniform(1 / 40.0, 1 / 4.0), azimuth = random.uniform(-0.5, 0.5);
        points.emplace_back(static_cast<float>(range * std::cos(azimuth)),
                            static_cast<float>(range * std::sin(azimuth)), -2.0f);
    }
    return map_of_points(points);
}
}  // namespace

TEST(QualityEvaluator_RangeImageSimilarity, right_poses_score_high_and_wrong_ones_clearly_lower)
{
    const Evaluator q;
    for (uint64_t seed = 1; seed <= repetitions(2, 30); seed++)
    {
        SCOPED_TRACE(seed);
        // 5 degrees move a wall 3 m away, 1 m high, by less than sigma.
        expect_separation(q, room_pair(seed), 0.90, 0.07);
        expect_separation(q, street_pair(seed), 0.85, 0.15);
        expect_separation(q, laser_pair(seed), 0.90, 0.15);
    }
}

TEST(QualityEvaluator_RangeImageSimilarity, falls_with_the_error_on_average)
{
    expect_falling(Evaluator(), {room_pair(1), street_pair(2)});
}

TEST(QualityEvaluator_RangeImageSimilarity, another_place_and_a_mirrored_room_score_lower)
{
    const Evaluator q;
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

TEST(QualityEvaluator_RangeImageSimilarity, distances_score_by_a_gaussian)
{
    const Evaluator q;  // sigma 0.1 m
    const auto local = wall(5, 1);
    EXPECT_GT(at(q, local, local).quality, 0.999);
    for (const double x : {4.9, 5.1})  // within one sigma on either side: float coordinates
        EXPECT_NEAR(at(q, wall(x, 2), local).quality, std::exp(-0.5), 0.01);
    EXPECT_NEAR(at(q, wall(4.8, 2), local).quality, std::exp(-2.0), 0.01);
    EXPECT_LT(at(q, wall(4.5, 2), local).quality, 1e-4) << "seen through the global wall";
}

TEST(QualityEvaluator_RangeImageSimilarity, what_the_global_map_may_have_had_hidden_scores_the_penalty)
{
    Evaluator q;
    const auto local = wall(5, 1), global = wall(7, 3);
    EXPECT_NEAR(at(q, global, local).quality, std::exp(-2.0), 1e-6);
    q.penalty_not_visible = 0;
    EXPECT_NEAR(at(q, global, local).quality, 1.0, 1e-6);
    q.penalty_not_visible = 10;
    EXPECT_LT(at(q, global, local).quality, 1e-6);
}

TEST(QualityEvaluator_RangeImageSimilarity, surfaces_behind_others_are_not_seen)
{
    const Evaluator q;
    auto global = wall(5, 1);
    const double alone = at(q, global, wall(5, 1)).quality;
    add_points(global, wall_at(7, 1.2));  // smaller than the shadow of the wall in front
    EXPECT_EQ(at(q, global, wall(5, 1)).quality, alone);
}

TEST(QualityEvaluator_RangeImageSimilarity, a_pixel_of_grazed_ground_is_not_punished_for_its_depth)
{
    // At 30 m a pixel holds metres of ground; its height is what both maps agree on.
    const Evaluator q;
    EXPECT_GT(at(q, ground(1), ground(2)).quality, 0.95);
    EXPECT_LT(at(q, ground(1), ground(2), CPose3D(0, 0, 0.3)).quality, 0.15);
}

TEST(QualityEvaluator_RangeImageSimilarity, pixels_of_one_map_only_do_not_count_but_some_overlap_is_needed)
{
    Evaluator q;
    auto local = wall(5, 1);
    add_points(local, wall_at(-5, 1));
    EXPECT_GT(at(q, wall(5, 1), local).quality, 0.99);
    q.minimum_overlap = 0.4;
    EXPECT_FALSE(at(q, wall(5, 1), local).hard_discard);
    q.minimum_overlap = 0.6;
    expect_no_overlap(at(q, wall(5, 1), local));
    q.minimum_overlap = 0;
    expect_no_overlap(at(q, wall(-5, 1), wall(5, 1)));
}

TEST(QualityEvaluator_RangeImageSimilarity, the_field_of_view_is_found_wherever_the_sensor_looks)
{
    const Evaluator q;
    const double ahead = at(q, wall(5.1, 2), wall(5, 1)).quality;
    for (const double yaw : {45.0, 90.0, 179.9, 180.0, -90.0, -179.9})
    {
        auto local = wall(5, 1), global = wall(5.1, 2);
        for (auto* map : {&local, &global})
            map->point_layer("raw")->changeCoordinatesReference(pose_deg(0, 0, 0, yaw, 0, 0));
        EXPECT_NEAR(at(q, global, local).quality, ahead, 0.02) << yaw;
    }
}

TEST(QualityEvaluator_RangeImageSimilarity, looks_only_where_it_is_told)
{
    Evaluator q;
    auto local = wall(5, 1), global = wall(5, 1);
    add_points(local, wall_at(-5, 1)), add_points(global, wall_at(-4, 2));
    EXPECT_LT(at(q, global, local).quality, 0.6);
    q.azimuth_from_deg = -45, q.azimuth_to_deg = 45, q.elevation_from_deg = -20, q.elevation_to_deg = 20;
    q.resolution_deg = 2;
    EXPECT_GT(at(q, global, local).quality, 0.99);
    q.azimuth_from_deg = 135, q.azimuth_to_deg = 225;
    EXPECT_LT(at(q, global, local).quality, 0.01);
}

TEST(QualityEvaluator_RangeImageSimilarity, a_pinhole_camera_looks_along_z)
{
    Evaluator q;
    q.initialize(yaml_from_text("ncols: 100\nnrows: 60\ncx: 50\ncy: 30\nfx: 100\nfy: 100\nsigma: 0.2\n"));
    const auto facing_z = [](double z)
    {
        auto map = wall(z, 1);
        map.point_layer("raw")->changeCoordinatesReference(pose_deg(0, 0, 0, 0, -90, 0));  // x to z
        return map;
    };
    EXPECT_GT(at(q, facing_z(5), facing_z(5)).quality, 0.999);
    EXPECT_NEAR(at(q, facing_z(4.8), facing_z(5)).quality, std::exp(-0.5), 0.02);
    expect_no_overlap(at(q, facing_z(-5), facing_z(-5)));
}

TEST(QualityEvaluator_RangeImageSimilarity, the_sensor_may_stand_off_the_origin)
{
    Evaluator q;
    q.sensor_x = 4;  // between the walls: sees the farther one, which the origin does not
    auto global = wall(3, 1), local = global;
    local = wall(3, 1), add_points(local, wall_at(5, 1)), add_points(global, wall_at(5.5, 2));
    EXPECT_LT(at(q, global, local).quality, 0.6);
    q.sensor_x = 0;
    EXPECT_GT(at(q, global, local).quality, 0.99);
}

TEST(QualityEvaluator_RangeImageSimilarity, survives_bad_input)
{
    expect_to_survive_bad_input(Evaluator());
}

TEST(QualityEvaluator_RangeImageSimilarity, far_away_coordinates_do_not_matter)
{
    expect_same_far_away(Evaluator());
}

TEST(QualityEvaluator_RangeImageSimilarity, same_bits_on_any_number_of_threads)
{
    expect_same_bits_on_any_threads(Evaluator());
}

TEST(QualityEvaluator_RangeImageSimilarity, serves_icp)
{
    const auto q = std::make_shared<Evaluator>();
    q->sigma = 0.01;
    expect_to_serve_icp(q, "mp2p_icp::QualityEvaluator_RangeImageSimilarity");
}

TEST(QualityEvaluator_RangeImageSimilarity, a_named_layer_must_be_there)
{
    Evaluator q;
    q.pointLayers = {"raw", "other"};
    expect_problem_with<std::invalid_argument>({"other"}, [&]() { at(q, wall(5, 1), wall(5, 1)); });
}

TEST(QualityEvaluator_RangeImageSimilarity, parameters_survive_saving_and_loading_and_are_checked)
{
    Evaluator a, b;
    a.initialize(
        yaml_from_text("pointLayers: raw\nsigma: 0.3\npenalty_not_visible: 1.5\nminimum_overlap: 0.2\n"
                       "resolution_deg: 0.5\nazimuth_from_deg: -40\nazimuth_to_deg: 50\n"
                       "elevation_from_deg: -10\nelevation_to_deg: 20\nsensor_z: 1.7\n"));
    b.initialize(a.save_parameters());
    EXPECT_EQ(b.pointLayers, std::vector<std::string>{"raw"});
    EXPECT_EQ(b.sigma, 0.3);
    EXPECT_EQ(b.penalty_not_visible, 1.5);
    EXPECT_EQ(b.minimum_overlap, 0.2);
    EXPECT_EQ(b.resolution_deg, 0.5);
    EXPECT_EQ(b.azimuth_to_deg - b.azimuth_from_deg, 90);
    EXPECT_EQ(b.elevation_to_deg - b.elevation_from_deg, 30);
    EXPECT_EQ(b.sensor_z, 1.7);
    for (const auto& [text, part] : std::vector<std::pair<std::string, std::string>>{
             {"sigma: 0\n", "sigma"},
             {"sgima: 1\n", "sigma"},
             {"resolution_deg: 0.001\n", "resolution_deg"},
             {"azimuth_from_deg: 10\nazimuth_to_deg: 5\n", "azimuth_to_deg"},
             {"ncols: 100\nnrows: 60\nfx: 20\n", "pinhole"},
             {"ncols: 9000\nnrows: 9000\nfx: 20\nfy: 20\n", "10 million"}})
        expect_problem_with<ConfigError>({part},
                                         [&, t = text]() { Evaluator().initialize(yaml_from_text(t)); });
}

TEST(QualityEvaluator_RangeImageSimilarity, separates_on_real_lidar_scans)
{
    const auto truth_file = shared_data("lidar_pair/T_target_source.txt");
    MP2P_ICP_SKIP_WITHOUT(truth_file);
    expect_separation(Evaluator(), real_lidar_pair(truth_file), 0.85, 0.15);
}
