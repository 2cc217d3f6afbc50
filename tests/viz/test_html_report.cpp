#include <gtest/gtest.h>
#include <mp2p_icp/alignment_snapshot.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/html_report.h>
#include <mp2p_icp/se3.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "html_report_tools.h"
#include "log_test_tools.h"
#include "picture_checks.h"
#include "test_data.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mrpt::math::TPoint3D;
using mrpt::poses::CPose3D;

namespace
{
const CPose3D TRUTH(0.15, -0.1, 0.05, 0.08, -0.05, 0.04);

std::vector<TPoint3D> seen_from(const CPose3D& pose, const std::vector<TPoint3D>& points)
{
    std::vector<TPoint3D> seen;
    for (const auto& p : points) seen.push_back(pose.inverseComposePoint(p));
    return seen;
}

LogRecord run_on_wavy_surface(size_t count = 400)
{
    const auto points = wavy_points(count, 1);
    return logged_run(map_of(points), map_of(seen_from(TRUTH, points)), {});
}

LogRecord log_of(const metric_map_t& global, const metric_map_t& local)
{
    LogRecord log;
    log.pcGlobal = std::make_shared<metric_map_t>(global);
    log.pcLocal = std::make_shared<metric_map_t>(local);
    log.icpResult.verdict = Verdict::aligned;
    return log;
}

/// A pose of the page: rows of (R t).
TPoint3D moved(const mrpt::containers::yaml& pose, const TPoint3D& p)
{
    const auto row = [&](int r)
    {
        const auto at = [&](int c) { return pose(4 * r + c).as<double>(); };
        return at(0) * p.x + at(1) * p.y + at(2) * p.z + at(3);
    };
    return {row(0), row(1), row(2)};
}

/// Are all tags of the page closed, in the right order? What scripts and styles hold is none.
void expect_balanced(const std::string& page)
{
    const std::vector<std::string> alone = {"meta", "link", "br", "img", "input", "!DOCTYPE"};
    std::vector<std::string> open;
    for (size_t at = page.find('<'); at != std::string::npos; at = page.find('<', at))
    {
        const size_t end = page.find('>', at);
        ASSERT_NE(end, std::string::npos);
        std::string tag = page.substr(at + 1, end - at - 1);
        const bool closed = tag.back() == '/', closing = tag[0] == '/';
        const std::string name = tag.substr(closing, tag.find_first_of(" \n/", 1) - closing);
        at = end;
        if (closed || std::find(alone.begin(), alone.end(), name) != alone.end()) continue;
        if (!closing)
        {
            open.push_back(name);
            if (name == "script" || name == "style") at = page.find("</" + name, at);
            continue;
        }
        ASSERT_FALSE(open.empty()) << "closed without need: " << name;
        ASSERT_EQ(open.back(), name) << "near " << page.substr(end > 200 ? end - 200 : 0, 200);
        open.pop_back();
    }
    EXPECT_TRUE(open.empty());
}

/// It holds nothing that is loaded from elsewhere, and no number that JSON or SVG does not know.
void expect_sound(const std::string& page)
{
    expect_balanced(page);
    for (const char* outside : {"http:", "https:", "@import", "url(", "fetch(", "XMLHttpRequest", "src=\"/"})
        EXPECT_FALSE(has(page, outside)) << outside;
    for (auto at = page.find("src=\""); at != std::string::npos; at = page.find("src=\"", at + 1))
        EXPECT_EQ(page.compare(at, 10, "src=\"data:"), 0);
    for (const char* none : {"\".nan", ":.nan", ".inf", "=\"nan", "=\"inf", "NaN,", ",nan", "\"–\"", "∞\""})
        EXPECT_FALSE(has(page, none)) << none;
    EXPECT_TRUE(scene_of(page).isMap());
}

std::vector<TPoint3D> expected_points(const metric_map_t& map)
{
    std::vector<TPoint3D> out;
    const auto cloud = map.point_layer(metric_map_t::PT_LAYER_RAW);
    for (size_t i = 0; i < cloud->size(); i++)
    {
        TPoint3D p;
        cloud->getPoint(i, p.x, p.y, p.z);
        out.push_back(p);
    }
    return out;
}
}  // namespace

