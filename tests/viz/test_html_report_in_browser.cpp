#include <gtest/gtest.h>
#include <mp2p_icp/html_report.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/ortho_view.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "browser.h"
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
const char* DRIVER =
#include "report_driver.js.inc"
    ;

// Few points, far enough from each other to be told apart in the picture.
const std::vector<TPoint3D> GLOBAL = {{0, 0, 0}, {4, 0, 0.3}, {0, 3, 0.6}, {4, 3, 1.5}, {2, 1, 2}};
const std::vector<TPoint3D> LOCAL = {{1, 1, 0}, {3, 0.5, 1}, {1, 2.5, 1.2}};
const CPose3D GUESS(0.3, 0.5, 0, 0.3, 0, 0), AT_ITERATION(0.1, 0.2, 0.1, 0.15, 0.05, 0),
    RESULT(0, 0, 0.1, 0.05, 0, 0.1);
const TPoint3D OFFSET(4.5e6, -3e5, 200);

LogRecord made_log()
{
    metric_map_t global = map_of(GLOBAL), local = map_of(LOCAL);
    global.set_coordinate_offset(OFFSET);
    LogRecord log;
    log.pcGlobal = std::make_shared<metric_map_t>(global),
    log.pcLocal = std::make_shared<metric_map_t>(local);
    log.initialGuessLocalWrtGlobal = (CPose3D(OFFSET) + GUESS).asTPose();
    log.icpResult.verdict = Verdict::under_constrained;
    log.icpResult.optimal_tf.mean = CPose3D(OFFSET) + RESULT;
    FreeTwist twist;
    twist.axis = {1, 0, 0}, twist.name = "x";
    log.icpResult.unobservable = {twist};
    auto& details = log.iterationsDetails.emplace()[0];
    details.optimalPose = AT_ITERATION;
    for (uint32_t i = 0; i < LOCAL.size(); i++)
        details.pairings.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(i, i, GLOBAL[i], LOCAL[i]));
    log.iterations.emplace_back().pose = details.optimalPose;
    return log;
}

std::string saved(const std::string& content, const std::string& suffix)
{
    const std::string path = temp_path(suffix);
    std::ofstream(path, std::ios::binary) << content;
    return path;
}

/// A list of [right, up] of the points in the view, in metres from its focus.
std::string probes_json(const OrthoView& view, const std::vector<TPoint3D>& points)
{
    std::string out;
    const auto dot = [](const TPoint3D& a, const TPoint3D& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
    for (const auto& p : points)
        out += (out.empty() ? "[" : ",[") + to_text(dot(view.right(), p - view.focus)) + "," +
               to_text(dot(view.up(), p - view.focus)) + "]";
    return "[" + out + "]";
}

std::vector<TPoint3D> moved(const CPose3D& pose, const std::vector<TPoint3D>& points)
{
    std::vector<TPoint3D> out;
    for (const auto& p : points) out.push_back(pose.composePoint(p));
    return out;
}

/// The page that drives the report, and looks for points where the library's own view says that they are.
std::string driver_page(const std::string& report)
{
    const auto scene = scene_of(report);
    OrthoView view;
    view.azimuth_deg = scene["view"]["azimuth"].as<double>();
    view.elevation_deg = scene["view"]["elevation"].as<double>();
    view.height = scene["view"]["height"].as<double>();
    view.focus = point_of(scene["view"]["focus"]) + point_of(scene["centre"]) - OFFSET;
    OrthoView top = view;
    top.azimuth_deg = -90, top.elevation_deg = 90;
    const auto both = [](std::vector<TPoint3D> points, const std::vector<TPoint3D>& more)
    {
        points.insert(points.end(), more.begin(), more.end());
        return points;
    };
    const auto as_json = [](const std::string& text)
    {
        std::string out;
        for (const char c : text) switch (c)
            {
                case '\n':
                    out += "\\n";
                    break;
                case '"':
                    out += "\\\"";
                    break;
                case '\\':
                    out += "\\\\";
                    break;
                case '<':
                    out += "\\u003c";
                    break;
                default:
                    out += c;
            }
        return '"' + out + '"';
    };
    return "<!DOCTYPE html><html><head><meta charset=\"utf-8\"></head><body><pre id=\"said\"></pre><script>\n"
           "const report = " +
           as_json(report) + ";\nconst height = " + to_text(view.height) +
           ";\nconst probes = {result: " + probes_json(view, both(GLOBAL, moved(RESULT, LOCAL))) +
           ", top: " + probes_json(top, both(GLOBAL, moved(RESULT, LOCAL))) +
           ", guess: " + probes_json(view, moved(GUESS, LOCAL)) +
           ", iteration: " + probes_json(view, moved(AT_ITERATION, LOCAL)) + "};\n" + DRIVER +
           "</script></body></html>";
}

/// Lines `name=value`.
std::map<std::string, std::string> said(const std::string& page)
{
    std::map<std::string, std::string> out;
    std::stringstream lines(between(page, "<pre id=\"said\">", "</pre>"));
    for (std::string line; std::getline(lines, line);)
        if (const auto at = line.find('='); at != std::string::npos)
            out[line.substr(0, at)] = line.substr(at + 1);
    return out;
}
}  // namespace

