#include <mp2p_icp/log_snapshot.h>
#include <mrpt/img/CImage.h>

#include "log_browser.h"
#include "log_text.h"
#include "viewer_model.h"
#include "viewer_state.h"
#include "viewer_tools.h"

using namespace mp2p_icp_apps;
using namespace mp2p_icp_test;

namespace
{
const std::string FAR_GUESS = "[100 0 0 0 0 0]";  // no overlap there

mrpt::img::CImage picture(const std::string& path)
{
    mrpt::img::CImage image;
    EXPECT_TRUE(image.loadFromFile(path)) << path;
    return image;
}

size_t differing_pixels(const mrpt::img::CImage& a, const mrpt::img::CImage& b)
{
    EXPECT_EQ(a.getWidth(), b.getWidth());
    EXPECT_EQ(a.getHeight(), b.getHeight());
    size_t count = 0;
    for (unsigned y = 0; y < a.getHeight(); y++)
        for (unsigned x = 0; x < a.getWidth(); x++)
            count += !std::equal(a.ptr<uint8_t>(x, y), a.ptr<uint8_t>(x, y) + 3, b.ptr<uint8_t>(x, y));
    return count;
}

void expect_trouble(const std::vector<std::string>& arguments, const std::vector<std::string>& words)
{
    const auto o = view(arguments);
    EXPECT_EQ(o.code, 1);
    EXPECT_EQ(o.err.rfind("icp-log-viewer: ", 0), 0u) << o.err;
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
    for (const auto& word : words) EXPECT_TRUE(contains(o.err, word)) << word << " is missing in " << o.err;
}
}  // namespace

TEST(icp_log_viewer, writes_pictures_of_the_moments_of_a_log)
{
    const Folder folder;
    const auto log = logged_run(folder, "run");
    const auto at = [&](const std::string& iteration)
    {
        const auto path = folder.path(iteration + ".png");
        const auto o = view({log, "--snapshot", path, "--iteration", iteration, "--size", "400x300"});
        EXPECT_EQ(o.code, 0) << o.err;
        EXPECT_EQ(o.out, "Written: " + path + "\n");
        return picture(path);
    };
    const auto guess = at("guess"), first = at("0"), last = at("final"), all = at("all");
    EXPECT_EQ(last.getWidth(), 400u);
    EXPECT_EQ(last.getHeight(), 300u);
    EXPECT_GT(differing_pixels(guess, last), differing_pixels(first, last))
        << "one iteration is a step there";
    EXPECT_GT(differing_pixels(first, last), 100u);
    EXPECT_GT(differing_pixels(all, last), 1000u);

    const auto top = folder.path("top.png"), plain = folder.path("plain.png");
    EXPECT_EQ(view({log, "--snapshot", plain, "--size", "400x300"}).code, 0);
    EXPECT_EQ(differing_pixels(picture(plain), last), 0u) << "final is the default";
    EXPECT_EQ(view({log, "--snapshot", top, "--view", "top", "--size", "400x300"}).code, 0);
    EXPECT_GT(differing_pixels(picture(top), last), 100u);
    EXPECT_EQ(view({log, "--snapshot", top, "--color", "residual", "--size", "400x300"}).code, 0);
    EXPECT_GT(differing_pixels(picture(top), last), 100u);
}

TEST(icp_log_viewer, writes_a_picture_per_iteration_into_a_folder)
{
    const Folder folder;
    const auto log = logged_run(folder, "run");
    const auto moments = log_moments(*load_log(log));
    ASSERT_GT(moments.size(), 4u);
    const auto o = view({log, "--snapshot-dir", folder.path("new/pictures"), "--size", "200x200"});
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(static_cast<size_t>(std::count(o.out.begin(), o.out.end(), '\n')), moments.size());
    const auto guess = picture(folder.path("new/pictures/0000-guess.png")),
               first = picture(folder.path("new/pictures/0001-iteration-000.png"));
    EXPECT_GT(differing_pixels(guess, first), 50u);
}

