#include <mp2p_icp/offscreen_render.h>

#include "log_tools.h"

/// \file test_log_scene_view.cpp Cubes instead of points, what is cut off before and behind, and a view that
/// follows the local map: by what is seen in pictures.
using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
const mrpt::img::TColor BLUE = LogSceneOptions().global.color, ORANGE = LogSceneOptions().local.color;

LogSnapshotOptions from_above()
{
    auto options = small_picture();
    options.direction = view_from_name("top");
    return options;
}

bool inked(const LogPicture& picture, const TPoint3D& point)
{
    return !seen_at(picture.image, picture.pixel(0, point), WHITE);
}

/// The cube of the grid in which a point of the global map is; the grid begins at the middle of the scene.
TPoint3D middle_of_cube(const LogScene& scene, const TPoint3D& p, double side)
{
    const TPoint3D in_metres = scene.in_scene(p) * scene.unit();
    const auto middle = [side](double x) { return (std::floor(x / side) + 0.5) * side; };
    return p + TPoint3D(middle(in_metres.x), middle(in_metres.y), middle(in_metres.z)) - in_metres;
}
}  // namespace

TEST(LogScene, draws_the_cubes_that_hold_points)
{
    constexpr double SIDE = 0.6;
    const std::vector<TPoint3D> inner = {{1, 1, 0}, {-1, 1, 1}, {0, -1, 2}}, outer = {{-4, -4, 0}, {4, 4, 0}};
    auto all = inner;
    all.insert(all.end(), outer.begin(), outer.end());
    LogScene scene(metric_map_t::ConstPtr(shared_map(all)));
    auto options = scene.options();
    const auto points = draw_log(scene, {FINAL_MOMENT}, from_above());
    options.global.voxel_size = SIDE;
    scene.set_options(options);
    const auto cubes = draw_log(scene, {FINAL_MOMENT}, from_above());
    for (const auto& p : inner)
    {
        const TPoint3D middle = middle_of_cube(scene, p, SIDE);
        for (const double x : {-0.3, 0.0, 0.3})
            for (const double y : {-0.3, 0.3})
            {
                EXPECT_TRUE(inked(cubes, middle + TPoint3D(x * SIDE, y * SIDE, 0))) << p << x << y;
                EXPECT_FALSE(inked(cubes, middle + TPoint3D(3 * x * SIDE, 3 * y * SIDE, 0))) << p << x << y;
            }
        EXPECT_TRUE(inked(points, p));
    }
    options.global.voxel_size = 0;
    scene.set_options(options);
    EXPECT_EQ(difference(draw_log(scene, {FINAL_MOMENT}, from_above()).image, points.image), 0) << "and back";
}

TEST(LogScene, cuts_off_what_is_before_or_behind)
{
    LogScene scene(metric_map_t::ConstPtr(shared_map({{0, 0, 0}, {4, 0, 1}, {0, 3, 2}, {4, 3, 3}})));
    const auto seen = [&](const DepthClip& clip)
    {
        auto options = scene.options();
        options.clip = clip;
        scene.set_options(options);
        const auto picture = draw_log(scene, {FINAL_MOMENT}, from_above());
        std::string heights;
        for (const auto& p : {TPoint3D(0, 0, 0), TPoint3D(4, 0, 1), TPoint3D(0, 3, 2), TPoint3D(4, 3, 3)})
            if (inked(picture, p)) heights += std::to_string(static_cast<int>(p.z));
        return heights;
    };
    // The middle is at a height of 1.5 m.
    EXPECT_EQ(seen({}), "0123");
    EXPECT_EQ(seen({0, 1e9}), "01");
    EXPECT_EQ(seen({1, 1e9}), "012");
    EXPECT_EQ(seen({1e9, 0}), "23");
    EXPECT_EQ(seen({1, 1}), "12");
    EXPECT_EQ(seen({1e9, -1}), "3");
}

TEST(LogScene, a_view_can_follow_the_local_map)
{
    // The middle of the local map is a point of it, and no other comes near.
    const std::vector<TPoint3D> cross = {{0, 0, 0}, {2, 0, 0}, {-2, 0, 0}, {0, 2, 0}, {0, -2, 0}};
    const auto log =
        log_of(shared_map({{3, 3, 0}, {-3, -3, 0}}), shared_map(cross), CPose3D(1.5, -1.2, 0.9, 0.5, 0, 0));
    LogScene scene(log);
    OrthoView view = scene.fit(1, view_from_name("top"));
    const auto still = view.focus;
    for (const auto& moment : {GUESS_MOMENT, after(0), FINAL_MOMENT})
    {
        scene.show(moment);
        const auto seen_in_middle = [&](const TPoint3D& focus)
        {
            view.focus = focus;
            auto content = scene.scene_for(view, 200, 200);
            return seen_at(render_offscreen(*content, 200, 200), {100, 100}, ORANGE);
        };
        EXPECT_TRUE(seen_in_middle(scene.local_middle())) << to_string(moment);
        EXPECT_LT((scene.local_middle() - pose_at(*log, moment).composePoint({0, 0, 0})).norm(), 1e-6);
        EXPECT_FALSE(seen_in_middle(still)) << to_string(moment);
    }
}