TEST(html_report, its_points_and_poses_are_those_of_the_log_wherever_they_are)
{
    for (const TPoint3D& offset : {TPoint3D(0, 0, 0), TPoint3D(4.5e6, -3e5, 200)})
    {
        const auto points = wavy_points(300, 2);
        metric_map_t global = map_of(points), local = map_of(seen_from(TRUTH, points));
        global.set_coordinate_offset(offset), local.set_coordinate_offset(offset * 0.5);
        // The guess is where both offsets make the stored maps meet.
        const LogRecord log =
            logged_run(global, local, mrpt::math::TPose3D(offset.x / 2, offset.y / 2, offset.z / 2, 0, 0, 0));
        ASSERT_EQ(log.icpResult.verdict, Verdict::aligned);
        const std::string page = html_report(log);
        expect_sound(page);
        const auto scene = scene_of(page);
        const TPoint3D centre = point_of(scene["centre"]);
        const auto& layer = scene["layers"](0)(0);
        EXPECT_EQ(layer["side"].as<std::string>(), "global");
        EXPECT_EQ(layer["of"].as<int>(), 300);
        const auto drawn = decoded_points(layer["points"].as<std::string>());
        const auto all = expected_points(global);
        ASSERT_EQ(drawn.size(), all.size());
        // Stored and drawn as float within 4 m of the centre: 2^-22 m each; millions of metres as double:
        // 1e-9.
        for (size_t i = 0; i < all.size(); i++)
            EXPECT_LT((drawn[i] + centre - (all[i] + offset)).norm(), 1e-6);

        const auto local_drawn = decoded_points(scene["layers"](1)(0)["points"].as<std::string>());
        const auto local_all = expected_points(local);
        const auto& states = scene["states"];
        ASSERT_EQ(states.size(), log.iterationsDetails->size() + 2);
        const auto expect_at = [&](const mrpt::containers::yaml& state, const CPose3D& pose)
        {
            for (size_t i = 0; i < local_all.size(); i++)
                EXPECT_LT((moved(state["pose"], local_drawn[i]) + centre -
                           pose.composePoint(local_all[i] + offset * 0.5))
                              .norm(),
                          2e-6);
        };
        expect_at(states(0), CPose3D(log.initialGuessLocalWrtGlobal));
        EXPECT_EQ(states(0)["label"].as<std::string>(), "guess");
        const int last = static_cast<int>(states.size()) - 1;
        expect_at(states(last), log.icpResult.optimal_tf.mean);
        EXPECT_EQ(states(last)["label"].as<std::string>(), "result");
        // The pose of the last iteration is the result.
        expect_at(states(last - 1), log.icpResult.optimal_tf.mean);
        EXPECT_EQ(states(last - 1)["label"].as<std::string>(), "iteration " + std::to_string(last - 2));
        EXPECT_EQ(states(last - 1)["iteration"].as<int>(), last - 2);
    }
}

TEST(html_report, residuals_join_the_paired_points)
{
    const LogRecord log = run_on_wavy_surface();
    const auto scene = scene_of(html_report(log));
    const TPoint3D centre = point_of(scene["centre"]);
    const auto& details = log.iterationsDetails->at(1);
    const auto& drawn = scene["states"](2)["pairings"]["pt2pt"];
    EXPECT_EQ(drawn["of"].as<size_t>(), details.pairings.paired_pt2pt.size());
    const auto ends = decoded_points(drawn["residuals"].as<std::string>());
    ASSERT_EQ(ends.size(), 2 * drawn["drawn"].as<size_t>());
    ASSERT_GT(ends.size(), 100u);
    for (size_t i = 0; i < ends.size(); i += 2)
    {
        const auto& pairs = details.pairings.paired_pt2pt;
        const bool found = std::any_of(pairs.begin(), pairs.end(),
                                       [&](const auto& pair)
                                       {
                                           const auto local = details.optimalPose.composePoint(pair.local);
                                           return (pair.global - centre - ends[i]).norm() < 1e-6 &&
                                                  (local - centre - ends[i + 1]).norm() < 1e-6;
                                       });
        EXPECT_TRUE(found);
    }
}

