#include <mp2p_icp/random.h>
#include <mrpt/opengl/CFBORender.h>

#include "log_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
const mrpt::img::TColor BLUE = LogSceneOptions().global.color;

/// One pairing of each kind, with residuals of 0.6 m along z at the identity, far from each other.
Pairings one_of_each_kind()
{
    const auto patch = [](const TPoint3D& at)
    { return plane_patch_t(mrpt::math::TPlane(0, 0, 1, -at.z), at); };
    const auto line = [](const TPoint3D& at) {
        return mrpt::math::TLine3D::FromPointAndDirector(at, {1, 0, 0});
    };
    const TPoint3D up(0, 0, 0.6);
    Pairings p;
    p.paired_pt2pt.emplace_back(0, 0, CORNERS[0], CORNERS[0] + up);
    p.paired_pt2ln.push_back({line({4, 0, 0}), TPoint3D(4, 0, 0) + up});
    p.paired_pt2pl.push_back({patch({0, 3, 0}), TPoint3D(0, 3, 0) + up});
    p.paired_ln2ln.push_back({line({2, 1, 0}), line(TPoint3D(2, 1, 0) + up)});
    p.paired_pl2pl.push_back({patch({1, 2, 0}), patch(TPoint3D(1, 2, 0) + up)});
    return p;
}

mrpt::img::CImage drawn(LogScene& scene, const LogSceneOptions& options)
{
    scene.set_options(options);
    return draw_log(scene, {FINAL_MOMENT}, small_picture()).image;
}

/// Pixels that are not white around a world point.
size_t inked(const LogPicture& picture, const TPoint3D& point)
{
    const auto at = picture.pixel(0, point);
    return 25 - count(picture.image, WHITE, static_cast<int>(at.x) - 2, static_cast<int>(at.y) - 2, 5, 5);
}
}  // namespace

TEST(LogScene, each_kind_of_pairing_can_be_seen_and_hidden)
{
    auto log = log_of_corners();
    log->icpResult.finalPairings = one_of_each_kind();
    LogScene scene{LogRecord::ConstPtr(log)};
    LogSceneOptions none;
    none.draw_pairings = true;
    none.pairings = {false, false, false, false, false};
    const auto without = drawn(scene, none);
    EXPECT_EQ(difference(without, drawn(scene, {})), 0) << "not asked for";
    const TPoint3D middles[] = {{0, 0, 0.3}, {4, 0, 0.3}, {0, 3, 0.3}, {2, 1, 0.3}, {1, 2, 0.3}};
    bool PairingKinds::*const KINDS[] = {&PairingKinds::pt2pt, &PairingKinds::pt2ln, &PairingKinds::pt2pl,
                                         &PairingKinds::ln2ln, &PairingKinds::pl2pl};
    for (size_t kind = 0; kind < 5; kind++)
    {
        auto one = none;
        one.pairings.*KINDS[kind] = true;
        scene.set_options(one);
        const auto picture = draw_log(scene, {FINAL_MOMENT}, small_picture());
        for (size_t i = 0; i < 5; i++)
            EXPECT_EQ(inked(picture, middles[i]) > 2, i == kind) << "segment " << i << ", kind " << kind;
    }
}

TEST(LogScene, pairings_follow_the_pose_and_the_offsets)
{
    const TPoint3D offset(1e6, 2e6, -1e5);  // of both maps
    for (const bool stored : {true, false})
    {
        auto log = log_of(shared_map(CORNERS, offset), shared_map(CORNERS, offset), CPose3D());
        Pairings pairings;
        pairings.paired_pt2pt.emplace_back(0, 0, TPoint3D(2, 1, 0), TPoint3D(2, 2, 0));
        if (stored) log->iterationsDetails->at(0) = {CPose3D(0, 0, 0.5, 0, 0, 0), pairings};
        if (!stored)
        {
            pairings.paired_pt2pt[0].global += offset, pairings.paired_pt2pt[0].local += offset;
            log->icpResult.finalPairings = pairings;
            log->icpResult.optimal_tf.mean = CPose3D(0, 0, 0.5, 0, 0, 0);
        }
        LogScene scene{LogRecord::ConstPtr(log)};
        LogSceneOptions options;
        options.draw_pairings = true;
        scene.set_options(options);
        const auto picture = draw_log(scene, {stored ? after(0) : FINAL_MOMENT}, small_picture());
        // From (2 1 0) to (2 2 0.5).
        for (const double s : {0.1, 0.5, 0.9})
            EXPECT_GT(inked(picture, TPoint3D(2, 1 + s, 0.5 * s) + offset), 2u) << stored << " " << s;
        EXPECT_EQ(inked(picture, TPoint3D(2, 1.9, 0) + offset), 0u) << "not where the local point was before";
    }
}

TEST(LogScene, residuals_get_colours)
{
    auto log = log_of(shared_map(CORNERS), shared_map(CORNERS), CPose3D());
    auto& pairs = log->icpResult.finalPairings.paired_pt2pt;
    pairs.emplace_back(0, 0, TPoint3D(4, 0, 0), TPoint3D(4, 0, 0));    // no residual
    pairs.emplace_back(0, 0, TPoint3D(0, 3, 0.8), TPoint3D(0, 3, 0));  // the largest
    LogScene scene{LogRecord::ConstPtr(log)};
    LogSceneOptions options;
    options.color_by_residual = true;
    scene.set_options(options);
    const auto picture = draw_log(scene, {FINAL_MOMENT}, small_picture());
    const auto at_ends = [](float share) { return mrpt::img::colormap(mrpt::img::cmJET, share); };
    EXPECT_TRUE(seen_at(picture.image, picture.pixel(0, {4, 0, 0}), at_ends(0)));
    EXPECT_FALSE(seen_at(picture.image, picture.pixel(0, {4, 0, 0}), at_ends(1)));
    EXPECT_TRUE(seen_at(picture.image, picture.pixel(0, {0, 3, 0}), at_ends(1)));
    EXPECT_TRUE(seen_at(picture.image, picture.pixel(0, {0, 0, 2}), BEHIND_RESIDUALS_LOCAL)) << "not paired";
}

