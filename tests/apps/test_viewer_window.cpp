// The real window on a virtual screen, used with keys and mouse.

#include "viewer_tools.h"
#include "x_server.h"

using namespace mp2p_icp_test;

namespace
{
constexpr uint32_t BLUE = 0x0072B2, ORANGE = 0xD55E00, WHITE = 0xFFFFFF;
constexpr size_t SOME_PIXELS = 1000;  // less than a moved cloud
constexpr size_t PANEL_WIDTH = 440;
constexpr int SLIDER_LEFT = 16, SLIDER_RIGHT = 412, POSE_SLIDER_Y = 157;

/// The viewer on a screen of its own.
class OpenViewer
{
 public:
    OpenViewer(const Folder& folder, const std::string& input)
        : x_(folder),
          viewer_(folder, "viewer",
                  // Leaks of graphics drivers are none of ours, nor that Debian's nanogui frees what is made
                  // with new.
                  "env DISPLAY=" + x_.display() + " XDG_CONFIG_HOME=" + folder.path("config") +
                      " ASAN_OPTIONS=detect_leaks=0:alloc_dealloc_mismatch=0 " +
                      std::string(ICP_LOG_VIEWER_PROGRAM) + " " + input)
    {
    }

    std::string title() const { return x_.user("search --name icp-log-viewer getwindowname"); }
    bool waits_for_title(const std::string& part) const
    {
        return wait_until([&] { return contains(title(), part); });
    }
    /// An X server's screen is black before.
    bool waits_for_first_frame() const
    {
        return wait_until([&] { return screen().count(WHITE) > 100'000; });
    }
    /// The window gets the keyboard first, as a window manager would see to.
    void key(const std::string& name) const
    {
        x_.user("search --name icp-log-viewer windowfocus key " + name);
    }
    /// Its 3-D part: the panel changes its colour when it is clicked.
    Screenshot screen() const { return x_.screenshot().right_of(PANEL_WIDTH); }
    /// Does the screen come to differ from what it was, or to look like it again?
    bool comes_to_differ_from(const Screenshot& before) const
    {
        return wait_until([&] { return differing(before, screen()) > SOME_PIXELS; });
    }
    bool comes_back_to(const Screenshot& before) const
    {
        return wait_until([&] { return differing(before, screen()) < SOME_PIXELS; });
    }
    const XServer& x() const { return x_; }
    Background& program() { return viewer_; }

 private:
    XServer x_;
    Background viewer_;
};
}  // namespace

TEST(viewer_window, obeys_keys_and_mouse)
{
    if (!XServer::is_installed()) GTEST_SKIP() << "Xvfb and xdotool are not installed";
    const Folder folder;
    const auto good = logged_run(folder, "a_good"), bad = logged_run(folder, "b_bad", "[100 0 0 0 0 0]");
    OpenViewer viewer(folder, good + " " + bad);
    ASSERT_TRUE(viewer.waits_for_title("a_good.icplog (aligned")) << viewer.title() << viewer.program().err();
    ASSERT_TRUE(viewer.waits_for_first_frame());
    const auto final_pose = viewer.screen();
    EXPECT_GT(final_pose.count(ORANGE), 500u);
    EXPECT_GT(final_pose.count(BLUE), 100u) << "the rim of global points behind the local ones";

    viewer.key("i");
    ASSERT_TRUE(viewer.waits_for_title("guess")) << viewer.title();
    ASSERT_TRUE(viewer.comes_to_differ_from(final_pose));
    const auto guess = viewer.screen();
    EXPECT_GT(static_cast<double>(guess.count(BLUE)), 1.3 * static_cast<double>(final_pose.count(BLUE)))
        << "they no longer lie upon each other";

    viewer.x().drag(SLIDER_LEFT, POSE_SLIDER_Y, (SLIDER_LEFT + SLIDER_RIGHT) / 2, POSE_SLIDER_Y);
    ASSERT_TRUE(viewer.waits_for_title("after iteration")) << viewer.title();
    EXPECT_TRUE(viewer.comes_to_differ_from(guess));

    viewer.key("i");
    ASSERT_TRUE(viewer.waits_for_title("final pose"));
    EXPECT_TRUE(viewer.comes_back_to(final_pose)) << differing(final_pose, viewer.screen());
    viewer.x().drag(700, 300, 900, 380);
    EXPECT_TRUE(viewer.comes_to_differ_from(final_pose)) << "turned";

    const auto turned = viewer.screen();
    viewer.key("Right");
    ASSERT_TRUE(viewer.waits_for_title("b_bad.icplog (no_overlap")) << viewer.title();
    EXPECT_TRUE(viewer.comes_to_differ_from(turned));
    viewer.key("q");
    ASSERT_TRUE(wait_until([&] { return viewer.program().ended(); }));
    EXPECT_EQ(viewer.program().code(), 0) << viewer.program().err();
    EXPECT_TRUE(contains(viewer.program().out(), "ms each")) << viewer.program().out();
    EXPECT_TRUE(contains(viewer.program().out(), "sent to the graphics card 2 times"))
        << viewer.program().out();
    EXPECT_TRUE(std::filesystem::exists(folder.path("config/mp2p_icp/icp-log-viewer.yaml")));
}

TEST(viewer_window, shows_a_map)
{
    if (!XServer::is_installed()) GTEST_SKIP() << "Xvfb and xdotool are not installed";
    const Folder folder;
    mp2p_icp::metric_map_t map;
    map.layers["a"] = mrpt::maps::CSimplePointsMap::Create(points_of_room(300));
    mp2p_icp::save_map(map, folder.path("room.mm"));
    OpenViewer viewer(folder, folder.path("room.mm"));
    ASSERT_TRUE(viewer.waits_for_title("room.mm")) << viewer.program().err();
    ASSERT_TRUE(viewer.waits_for_first_frame());
    EXPECT_GT(viewer.screen().count(BLUE), 500u);
    viewer.key("q");
    EXPECT_TRUE(wait_until([&] { return viewer.program().ended(); }));
    EXPECT_EQ(viewer.program().code(), 0) << viewer.program().err();
}
