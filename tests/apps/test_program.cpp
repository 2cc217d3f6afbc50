// The real program, as a shell starts it.

#include <sys/wait.h>

#include <cstdlib>

#include "run_tools.h"

using namespace mp2p_icp_test;

namespace
{
Outcome start(const Folder& folder, const std::string& arguments)
{
    const std::string out = folder.path("stdout"), err = folder.path("stderr");
    const int status =
        std::system((std::string(ICP_RUN_PROGRAM) + " " + arguments + " >" + out + " 2>" + err).c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(out), content_of(err)};
}
}  // namespace

TEST(icp_run_program, gives_the_exit_codes_to_the_shell_and_nothing_else_to_stderr)
{
    const Folder folder;
    const auto global = scan_of_room(pose_deg(0, 0, 1.2, 0, 0, 0));
    const auto g = folder.cloud("g.ply", global),
               l = folder.cloud("l.ply", seen_from(global, pose_deg(0.2, 0, 0, 2, 0, 0)));
    const std::string inputs = "--input-local " + l + " --input-global " + g;

    const auto aligned = start(folder, inputs);
    EXPECT_EQ(aligned.code, 0) << aligned.out;
    EXPECT_EQ(aligned.err, "");
    EXPECT_TRUE(contains(aligned.out, "ICP result: aligned: "));

    const auto apart = start(folder, inputs + " --guess '[100 0 0 0 0 0]'");
    EXPECT_EQ(apart.code, 2) << apart.out;
    EXPECT_EQ(apart.err, "");

    expect_complaint(start(folder, "--input-local " + folder.path("none.ply") + " --input-global " + g),
                     {"none.ply"});
    expect_complaint(start(folder, inputs + " --nonsense"), {"--nonsense"});
    EXPECT_EQ(start(folder, "--help").code, 0);
}

TEST(icp_run_program, profiles_once)
{
    const Folder folder;
    const auto cloud = folder.cloud("c.ply", scan_of_room(pose_deg(0, 0, 1.2, 0, 0, 0)));
    const auto o = start(folder, "--profiler --input-local " + cloud + " --input-global " + cloud);
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_FALSE(contains(o.out + o.err, "dumpAllStats"));  // what MRPT's timer prints at its end
    EXPECT_TRUE(contains(o.out, "CTimeLogger report"));
}
