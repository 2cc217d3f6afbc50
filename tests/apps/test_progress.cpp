#include "progress.h"
#include "run_tools.h"

using mp2p_icp_apps::Progress;
using mp2p_icp_test::contains;

TEST(Progress, shows_a_long_stage_on_a_terminal_and_removes_it)
{
    std::ostringstream err;
    {
        Progress progress(err, true);
        progress.stage("aligning");
        progress.detail("iteration 7");
        std::this_thread::sleep_for(std::chrono::milliseconds(2200));
    }
    EXPECT_TRUE(contains(err.str(), "aligning, iteration 7 (")) << err.str();
    EXPECT_EQ(err.str().substr(err.str().rfind('\r')), "\r\033[K");  // nothing stays on the line
    EXPECT_FALSE(contains(err.str(), "\n"));
}

TEST(Progress, is_silent_when_piped_or_quick)
{
    std::ostringstream piped, quick;
    {
        Progress progress(piped, false), fast(quick, true);
        progress.stage("aligning"), fast.stage("aligning");
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        fast.finish();
        std::this_thread::sleep_for(std::chrono::milliseconds(1200));
    }
    EXPECT_EQ(piped.str(), "");
    EXPECT_EQ(quick.str(), "");
}