TEST(LogScene, layers_can_be_hidden_and_coloured)
{
    auto map = shared_map(CORNERS);
    map->layers["other"] = shared_map({{2, 1, 1}})->layers.begin()->second;
    map->planes.emplace_back(mrpt::math::TPlane(0, 0, 1, -1), TPoint3D(3, 2, 1));
    map->lines.emplace_back(mrpt::math::TLine3D::FromPointAndDirector({1, 2.5, 1.5}, {1, 0, 0}));
    EXPECT_EQ(drawable_parts(*map), (std::vector<std::string>{"other", "raw", "planes", "lines"}));
    LogScene scene{metric_map_t::ConstPtr(map)};
    const auto all = draw_log(scene, {FINAL_MOMENT}, small_picture());
    const auto colors = distinct_colors(*map);
    EXPECT_TRUE(seen_at(all.image, all.pixel(0, {2, 1, 1}), colors.at("other")));
    EXPECT_TRUE(seen_at(all.image, all.pixel(0, CORNERS[4]), colors.at("raw")));
    EXPECT_GT(inked(all, {3, 2, 1}), 2u) << "the middle of the plane";
    EXPECT_GT(inked(all, {1, 2.5, 1.5}), 2u) << "the line";
    auto options = scene.options();
    options.global.hidden = {"other", "planes", "lines"};
    scene.set_options(options);
    const auto some = draw_log(scene, {FINAL_MOMENT}, small_picture());
    for (const auto& gone : {TPoint3D(2, 1, 1), TPoint3D(3, 2, 1), TPoint3D(1, 2.5, 1.5)})
        EXPECT_EQ(inked(some, gone), 0u) << gone;
    EXPECT_TRUE(seen_at(some.image, some.pixel(0, CORNERS[4]), colors.at("raw")));
}

TEST(LogScene, free_motions_covariance_and_frames_are_drawn)
{
    auto log = log_of_corners();
    LogScene plain{LogRecord::ConstPtr(log)};
    const auto before = drawn(plain, {});

    FreeTwist along_x;
    along_x.axis = {1, 0, 0};
    auto free = std::make_shared<LogRecord>(*log);
    free->icpResult.unobservable = {along_x};
    LogScene scene{LogRecord::ConstPtr(free)};
    const auto picture = draw_log(scene, {FINAL_MOMENT}, small_picture());
    // Through the middle of the local map, 0.3 units to both sides.
    const TPoint3D middle(2, 1.5, 1);
    const double u = scene.unit();
    for (const double s : {-0.2, 0.2})
    {
        EXPECT_GT(inked(picture, middle + TPoint3D(s * u, 0, 0)), 2u);
        EXPECT_EQ(inked(picture, middle + TPoint3D(0, s * u, 0)), 0u);
    }
    LogSceneOptions options;
    options.free_motions = false;
    EXPECT_EQ(difference(before, drawn(scene, options)), 0);

    options.covariance = true;
    EXPECT_GT(difference(before, drawn(scene, options)), 0);
    EXPECT_EQ(scene.covariance_scale(), 10) << "0.01 m of about 6 m, to be about a twentieth";
    free->icpResult.optimal_tf.cov(0, 0) = INFINITY;
    EXPECT_EQ(difference(before, drawn(scene, options)), 0) << "an ellipsoid without end";
    options.covariance = false, options.frames = true;
    EXPECT_GT(difference(before, drawn(scene, options)), 0);
}

TEST(LogScene, a_million_points_are_sent_once)
{
    SeededRandom random(1);
    std::vector<TPoint3D> points;
    for (size_t i = 0; i < 500'000; i++)
        points.emplace_back(random.uniform(0, 10), random.uniform(0, 10), random.uniform(0, 3));
    auto log = log_of(shared_map(points), shared_map(points));
    for (auto& [iteration, details] : *log->iterationsDetails)
        details.pairings.paired_pt2pt.emplace_back(0, 0, TPoint3D(0, 0, 0), TPoint3D(1, 1, 1));
    LogScene scene{LogRecord::ConstPtr(log)};
    ASSERT_EQ(scene.points(), 1'000'000u);
    LogSceneOptions options;
    options.draw_pairings = true;
    scene.set_options(options);
    const auto content = scene.scene_for(scene.fit(1), 64, 64);
    mrpt::opengl::CFBORender card(64, 64);  // a window's context lives on like this one
    card.setCamera(*content, content->getViewport()->getCamera());
    mrpt::img::CImage first, frame;
    card.render_RGB(*content, first);
    EXPECT_EQ(scene.builds().cloud_uploads, 2u) << "once per map";
    for (const auto& moment : {GUESS_MOMENT, after(0), after(1), after(2)})
    {
        scene.show(moment);
        card.render_RGB(*content, frame);
        EXPECT_GT(difference(first, frame), 0) << "it did move";
    }
    EXPECT_EQ(scene.builds().cloud_uploads, 2u);
    EXPECT_EQ(scene.builds().pairings, 3u) << "one per iteration shown";
    options.local.point_size_px = 5;
    options.local.color = BLUE;
    scene.set_options(options);
    card.render_RGB(*content, frame);
    EXPECT_EQ(scene.builds().cloud_uploads, 3u) << "another colour costs one cloud, another size nothing";
}