TEST(html_report, whatever_texts_hold_they_stay_texts)
{
    const std::string evil = "</script><script>alert(\"1\")</script> & 'x' <!-- \\ \x01 \xFF ü";
    const std::string sound = "</script><script>alert(\"1\")</script> & 'x' <!-- \\ \x01 \xEF\xBF\xBD ü";
    metric_map_t global = map_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    global.label = evil;
    global.layers[evil] = global.layers.begin()->second;
    LogRecord log = log_of(global, global);
    log.icpResult.verdict_reason = evil;
    HtmlReportOptions options;
    options.title = evil;
    mrpt::img::CImage image(20, 10, mrpt::img::CH_RGB);
    options.pictures.push_back({evil, image});
    const std::string page = html_report(log, options);
    expect_sound(page);
    EXPECT_EQ(occurrences(page, "<script"), 2u);
    EXPECT_EQ(occurrences(page, "</script"), 2u);
    EXPECT_FALSE(has(page, "<!--"));
    EXPECT_FALSE(has(page, "alert(\"1\")"));
    EXPECT_GE(occurrences(page, "&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt; &amp; &#39;x&#39;"), 5u);
    bool found = false;
    const auto scene = scene_of(page);
    for (int i = 0; i < 2; i++) found = found || scene["layers"](0)(i)["layer"].as<std::string>() == sound;
    EXPECT_TRUE(found);
}

TEST(html_report, of_large_clouds_shows_a_part_and_says_so)
{
    metric_map_t global = map_of(wavy_points(5000, 3));
    global.layers["few"] = map_of(wavy_points(50, 4)).layers.begin()->second;
    LogRecord log = log_of(global, map_of(wavy_points(300, 5)));
    HtmlReportOptions options;
    options.max_points_per_cloud = 1000;
    const std::string page = html_report(log, options);
    EXPECT_TRUE(has(page,
                    "a random 1\xE2\x80\xAF"
                    "000 of 5\xE2\x80\xAF"
                    "050 points"));
    const auto scene = scene_of(page);
    const TPoint3D centre = point_of(scene["centre"]);
    std::map<std::string, std::pair<int, int>> shares;
    for (int i = 0; i < 2; i++)
    {
        const auto& layer = scene["layers"](0)(i);
        shares[layer["layer"].as<std::string>()] = {layer["drawn"].as<int>(), layer["of"].as<int>()};
    }
    EXPECT_EQ(shares["few"], (std::pair<int, int>(50, 50)));
    EXPECT_EQ(shares["raw"], (std::pair<int, int>(950, 5000)));
    EXPECT_EQ(html_report(log, options), page) << "the same log must make the same page";

    const auto all = expected_points(global);
    const auto& raw = scene["layers"](0)(1);
    ASSERT_EQ(raw["layer"].as<std::string>(), "raw");
    for (const auto& p : decoded_points(raw["points"].as<std::string>()))
        EXPECT_TRUE(std::any_of(all.begin(), all.end(),
                                [&](const TPoint3D& q) { return (p + centre - q).norm() < 1e-6; }));
}

TEST(html_report, stays_below_three_megabytes)
{
    const metric_map_t map = map_of(wavy_points(200000, 6));
    LogRecord log = log_of(map, map);
    Pairings many;
    for (const auto& p : wavy_points(20000, 7))
        many.paired_pt2pl.push_back({{mrpt::math::TPlane(p, {0, 0, 1}), p}, p + TPoint3D(0, 0, 0.1)});
    for (size_t i = 0; i < 60; i++)
        (*(log.iterationsDetails ? log.iterationsDetails : log.iterationsDetails.emplace()))[i].pairings =
            many;
    log.icpResult.finalPairings = many;
    EXPECT_LT(html_report(log).size(), 3000000u);
}

TEST(html_report, tells_the_verdict_the_poses_and_the_curves)
{
    const LogRecord log = run_on_wavy_surface();
    const std::string page = html_report(log);
    expect_sound(page);
    EXPECT_TRUE(has(page, "class=\"verdict good\""));
    EXPECT_TRUE(has(page, "aligned</b>"));
    EXPECT_TRUE(has(page, log.icpResult.verdict_reason));
    EXPECT_TRUE(has(page, "<td>0.1500</td><td>-0.1000</td><td>0.0500</td>"));
    EXPECT_TRUE(has(page, "Stalled: converged"));
    EXPECT_TRUE(has(page, "400 pt2pt of 400 possible"));
    EXPECT_TRUE(has(page, "maxIterations: 100"));
    EXPECT_EQ(occurrences(page, "<svg "), 5u);
    EXPECT_FALSE(has(page, "nothing was logged"));
    const std::string pairings_plot = between(page, "aria-label=\"Number of pairings\"", "</svg>");
    EXPECT_EQ(occurrences(pairings_plot, "<circle"), log.iterationsDetails->size());
    // Bars, and what is said to be beyond them, are as many as pairings.
    size_t bars = static_cast<size_t>(std::stoi("0" + between(page, "distance, mm; ", " more are farther")));
    const std::string histogram = between(page, "aria-label=\"Residuals of the final pairings\"", "</svg>");
    for (auto at = histogram.find(": "); at != std::string::npos; at = histogram.find(": ", at + 1))
        bars += static_cast<size_t>(std::stoi(histogram.substr(at + 2)));
    EXPECT_EQ(bars, 400u);
}

