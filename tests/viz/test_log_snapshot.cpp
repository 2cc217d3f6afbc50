#include <mp2p_icp/errors.h>

#include <limits>

#include "log_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
const mrpt::img::TColor BLUE = LogSceneOptions().global.color, ORANGE = LogSceneOptions().local.color;

LogPicture picture_at(const LogRecord::ConstPtr& log, const LogMoment& moment,
                      const LogSnapshotOptions& options = small_picture())
{
    LogScene scene(log);
    return draw_log(scene, {moment}, options);
}

/// Local points are seen where the pose puts them, and not where another one would.
void expect_local_at(const LogPicture& picture, size_t panel, const CPose3D& pose, const CPose3D& not_at)
{
    for (const auto& p : CORNERS)
    {
        EXPECT_TRUE(seen_at(picture.image, picture.pixel(panel, pose.composePoint(p)), ORANGE)) << p;
        EXPECT_FALSE(seen_at(picture.image, picture.pixel(panel, not_at.composePoint(p)), ORANGE)) << p;
    }
}
}  // namespace

TEST(draw_log, both_maps_are_where_they_were_at_that_moment)
{
    const auto log = log_of_corners();
    for (const auto& moment : {GUESS_MOMENT, after(0), after(2)})
    {
        const auto picture = picture_at(log, moment);
        ASSERT_EQ(picture.image.getWidth(), 480u);
        ASSERT_EQ(picture.image.getHeight(), 360u);
        expect_local_at(picture, 0, pose_at(*log, moment), CPose3D());
        for (const auto& p : CORNERS) EXPECT_TRUE(seen_at(picture.image, picture.pixel(0, p), BLUE));
    }
    expect_local_at(picture_at(log, FINAL_MOMENT), 0, CPose3D(), pose_at(*log, GUESS_MOMENT));
}

TEST(draw_log, iterations_come_nearer_to_the_final_picture)
{
    // Many points, so that the pictures overlap the more, the nearer the poses are.
    std::vector<TPoint3D> points;
    for (int i = 0; i < 40; i++)
        for (int k = 0; k < 40; k++)
            points.emplace_back(0.1 * i, 0.1 * k, 0.5 * std::sin(0.3 * i) + 0.02 * k);
    const auto log = log_of(shared_map(points), shared_map(points), CPose3D(2, 0, 0, 0, 0, 0));
    LogScene scene(log);
    const auto moments = log_moments(*log);
    const auto last = draw_log(scene, {moments.back()}, small_picture()).image;
    double before = std::numeric_limits<double>::infinity();
    for (const auto& moment : moments)
    {
        const double now = difference(draw_log(scene, {moment}, small_picture()).image, last);
        if (moment.kind == LogMoment::Kind::Iteration)
        {
            EXPECT_LT(now, before) << moment.iteration;
        }
        before = now;
    }
    EXPECT_EQ(before, 0) << "the title is the same, too";
}

TEST(draw_log, a_sheet_shows_one_moment_per_panel_from_one_place)
{
    const auto log = log_of_corners();
    LogScene scene(log);
    auto options = small_picture();
    options.width = 1000, options.height = 700;
    const auto moments = log_moments(*log);
    const auto picture = draw_log(scene, moments, options);
    ASSERT_EQ(picture.panels.size(), moments.size());
    for (size_t i = 0; i + 1 < moments.size(); i++)
        expect_local_at(picture, i, pose_at(*log, moments[i]), pose_at(*log, moments[i + 1]));
}

TEST(draw_log, the_named_views_look_from_there)
{
    const auto log = log_of_corners();
    auto options = small_picture();
    for (const std::string view : {"top", "side", "iso", "fit"})
    {
        options.direction = view_from_name(view);
        const auto picture = picture_at(log, after(0), options);
        expect_local_at(picture, 0, pose_at(*log, after(0)), CPose3D());
        const auto origin = picture.pixel(0, {0, 0, 0});
        const auto along = [&](const TPoint3D& axis)
        {
            const auto d = picture.pixel(0, axis) - origin;
            return std::pair<double, double>(d.x, -d.y);  // to the right, upwards
        };
        const double px = picture.panels[0].height / picture.view.height;
        if (view == "top")
        {
            EXPECT_NEAR(along({1, 0, 0}).first, px, 1e-6);
            EXPECT_NEAR(along({0, 1, 0}).second, px, 1e-6);
        }
        if (view == "side")
        {
            EXPECT_NEAR(along({1, 0, 0}).first, px, 1e-6);
            EXPECT_NEAR(along({0, 0, 1}).second, px, 1e-6);
        }
        if (view == "iso")
        {
            EXPECT_GT(along({0, 0, 1}).second, 0.5 * px);
        }
    }
    EXPECT_THROW(view_from_name("front"), std::invalid_argument);
}