TEST(icp_log_viewer, writes_a_page)
{
    const Folder folder;
    const auto log = logged_run(folder, "run"), html = folder.path("run.html");
    const auto o = view({log, "--html", html, "--size", "200x200"});
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.out, "Written: " + html + "\n");
    const auto page = content_of(html);
    EXPECT_TRUE(contains(page, "run.icplog"));
    for (const auto& moment : mp2p_icp::some_moments(log_moments(*load_log(log)), 12))
        EXPECT_TRUE(contains(page, to_string(moment))) << to_string(moment);
}

TEST(icp_log_viewer, several_logs_give_several_pictures_of_those_that_are_asked_for)
{
    const Folder folder;
    logged_run(folder, "good");
    logged_run(folder, "bad", FAR_GUESS);
    const std::vector<std::string> base{folder.path(""), "--snapshot", folder.path("p.png"), "--size",
                                        "200x200"};
    EXPECT_EQ(view(base).out,
              "Written: " + folder.path("p-bad.png") + "\nWritten: " + folder.path("p-good.png") + "\n");
    auto bad = base, none = base;
    bad.insert(bad.end(), {"--verdict", "no_overlap"});
    EXPECT_EQ(view(bad).out, "Written: " + folder.path("p.png") + "\n");
    none.insert(none.end(), {"--verdict", "diverged"});
    expect_trouble(none, {"no log has the verdict"});
}

TEST(icp_log_viewer, shows_maps)
{
    const Folder folder;
    mp2p_icp::metric_map_t map;
    map.layers["a"] = mrpt::maps::CSimplePointsMap::Create(points_of_room(300));
    map.layers["b"] = mrpt::maps::CSimplePointsMap::Create(points_of_room(20));
    map.planes.emplace_back(mrpt::math::TPlane(0, 0, 1, 0), mrpt::math::TPoint3D(0, 0, 0));
    const auto mm = folder.path("map.mm"), all = folder.path("all.png"), some = folder.path("some.png");
    mp2p_icp::save_map(map, mm);
    const auto o = view({mm, "--snapshot", all, "--size", "300x300"});
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(view({mm, "--snapshot", some, "--size", "300x300", "--hide", "a", "planes"}).code, 0);
    EXPECT_GT(differing_pixels(picture(all), picture(some)), 300u);
    expect_trouble({mm, "--snapshot-dir", folder.path("x")}, {"a map has no iterations"});
    expect_trouble({mm, "--html", folder.path("x.html")}, {"not of a map"});
}

TEST(icp_log_viewer, says_what_is_wrong)
{
    const Folder folder;
    const auto log = logged_run(folder, "run"), png = folder.path("x.png");
    expect_trouble({}, {"a log, a folder of logs or a map is required"});
    expect_trouble({folder.path("none.icplog"), "--snapshot", png}, {"none.icplog"});
    std::filesystem::create_directory(folder.path("empty"));
    expect_trouble({folder.path("empty"), "--snapshot", png}, {"empty", "no .icplog file"});
    expect_trouble({folder.text("bad.icplog", "not a log"), "--snapshot", png}, {"bad.icplog"});
    expect_trouble({log, "--snapshot", png, "--iteration", "999"},
                   {"iteration 999 was not logged", "0, 1, 2"});
    expect_trouble({log, "--snapshot", png, "--iteration", "rejected"}, {"no rejected pose"});
    expect_trouble({log, "--snapshot", png, "--size", "big"}, {"--size", "big"});
    expect_trouble({log, "--snapshot", png, "--size", "10x10"}, {"width", "10"});
    expect_trouble({log, "--snapshot", png, "--view", "front"}, {"--view", "front"});
    expect_trouble({log, "--snapshot", folder.path("no/such/x.png")}, {"no/such/x.png"});
    expect_trouble({log, "--snapshoot", png}, {"--snapshoot", "did you mean '--snapshot'?"});
    EXPECT_EQ(view({"--help"}).code, 0);
    EXPECT_TRUE(contains(view({"--help"}).out, "--snapshot-dir"));
}