TEST(html_report, of_a_rejected_run_shows_where_it_ended)
{
    LogRecord log = run_on_wavy_surface();
    log.icpResult.rejected_pose = log.icpResult.optimal_tf.mean;
    log.icpResult.optimal_tf.mean = CPose3D();
    log.icpResult.verdict = Verdict::worse_than_guess;
    log.icpResult.optimal_tf.cov.setZero();
    log.icpResult.optimal_tf.cov(0, 0) = std::numeric_limits<double>::infinity();
    const std::string page = html_report(log);
    expect_sound(page);
    EXPECT_TRUE(has(page, "class=\"verdict bad\""));
    EXPECT_TRUE(has(page, "rejected pose</th><td>0.1500</td>"));
    EXPECT_TRUE(has(page, "<td>± ∞</td>"));
    const auto scene = scene_of(page);
    const int last = static_cast<int>(scene["states"].size()) - 1;
    EXPECT_EQ(scene["states"](last)["label"].as<std::string>(), "rejected pose");
    EXPECT_NEAR(scene["states"](last)["pose"](1).as<double>(), rotation_of(TRUTH)(0, 1), 1e-6);
}

TEST(html_report, free_motions_are_arrows_along_their_axes)
{
    LogRecord log = run_on_wavy_surface();
    log.icpResult.verdict = Verdict::under_constrained;
    FreeTwist slide, turn;
    slide.axis = {1, 0, 0}, slide.name = "x";
    turn.kind = FreeTwist::Kind::Rotation, turn.axis = {0, 0, 1}, turn.through = {0.5, 0.7, -3};
    turn.name = "yaw", turn.sigma = std::numeric_limits<double>::infinity();
    log.icpResult.unobservable = {slide, turn, slide};
    log.icpResult.unobservable[2].axis = {NAN, 0, 0};
    const std::string page = html_report(log);
    expect_sound(page);
    EXPECT_TRUE(has(page, "translation x, axis (1.000, 0.000, 0.000)"));
    EXPECT_TRUE(has(page, "known to ± ∞"));
    const auto scene = scene_of(page);
    const auto& arrows = scene["arrows"];
    ASSERT_EQ(arrows.size(), 2u) << "one is not finite";
    EXPECT_EQ(arrows(0)["label"].as<std::string>(), "free: translation x");
    const auto shaft = decoded_points(arrows(0)["segments"].as<std::string>());
    EXPECT_GT(std::abs(shaft[1].x), 0.3);
    EXPECT_NEAR(shaft[1].y, 0, 1e-6);
    EXPECT_NEAR(shaft[1].z, 0, 1e-6);
    const auto axis = decoded_points(arrows(1)["segments"].as<std::string>());
    const TPoint3D centre = point_of(scene["centre"]), at = point_of(arrows(1)["at"]);
    for (const auto& end : {axis[0], axis[1]})
    {
        EXPECT_NEAR((end + at + centre).x, 0.5, 1e-5);
        EXPECT_NEAR((end + at + centre).y, 0.7, 1e-5);
    }
    EXPECT_GT(axis[1].z - axis[0].z, 0.6);
}

TEST(html_report, planes_and_lines_are_drawn_as_far_as_they_were_seen)
{
    metric_map_t map = map_of(wavy_points(100, 8));
    plane_fit_t fit;
    fit.u_min = -1, fit.u_max = 2, fit.v_min = -3, fit.v_max = 4;
    map.planes.push_back({plane_patch_t(mrpt::math::TPlane({5, 6, 7}, {0, 0, 1}), {5, 6, 7}), fit});
    mrpt::math::TLine3D line;
    line.pBase = {1, 2, 3}, line.director = {0, 1, 0};
    line_fit_t line_fit;
    line_fit.begin = -0.5, line_fit.end = 2;
    map.lines.push_back({line, line_fit});
    const std::string page = html_report(log_of(map, map_of(wavy_points(100, 9))));
    expect_sound(page);
    const auto scene = scene_of(page);
    const TPoint3D centre = point_of(scene["centre"]);
    const auto& shapes = scene["shapes"](0);
    ASSERT_EQ(shapes.size(), 2u);
    const auto corners = decoded_points(shapes(0)["segments"].as<std::string>());
    ASSERT_EQ(corners.size(), 8u);
    const TPoint3D expected[] = {{4, 3, 7}, {7, 3, 7}, {7, 10, 7}, {4, 10, 7}};
    for (size_t i = 0; i < 4; i++) EXPECT_LT((corners[2 * i] + centre - expected[i]).norm(), 1e-5);
    const auto ends = decoded_points(shapes(1)["segments"].as<std::string>());
    ASSERT_EQ(ends.size(), 2u);
    EXPECT_LT((ends[0] + centre - TPoint3D(1, 1.5, 3)).norm(), 1e-5);
    EXPECT_LT((ends[1] + centre - TPoint3D(1, 4, 3)).norm(), 1e-5);
}

