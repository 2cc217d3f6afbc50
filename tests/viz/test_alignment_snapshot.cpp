#include <gtest/gtest.h>
#include <mp2p_icp/alignment_snapshot.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <cmath>
#include <filesystem>

#include "picture_checks.h"
#include "test_data.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mrpt::math::TPoint3D;
using mrpt::poses::CPose3D;

namespace
{
const mrpt::img::TColor BLUE = SnapshotOptions().global_color, ORANGE = SnapshotOptions().local_color;

metric_map_t map_of(const std::vector<TPoint3D>& points)
{
    auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (const auto& p : points)
        cloud->insertPoint(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    metric_map_t map;
    map.layers[metric_map_t::PT_LAYER_RAW] = cloud;
    return map;
}

const std::vector<TPoint3D> CORNERS = {{0, 0, 0}, {4, 0, 0}, {0, 3, 0}, {0, 0, 2}, {4, 3, 1}};
const CPose3D GUESS(0.5, 0.4, 0, 0.2, 0, 0), RESULT(0, 0, 0, 0, 0, 0);

size_t count(const AlignmentPicture& picture, const PictureArea& area, const mrpt::img::TColor& color)
{
    return mp2p_icp_test::count(picture.image, color, area.left, area.top, area.width, area.height);
}

SnapshotOptions small()
{
    SnapshotOptions options;
    options.width = 800;
    options.height = 400;
    return options;
}
}  // namespace

TEST(draw_alignment, each_half_shows_both_maps_where_they_are)
{
    const auto picture = draw_alignment(map_of(CORNERS), map_of(CORNERS), GUESS, RESULT, small());
    ASSERT_EQ(picture.image.getWidth(), 800u);
    ASSERT_EQ(picture.image.getHeight(), 400u);
    EXPECT_LE(picture.before.left + picture.before.width, picture.after.left);
    for (const auto& p : CORNERS)
    {
        EXPECT_TRUE(seen_at(picture.image, picture.pixel(picture.before, p), BLUE));
        EXPECT_TRUE(seen_at(picture.image, picture.pixel(picture.before, GUESS.composePoint(p)), ORANGE));
        // After it, local points stand in front of the same global ones.
        EXPECT_TRUE(seen_at(picture.image, picture.pixel(picture.after, RESULT.composePoint(p)), ORANGE));
        EXPECT_FALSE(seen_at(picture.image, picture.pixel(picture.after, GUESS.composePoint(p)), ORANGE));
        EXPECT_FALSE(seen_at(picture.image, picture.pixel(picture.before, RESULT.composePoint(p)), ORANGE));
    }
}

TEST(draw_alignment, points_covered_after_it_are_fewer_than_before)
{
    const synthetic::RayTracer room(synthetic::room_with_boxes(10, 8, 2.5, 6, 2));
    const CPose3D A(0, 0, 1, 0, 0, 0), B(0.5, 0.2, 1, 0.2, 0, 0);
    metric_map_t global, local;
    global.layers["raw"] = synthetic::scan_from(room, A, synthetic::LaserScanner2D()).points;
    local.layers["raw"] = synthetic::scan_from(room, B, synthetic::LaserScanner2D()).points;
    const auto picture = draw_alignment(global, local, CPose3D(), B - A, small());
    EXPECT_DOUBLE_EQ(picture.view.elevation_deg, 90) << "a 2-D scan";
    EXPECT_GT(count(picture, picture.before, BLUE),
              1.2 * static_cast<double>(count(picture, picture.after, BLUE)));
    EXPECT_GT(count(picture, picture.before, ORANGE), 200u);
    EXPECT_GT(count(picture, picture.after, ORANGE), 200u);
}

TEST(draw_alignment, the_scale_bar_is_as_long_as_it_says)
{
    // Seen from above, 8 m fill the 1.08 * 8 m of the picture's width.
    const auto picture = draw_alignment(map_of({{-4, 0, 0}, {4, 0, 0}}), map_of({{-4, 0, 0}, {4, 0, 0}}),
                                        CPose3D(), CPose3D(), small());
    const double px_per_metre = picture.before.height / picture.view.height;
    int longest = 0;
    const int footer = picture.before.top + picture.before.height + 2;
    for (int y = footer; y < 400; y++)
        for (int x = 0, run = 0; x < 800; x++)
        {
            run = like(color_at(picture.image, x, y), {0, 0, 0}) ? run + 1 : 0;
            longest = std::max(longest, run);
        }
    EXPECT_NEAR(longest, 2 * px_per_metre, 3) << "2 m is the longest round length within a third of 8.64 m";
}

TEST(draw_alignment, captions_take_their_own_room)
{
    const auto global = map_of(CORNERS);
    auto options = small();
    const auto plain = draw_alignment(global, global, GUESS, RESULT, options);
    options.captions = {"verdict: aligned", std::string(200, 'x') + " " + std::string(70, 'y')};
    const auto captioned = draw_alignment(global, global, GUESS, RESULT, options);
    EXPECT_GE(captioned.before.top, plain.before.top + 5 * 20) << "one line, and four after wrapping";
    EXPECT_GT(mp2p_icp_test::count(captioned.image, {0, 0, 0}, 0, 0, 800, captioned.before.top),
              5 * mp2p_icp_test::count(plain.image, {0, 0, 0}, 0, 0, 800, plain.before.top));
    options.captions.assign(1000, "a long story");
    EXPECT_GT(draw_alignment(global, global, GUESS, RESULT, options).before.height, 100)
        << "the clouds keep their room";
}

TEST(draw_alignment, draws_one_point_and_skips_those_that_are_not_finite)
{
    const auto one = map_of({{1, 2, 3}}), with_nan = map_of({{1, 2, 3}, {NAN, 0, 0}, {0, -INFINITY, 0}});
    const auto picture = draw_alignment(one, with_nan, CPose3D(), CPose3D(), small());
    EXPECT_TRUE(seen_at(picture.image, picture.pixel(picture.before, {1, 2, 3}), ORANGE));
    EXPECT_TRUE(seen_at(picture.image, picture.pixel(picture.after, {1, 2, 3}), ORANGE));
}

TEST(draw_alignment, works_far_from_the_origin_and_with_a_far_guess)
{
    std::vector<TPoint3D> far;
    for (const auto& p : CORNERS) far.push_back(p + TPoint3D(1e4, -1e4, 500));
    const auto picture =
        draw_alignment(map_of(far), map_of(CORNERS), CPose3D(), CPose3D(1e4, -1e4, 500, 0, 0, 0), small());
    EXPECT_TRUE(seen_at(picture.image, picture.pixel(picture.before, {0, 0, 0}), ORANGE));
    EXPECT_TRUE(seen_at(picture.image, picture.pixel(picture.before, far[0]), BLUE));
    EXPECT_TRUE(seen_at(picture.image, picture.pixel(picture.after, far[0]), ORANGE));
}

TEST(draw_alignment, what_cannot_be_drawn_is_refused)
{
    const auto map = map_of(CORNERS);
    EXPECT_THROW(draw_alignment(metric_map_t(), map, GUESS, RESULT), std::invalid_argument);
    EXPECT_THROW(draw_alignment(map, map_of({}), GUESS, RESULT), std::invalid_argument);
    EXPECT_THROW(draw_alignment(map, map_of({{NAN, 0, 0}}), GUESS, RESULT), std::invalid_argument);
    EXPECT_THROW(draw_alignment(map, map, CPose3D(NAN, 0, 0, 0, 0, 0), RESULT), std::invalid_argument);
    EXPECT_THROW(draw_alignment(map, map, GUESS, CPose3D(INFINITY, 0, 0, 0, 0, 0)), std::invalid_argument);
    auto options = small();
    options.width = 399;
    EXPECT_THROW(draw_alignment(map, map, GUESS, RESULT, options), std::invalid_argument);
    options = small();
    options.height = 5000;
    EXPECT_THROW(draw_alignment(map, map, GUESS, RESULT, options), std::invalid_argument);
}

TEST(save_alignment_snapshot, the_file_holds_the_picture)
{
    const std::string path = temp_path(".png");
    const auto map = map_of(CORNERS);
    save_alignment_snapshot(map, map, GUESS, RESULT, small(), path);
    mrpt::img::CImage read;
    ASSERT_TRUE(read.loadFromFile(path));
    const auto picture = draw_alignment(map, map, GUESS, RESULT, small());
    ASSERT_EQ(read.getWidth(), 800u);
    ASSERT_EQ(read.getHeight(), 400u);
    for (int y = 0; y < 400; y++)
        for (int x = 0; x < 800; x++) ASSERT_EQ(color_at(read, x, y), color_at(picture.image, x, y));
    std::filesystem::remove(path);
}

TEST(save_alignment_snapshot, a_place_that_cannot_be_written_is_named)
{
    const auto map = map_of(CORNERS);
    for (const std::string path : {"/no/such/folder/picture.png", "/tmp/picture.unknown_suffix"}) try
        {
            save_alignment_snapshot(map, map, GUESS, RESULT, small(), path);
            FAIL() << path;
        }
        catch (const DataError& e)
        {
            EXPECT_NE(std::string(e.what()).find(path), std::string::npos) << e.what();
        }
}
