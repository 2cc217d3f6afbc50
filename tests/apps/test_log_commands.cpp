#include <gtest/gtest.h>
#include <mp2p_icp/LogRecord.h>

#include <tuple>

#include "run_tools.h"

using namespace mp2p_icp_test;

namespace
{
/// The log of an alignment by icp-run itself.
struct LoggedAlignment
{
    Folder folder;
    std::string log = folder.path("run.icplog");
    Outcome outcome;

    explicit LoggedAlignment(const std::string& guess = "0 0 0 0 0 0")
    {
        const auto points = points_of_room(1500);
        std::string config = EXACT_PIPELINE;
        config.replace(config.find("  maxIterations"), 0, "  debugFileNameFormat: " + log + "\n");
        outcome =
            run({"--input-local", folder.cloud("l.ply", seen_from(points, pose_deg(0.1, 0.05, 0, 2, 0, 0))),
                 "--input-global", folder.cloud("g.ply", points), "-c", folder.text("p.yaml", config), "-d",
                 "--guess", guess});
    }
};
}  // namespace

TEST(log_commands, replay_says_same_in_one_line)
{
    const LoggedAlignment run_once;
    ASSERT_EQ(run_once.outcome.code, 0) << run_once.outcome.out << run_once.outcome.err;
    for (const char* threads : {"1", "2"})
    {
        const auto o = run({"--replay", run_once.log, "--threads", threads});
        EXPECT_EQ(o.code, 0) << o.out << o.err;
        EXPECT_EQ(o.out.rfind("replay: same to the last bit: aligned", 0), 0u) << o.out;
        EXPECT_EQ(std::count(o.out.begin(), o.out.end(), '\n'), 1);
    }
}

TEST(log_commands, replay_of_a_changed_log_says_what_differs)
{
    const LoggedAlignment run_once;
    auto log = mp2p_icp::LogRecord::load_from_file(run_once.log);
    log.icpParameters.maxIterations = 2;
    log.environment.processor = "an abacus";
    ASSERT_TRUE(log.save_to_file(run_once.log));
    const auto o = run({"--replay", run_once.log});
    EXPECT_EQ(o.code, 1);
    EXPECT_EQ(o.out.rfind("replay: different: verdict aligned in the log, failed here", 0), 0u) << o.out;
    EXPECT_TRUE(contains(o.out, "an abacus")) << o.out;
}

TEST(log_commands, why_explains_good_and_bad_runs_in_ten_lines)
{
    for (const auto& [guess, code, words] :
         {std::tuple("0 0 0 0 0 0", 0, "all is well"), {"40 0 0 0 0 0", 2, "bad guess"}})
    {
        const LoggedAlignment run_once(guess);
        EXPECT_EQ(run_once.outcome.code, code);
        const auto o = run({"--why", run_once.log});
        EXPECT_EQ(o.code, 0);
        EXPECT_TRUE(contains(o.out, words)) << o.out;
        EXPECT_TRUE(contains(o.out, "To try: ")) << o.out;
        EXPECT_LE(std::count(o.out.begin(), o.out.end(), '\n'), 10);
    }
}

TEST(log_commands, refuse_what_is_no_log)
{
    const Folder folder;
    const auto file = folder.text("x.icplog", "1 2 3\n");
    for (const char* option : {"--why", "--replay"})
        expect_complaint(run({option, file}), {file, "expected an ICP log"});
}