TEST(html_report, pictures_are_in_it)
{
    HtmlReportOptions options;
    mrpt::img::CImage image(40, 30, mrpt::img::CH_RGB);
    image.filledRectangle(0, 0, 40, 30, WHITE);
    image.filledRectangle(10, 10, 19, 19, RED);
    options.pictures = {{"first", image}, {"second", image}};
    const std::string page = html_report(run_on_wavy_surface(), options);
    expect_sound(page);
    EXPECT_TRUE(has(page, "<figcaption>second</figcaption>"));
    const std::string path = temp_path(".png");
    std::ofstream(path, std::ios::binary)
        << decoded_base64(between(page, "src=\"data:image/png;base64,", "\""));
    mrpt::img::CImage back;
    ASSERT_TRUE(back.loadFromFile(path));
    std::filesystem::remove(path);
    ASSERT_EQ(back.getWidth(), 40u);
    EXPECT_EQ(count(back, RED), 100u);

    options.pictures.push_back({"none", {}});
    EXPECT_THROW(html_report(run_on_wavy_surface(), options), std::invalid_argument);
}

TEST(html_report, hard_inputs_make_a_page_too)
{
    constexpr double INF = std::numeric_limits<double>::infinity();
    const metric_map_t one = map_of({{1, 2, 3}}), far = map_of({{1e8, 1e8, 0}, {1e8, 1e8 + 80, 0}}),
                       damaged = map_of({{NAN, 0, 0}, {1, INF, 0}, {0, 0, 1}, {3e38, -3e38, 0}});
    expect_sound(html_report(LogRecord()));
    for (const auto& global : {metric_map_t(), one, far, damaged})
        for (const auto& local : {metric_map_t(), one, far, damaged})
            for (const CPose3D& pose :
                 {CPose3D(), CPose3D(NAN, 0, 0, 0, 0, 0), CPose3D(1e300, 1e308, INF, 0, 0, 0)})
            {
                LogRecord log = log_of(global, local);
                log.initialGuessLocalWrtGlobal = pose.asTPose();
                log.icpResult.optimal_tf.mean = pose;
                log.icpResult.optimal_tf.cov.setConstant(NAN);
                log.icpResult.quality = NAN, log.icpResult.residual_rms = INF;
                log.icpResult.cost_at_guess = NAN;
                log.iterationsDetails.emplace();
                (*log.iterationsDetails)[0].optimalPose = pose;
                log.icpResult.finalPairings.paired_pt2pt.push_back(
                    mrpt::tfest::TMatchingPair_d(0, 0, {NAN, 0, 0}, {1e300, 0, 0}));
                (*log.iterationsDetails)[0].pairings = log.icpResult.finalPairings;
                log.icpResult.unobservable.emplace_back();
                expect_sound(html_report(log));
            }

    const auto scene = scene_of(html_report(log_of(far, far)));
    const auto points = decoded_points(scene["layers"](0)(0)["points"].as<std::string>());
    ASSERT_EQ(points.size(), 2u);
    EXPECT_EQ((points[1] - points[0]).y, 80) << "as the float cloud has it";
}

TEST(save_html_report, writes_the_page_or_says_why_not)
{
    const LogRecord log = run_on_wavy_surface();
    const std::string path = temp_path(".html");
    save_html_report(log, path);
    std::stringstream content;
    content << std::ifstream(path, std::ios::binary).rdbuf();
    EXPECT_EQ(content.str(), html_report(log));
    std::filesystem::remove(path);
    EXPECT_THROW(save_html_report(log, "/nonexistent/report.html"), DataError);
}