TEST(html_report_in_browser, opens_from_a_file_without_errors_and_shows_both_clouds)
{
    MP2P_ICP_SKIP_WITHOUT_BROWSER();
    const auto points = wavy_points(3000, 1);
    const CPose3D truth(0.15, -0.1, 0.05, 0.08, -0.05, 0.04);
    std::vector<TPoint3D> seen;
    for (const auto& p : points) seen.push_back(truth.inverseComposePoint(p));
    const auto log = logged_run(map_of(points), map_of(seen), {});
    HtmlReportOptions options;
    const std::string path = saved(html_report(log, options), ".html"), picture_path = temp_path(".png");
    const auto run = open_in_browser(path, picture_path);
    EXPECT_EQ(run.console, "");
    mrpt::img::CImage picture;
    ASSERT_TRUE(picture.loadFromFile(picture_path));
    EXPECT_EQ(picture.getWidth(), 1000u);
    size_t blue = 0, orange = 0;
    for (int y = 0; y < static_cast<int>(picture.getHeight()); y++)
        for (int x = 0; x < static_cast<int>(picture.getWidth()); x++)
        {
            const auto c = color_at(picture, x, y);
            blue += c.B > c.R + 50, orange += c.R > c.B + 50;
        }
    // A point has some four pixels; both clouds cover each other in part.
    EXPECT_GT(orange, 3000u);
    EXPECT_GT(blue, 300u);
    std::filesystem::remove(path), std::filesystem::remove(picture_path);
}

TEST(html_report_in_browser, turns_when_dragged_and_draws_points_where_they_are)
{
    MP2P_ICP_SKIP_WITHOUT_BROWSER();
    const std::string path = saved(driver_page(html_report(made_log())), ".html");
    const auto run = open_in_browser(path, "", 20000);
    std::filesystem::remove(path);
    EXPECT_EQ(run.console, "");
    auto seen = said(run.page);
    ASSERT_FALSE(seen.empty()) << run.page.substr(0, 500);
    EXPECT_EQ(seen["finished"], "true") << between(run.page, "<pre id=\"said\">", "</pre>");
    EXPECT_EQ(seen["blank"], "false");
    for (const char* changed :
         {"turned by a drag", "turned by a finger", "moved by a shifted drag", "zoomed by the wheel",
          "zoomed by two fingers", "turned by a key", "differs at the guess", "pairings seen", "arrows seen"})
        EXPECT_EQ(seen[changed], "true") << changed;
    for (const char* same : {"differs after reset", "differs in the end", "differs back at the end"})
        EXPECT_EQ(seen[same], "false") << same;
    for (size_t i = 0; i < GLOBAL.size() + LOCAL.size(); i++)
        for (const char* view : {"result ", "top "})
            EXPECT_EQ(seen[view + std::to_string(i)], i < GLOBAL.size() ? "blue" : "orange") << view << i;
    for (size_t i = 0; i < LOCAL.size(); i++)
        for (const char* state : {"guess ", "iteration "})
            EXPECT_EQ(seen[state + std::to_string(i)], "orange") << state << i;
    EXPECT_EQ(seen["label at the guess"], "guess");
    EXPECT_EQ(seen["label at 1"], "iteration 0");
    EXPECT_EQ(seen["mark shown"], "inline");
    EXPECT_EQ(seen["blue without global"], "0");
    EXPECT_EQ(seen["orange without both"], "0");
}

TEST(html_report_in_browser, empty_and_damaged_logs_make_no_errors)
{
    MP2P_ICP_SKIP_WITHOUT_BROWSER();
    LogRecord damaged = made_log();
    damaged.pcGlobal = std::make_shared<metric_map_t>(map_of({{3e38, -3e38, 0}, {NAN, 0, 0}, {1, 2, 3}}));
    damaged.icpResult.optimal_tf.mean = CPose3D(1e300, NAN, 0, 0, 0, 0);
    for (const auto& log : {LogRecord(), damaged})
    {
        const std::string path = saved(html_report(log), ".html");
        const auto run = open_in_browser(path);
        EXPECT_EQ(run.console, "");
        EXPECT_TRUE(has(run.page, "id=\"toggles\""));
        std::filesystem::remove(path);
    }
}

TEST(html_report_in_browser, errors_of_a_page_would_be_seen)
{
    MP2P_ICP_SKIP_WITHOUT_BROWSER();
    const std::string path = saved("<script>nothing.of_this.exists();</script>", ".html");
    EXPECT_TRUE(has(open_in_browser(path).console, "nothing is not defined"));
    std::filesystem::remove(path);
}