TEST(icp_log_viewer, without_a_display_it_names_the_way_out)
{
    const Folder folder;
    const auto log = logged_run(folder, "run");
    for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"}) unsetenv(name);
    expect_trouble({log}, {"no display", "--snapshot"});
    setenv("DISPLAY", ":4711", 1);  // nobody there
    expect_trouble({log}, {"no display", "--snapshot"});
    unsetenv("DISPLAY");
}

TEST(LogBrowser, sorts_and_filters)
{
    const Folder folder;
    logged_run(folder, "b_good");
    logged_run(folder, "a_bad", FAR_GUESS);
    folder.text("c_damaged.icplog", "nothing");
    ViewerOptions options;
    LogBrowser browser({folder.path("")}, options);
    const auto names = [&]
    {
        std::string text;
        for (size_t i = 0; i < browser.size(); i++)
            text += std::filesystem::path(browser.at(i).path).stem().string() + " ";
        return text;
    };
    EXPECT_EQ(names(), "a_bad b_good c_damaged ");
    browser.go_to(1);
    browser.step(-100);
    EXPECT_EQ(browser.index(), 0u);
    browser.step(100);
    EXPECT_EQ(browser.index(), 2u);
    EXPECT_EQ(browser.read(2), nullptr);
    EXPECT_NE(browser.at(2).problem, "");

    browser.go_to(1);
    options.sort = "verdict";
    EXPECT_TRUE(browser.arrange(options));
    EXPECT_EQ(names(), "a_bad b_good c_damaged ") << "what cannot be trusted first, what cannot be read last";
    EXPECT_EQ(browser.index(), 1u) << "still the same log";
    options.min_quality = 0.5;
    EXPECT_TRUE(browser.arrange(options));
    EXPECT_EQ(names(), "b_good ");
    EXPECT_EQ(browser.index(), 0u);
    options.min_quality = 0, options.verdict = "diverged";
    EXPECT_FALSE(browser.arrange(options));
    EXPECT_EQ(names(), "b_good ") << "as it was";
    options.verdict = "", options.sort = "quality";
    EXPECT_TRUE(browser.arrange(options));
    EXPECT_EQ(names(), "a_bad b_good c_damaged ");
}

TEST(LogBrowser, looks_into_logs_bit_by_bit_and_remembers_those_that_are_damaged)
{
    const Folder folder;
    const auto good = logged_run(folder, "a");
    const auto bytes = content_of(good);
    folder.text("b.icplog", bytes.substr(0, bytes.size() / 2));  // its headline can be read
    folder.text("c.icplog", "nothing");
    ViewerOptions options;
    LogBrowser browser({folder.path("")}, options);
    EXPECT_EQ(browser.summarized(), 0u) << "the list by name needs no look";
    for (size_t looked = 1; looked <= 3; looked++)
    {
        EXPECT_EQ(browser.summarize(0), looked == 3) << "one at a time, when there is no time";
        EXPECT_EQ(browser.summarized(), looked);
    }
    EXPECT_TRUE(browser.summarize(0));
    options.sort = "quality";
    EXPECT_TRUE(browser.arrange(options));
    EXPECT_EQ(browser.at(0).quality, load_log(good)->icpResult.quality);
    EXPECT_EQ(browser.at(1).quality, browser.at(0).quality);
    EXPECT_NE(browser.at(2).problem, "");
    EXPECT_EQ(browser.at(1).problem, "");
    EXPECT_EQ(browser.read(1), nullptr);
    EXPECT_TRUE(browser.arrange(options));
    EXPECT_NE(browser.at(1).problem, "") << "not forgotten";
}

