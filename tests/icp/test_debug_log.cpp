#include <gtest/gtest.h>
#include <mp2p_icp/LogRecord.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "icp_test_tools.h"
#include "test_data.h"

/// \file test_debug_log.cpp Which runs are logged, under which name, and what a log costs a run that cannot
/// write it.
using namespace mp2p_icp;
using namespace mp2p_icp_test;
namespace fs = std::filesystem;

namespace
{
/// Runs that log into a folder of their own.
struct LoggingRuns
{
    const fs::path folder = temp_path("_logs");
    const mrpt::maps::CSimplePointsMap::Ptr surface = wavy_surface(50, 1);
    metric_map_t global = map_of(surface),
                 local = map_of(seen_from(pose_deg(0.02, 0.01, 0, 2, 0, 0), *surface));
    Bench bench;

    LoggingRuns()
    {
        fs::remove_all(folder);
        bench.parameters.generateDebugFiles = true;
        name("run-$UNIQUE_ID.icplog");
    }
    ~LoggingRuns()
    {
        std::error_code ignored;
        fs::remove_all(folder, ignored);
    }
    void name(const std::string& format)
    {
        bench.parameters.debugFileNameFormat = (folder / format).string();
    }
    Verdict run() { return bench.align(local, global).verdict; }
    std::set<std::string> files() const
    {
        std::set<std::string> out;
        std::error_code ignored;
        for (const auto& entry : fs::recursive_directory_iterator(folder, ignored))
            if (!entry.is_directory()) out.insert(fs::relative(entry.path(), folder).string());
        return out;
    }
};
}  // namespace

TEST(debug_log, writes_one_run_of_so_many)
{
    LoggingRuns t;
    t.bench.parameters.decimationDebugFiles = 3;
    for (int i = 0; i < 9; i++) t.run();
    EXPECT_EQ(t.files().size(), 3u);
}

TEST(debug_log, decimations_of_zero_are_taken_for_one)
{
    LoggingRuns t;
    t.bench.parameters.decimationDebugFiles = t.bench.parameters.decimationIterationDetails = 0;
    t.bench.parameters.saveIterationDetails = true;
    t.run(), t.run();
    ASSERT_EQ(t.files().size(), 2u);
    const auto log = LogRecord::load_from_file((t.folder / *t.files().begin()).string());
    ASSERT_TRUE(log.iterationsDetails);
    EXPECT_EQ(log.iterationsDetails->size(), log.iterations.size());
}

TEST(debug_log, labels_are_no_folders_and_no_tokens)
{
    LoggingRuns t;
    t.local.label = "../a/b c$GLOBAL_ID", t.global.label = std::string(500, 'x'), t.global.id = 4;
    t.name("$LOCAL_LABEL-$GLOBAL_LABEL.icplog");
    t.run();
    EXPECT_EQ(t.files(), std::set<std::string>{".._a_b_c$GLOBAL_ID-" + std::string(60, 'x') + ".icplog"});
}

TEST(debug_log, of_threads_that_run_at_once_are_all_there)
{
    LoggingRuns t;
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; i++)
        threads.emplace_back(
            [&t]
            {
                for (int k = 0; k < 3; k++) t.run();
            });
    for (auto& thread : threads) thread.join();
    ASSERT_EQ(t.files().size(), 12u);
    for (const auto& file : t.files())
        EXPECT_EQ(LogRecord::load_from_file((t.folder / file).string()).pcLocal->size(), 50u);
}

TEST(debug_log, of_the_same_name_is_a_whole_one)
{
    LoggingRuns t;
    t.name("last.icplog");
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; i++) threads.emplace_back([&t] { t.run(); });
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(t.files(), std::set<std::string>{"last.icplog"});
    EXPECT_EQ(LogRecord::load_from_file((t.folder / "last.icplog").string()).pcLocal->size(), 50u);
}

TEST(debug_log, leaves_those_of_earlier_programs)
{
    LoggingRuns t;
    t.run();
    const std::string first = *t.files().begin();
    const auto number = std::stoul(first.substr(4));
    // As if another program had written some of the next ones.
    for (size_t i = number + 1; i < number + 5; i++)
    {
        char name[32];
        std::snprintf(name, sizeof(name), "run-%05zu.icplog", i);
        std::ofstream(t.folder / name) << "not ours";
    }
    t.run();
    EXPECT_EQ(t.files().size(), 6u);
    size_t strangers = 0;
    for (const auto& file : t.files()) strangers += fs::file_size(t.folder / file) == 8 ? 1 : 0;
    EXPECT_EQ(strangers, 4u);
}

TEST(debug_log, that_cannot_be_written_does_not_disturb_the_run)
{
    LoggingRuns t;
    const Verdict expected = t.run();
    for (const char* name : {"/proc/nowhere/x-$UNIQUE_ID.icplog", "/dev/null/x.icplog", "", "/"})
    {
        t.bench.parameters.debugFileNameFormat = name;
        ::testing::internal::CaptureStderr();
        EXPECT_EQ(t.run(), expected) << name;
        EXPECT_NE(::testing::internal::GetCapturedStderr().find("cannot write the debug log"),
                  std::string::npos)
            << name;
    }
}

TEST(debug_log, what_is_done_to_a_map_before_it_is_logged_is_not_done_to_the_callers)
{
    LoggingRuns t;
    const Verdict expected = t.run();
    LogRecord log;
    Results result;
    t.bench.parameters.functor_before_logging_local = [](metric_map_t& map)
    { map.point_layer("raw")->resize(3); };
    t.bench.icp.align(t.local, t.global, {}, t.bench.parameters, result, std::nullopt, log);
    EXPECT_EQ(log.pcLocal->size(), 3u);
    EXPECT_TRUE(log.localWasEdited);
    EXPECT_FALSE(log.globalWasEdited);
    EXPECT_EQ(t.local.size(), 50u);
    EXPECT_EQ(result.verdict, expected);

    t.bench.parameters.functor_before_logging_local = [](metric_map_t&) { throw std::runtime_error("no"); };
    ::testing::internal::CaptureStderr();
    EXPECT_EQ(t.run(), expected);
    EXPECT_NE(::testing::internal::GetCapturedStderr().find("there will be no log: no"), std::string::npos);
}