TEST(draw_log, coordinate_offsets_change_nothing)
{
    const TPoint3D far_global(4e6, -3e6, 100), far_local(-2e6, 1e6, 0);
    const auto near = log_of_corners();
    const auto far = log_of(shared_map(CORNERS, far_global), shared_map(CORNERS, far_local));
    // The same poses between the stored coordinates.
    const auto original = [&](const CPose3D& stored)
    {
        LogRecord one = *far;
        one.iterationsDetails->at(0).optimalPose = stored;
        return pose_at(one, after(0));
    };
    far->initialGuessLocalWrtGlobal = original(CPose3D(near->initialGuessLocalWrtGlobal)).asTPose();
    far->icpResult.optimal_tf.mean = original(near->icpResult.optimal_tf.mean);
    for (const auto& moment : {GUESS_MOMENT, after(1), FINAL_MOMENT})
    {
        const auto a = picture_at(near, moment), b = picture_at(far, moment);
        // Positions differ by the rounding of doubles at 4e6 m: a few pixels on edges may get another shade.
        EXPECT_LT(difference(a.image, b.image), 2000) << "of 480 x 360 x 3 x 255";
        EXPECT_GT(difference(a.image, picture_at(near, after(0)).image), 20000) << "what a wrong pose costs";
    }
}

TEST(draw_log, coordinates_of_any_size_are_drawn)
{
    for (const double scale : {1e-4, 1e5, 1e12, 1e30})
    {
        std::vector<TPoint3D> points;
        for (const auto& p : CORNERS) points.push_back(p * scale);
        const auto log = log_of(shared_map(points), shared_map(points), CPose3D(scale, 0, 0, 0, 0, 0));
        const auto picture = picture_at(log, GUESS_MOMENT);
        for (const auto& p : points)
        {
            EXPECT_TRUE(seen_at(picture.image, picture.pixel(0, p), BLUE)) << p;
            EXPECT_TRUE(seen_at(picture.image, picture.pixel(0, p + TPoint3D(scale, 0, 0)), ORANGE)) << p;
        }
    }
    std::vector<TPoint3D> far;
    for (const auto& p : CORNERS)
        far.push_back(p + TPoint3D(1e6, -1e6, 1e6));  // whole numbers: exact in float
    const auto picture =
        picture_at(log_of(shared_map(far), shared_map(far), CPose3D(1, 0, 0, 0, 0, 0)), GUESS_MOMENT);
    for (const auto& p : far) EXPECT_TRUE(seen_at(picture.image, picture.pixel(0, p), BLUE)) << p;
}

TEST(draw_log, draws_what_is_finite)
{
    const auto damaged = shared_map({{1, 2, 3}, {NAN, 0, 0}, {0, -INFINITY, 0}});
    damaged->planes.emplace_back(mrpt::math::TPlane(0, 0, 0, 0), TPoint3D(0, 0, 0));
    damaged->planes.emplace_back(mrpt::math::TPlane(0, 0, NAN, 0), TPoint3D(0, NAN, 0));
    damaged->lines.emplace_back();
    damaged->lines.back().director = {NAN, 0, 0};
    const auto one = picture_at(log_of(shared_map({{1, 2, 3}}), damaged, CPose3D()), FINAL_MOMENT);
    EXPECT_TRUE(seen_at(one.image, one.pixel(0, {1, 2, 3}), ORANGE)) << "a map of one point";

    // One far point does not hide the others.
    auto points = CORNERS;
    for (int i = 0; i < 10; i++) points.insert(points.end(), CORNERS.begin(), CORNERS.end());
    points.emplace_back(1e38, 0, 0);
    const auto outlier = picture_at(log_of(shared_map(points), shared_map(CORNERS)), after(0));
    for (const auto& p : CORNERS) EXPECT_TRUE(seen_at(outlier.image, outlier.pixel(0, p), BLUE));

    for (const auto& empty : {shared_map({}), std::make_shared<metric_map_t>()})
    {
        const auto no_local = picture_at(log_of(shared_map(CORNERS), empty), FINAL_MOMENT);
        for (const auto& p : CORNERS) EXPECT_TRUE(seen_at(no_local.image, no_local.pixel(0, p), BLUE));
        const auto no_global = picture_at(log_of(empty, shared_map(CORNERS)), FINAL_MOMENT);
        for (const auto& p : CORNERS) EXPECT_TRUE(seen_at(no_global.image, no_global.pixel(0, p), ORANGE));
    }
}

TEST(draw_log, what_cannot_be_drawn_is_refused)
{
    EXPECT_THROW(LogScene{LogRecord::ConstPtr()}, std::invalid_argument);
    EXPECT_THROW(LogScene{std::make_shared<const LogRecord>()}, DataError) << "no maps";
    EXPECT_THROW(LogScene{LogRecord::ConstPtr(log_of(shared_map({}), shared_map({{NAN, 0, 0}})))}, DataError);
    EXPECT_THROW(LogScene{metric_map_t::ConstPtr(shared_map({}))}, DataError);

    auto log = log_of_corners();
    log->iterationsDetails->at(1).optimalPose = CPose3D(NAN, 0, 0, 0, 0, 0);
    LogScene scene{LogRecord::ConstPtr(log)};
    EXPECT_THROW(scene.show(after(1)), DataError);
    EXPECT_EQ(scene.moment(), FINAL_MOMENT) << "as it was";
    EXPECT_THROW(scene.show(after(9)), std::invalid_argument);
    EXPECT_THROW(draw_log(scene, {}), std::invalid_argument);
    auto options = small_picture();
    options.width = 100;
    EXPECT_THROW(draw_log(scene, {FINAL_MOMENT}, options), std::invalid_argument);
    options = small_picture();
    EXPECT_THROW(draw_log(scene, std::vector<LogMoment>(200, FINAL_MOMENT), options), std::invalid_argument);

    log->icpResult.optimal_tf.mean = CPose3D(0, INFINITY, 0, 0, 0, 0);
    EXPECT_THROW(LogScene{LogRecord::ConstPtr(log)}, DataError);
}