TEST(ViewerModel, sorts_in_parts_and_says_how_far_it_is)
{
    const Folder folder;
    logged_run(folder, "a_good");
    logged_run(folder, "b_bad", FAR_GUESS);
    ViewerOptions options;
    options.inputs = {folder.path("")};
    ViewerModel model(options, {});
    EXPECT_FALSE(model.arrange_some(0)) << "nothing was asked for";
    model.listing().sort = "verdict";
    model.arrange();
    EXPECT_TRUE(model.arrange_some(0));
    EXPECT_EQ(model.problem(), "looking into the logs: 1 of 2");
    while (model.arrange_some(0)) continue;
    EXPECT_EQ(model.problem(), "");
    EXPECT_TRUE(contains(model.browser()->at(0).path, "b_bad"));
    EXPECT_TRUE(contains(model.first().path(), "a_good")) << "still the same";
}

TEST(icp_log_viewer, draws_cubes_and_cuts_off)
{
    const Folder folder;
    const auto log = logged_run(folder, "run");
    const auto with = [&](const std::vector<std::string>& more)
    {
        const auto path = folder.path("p.png");
        std::vector<std::string> all{log, "--snapshot", path, "--size", "300x300"};
        all.insert(all.end(), more.begin(), more.end());
        const auto o = view(all);
        EXPECT_EQ(o.code, 0) << o.err;
        return picture(path);
    };
    const auto plain = with({});
    EXPECT_GT(differing_pixels(with({"--voxels", "0.3"}), plain), 500u);
    EXPECT_GT(differing_pixels(with({"--clip", "0", "100"}), plain), 100u);
    EXPECT_EQ(differing_pixels(with({"--clip", "1000", "1000"}), plain), 0u);
    expect_trouble({log, "--snapshot", folder.path("x.png"), "--voxels", "-1"}, {"--voxels"});
}

TEST(viewer_state, is_remembered)
{
    const Folder folder;
    const auto path = folder.path("config/icp-log-viewer.yaml");
    ViewerState state;
    state.width = 1000, state.height = 700, state.point_size = 4.5f, state.color = "residual";
    state.pairings = true, state.frames = false, state.orthographic = true, state.tab = 3;
    ASSERT_TRUE(save_viewer_state(state, path));
    const auto again = load_viewer_state(path);
    EXPECT_EQ(again.width, 1000);
    EXPECT_EQ(again.height, 700);
    EXPECT_EQ(again.point_size, 4.5f);
    EXPECT_EQ(again.color, "residual");
    EXPECT_TRUE(again.pairings && !again.frames && again.orthographic);
    EXPECT_EQ(again.tab, 3);
    for (const char* damaged : {"width: [", "just words", "width: -5\npoint_size: .nan\ncolor: pink\n", ""})
    {
        const auto defaults = load_viewer_state(folder.text("damaged.yaml", damaged));
        EXPECT_EQ(defaults.width, ViewerState().width) << damaged;
        EXPECT_EQ(defaults.point_size, ViewerState().point_size);
        EXPECT_EQ(defaults.color, "side");
    }
    EXPECT_FALSE(save_viewer_state(state, "/proc/no/such"));
}

TEST(log_text, tells_the_story)
{
    const Folder folder;
    const auto log = load_log(logged_run(folder, "run"));
    const auto summary = summary_lines(*log);
    EXPECT_EQ(summary.front(), "verdict: aligned");
    const auto has = [&](const std::string& start)
    {
        return std::any_of(summary.begin(), summary.end(),
                           [&](const auto& line) { return contains(line, start); });
    };
    EXPECT_TRUE(has("x 0.2000  y 0.1000  z 0.0000 m"));
    EXPECT_TRUE(has("yaw 2.000  pitch 0.000  roll 0.000 deg"));
    EXPECT_TRUE(has("change: 0.2236 m, 2 deg"));
    const auto pairs = pairing_lines(*log, log_moments(*log).back());
    EXPECT_EQ(pairs.front(), "point-point: 600");
}
