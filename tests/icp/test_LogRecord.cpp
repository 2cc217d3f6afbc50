#include <gtest/gtest.h>
#include <mp2p_icp/LogRecord.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "icp_test_tools.h"
#include "test_data.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
const CPose3D TRUTH = pose_deg(0.04, -0.03, 0.02, 5, -3, 4);

struct LoggedRun
{
    metric_map_t global = map_of(wavy_surface(500, 1)),
                 local = map_of(seen_from(TRUTH, *wavy_surface(500, 1)));
    Bench bench;
    Results result;
    LogRecord log;
    void run() { bench.icp.align(local, global, {}, bench.parameters, result, std::nullopt, log); }
};

std::string bytes_of(const mrpt::serialization::CSerializable& object)
{
    mrpt::io::CMemoryStream stream;
    auto archive = mrpt::serialization::archiveFrom(stream);
    archive << object;
    return std::string(static_cast<const char*>(stream.getRawBufferData()), stream.getTotalBytesCount());
}
}  // namespace

TEST(LogRecord, holds_the_inputs_and_the_result)
{
    LoggedRun t;
    t.run();
    EXPECT_EQ(t.log.pcGlobal->size(), 500u);
    EXPECT_EQ(t.log.pcLocal->size(), 500u);
    EXPECT_EQ(t.log.icpParameters.maxIterations, t.bench.parameters.maxIterations);
    EXPECT_TRUE(same_bits(t.log.icpResult.optimal_tf.mean, t.result.optimal_tf.mean));
    EXPECT_FALSE(t.log.iterationsDetails);
}

TEST(LogRecord, keeps_one_iteration_of_so_many)
{
    LoggedRun t;
    t.bench.parameters.saveIterationDetails = true;
    t.bench.parameters.decimationIterationDetails = 3;
    t.run();
    ASSERT_TRUE(t.log.iterationsDetails);
    for (const auto& [iteration, details] : *t.log.iterationsDetails)
    {
        EXPECT_EQ(iteration % 3, 0u);
        EXPECT_FALSE(details.pairings.empty());
    }
    EXPECT_EQ(t.log.iterationsDetails->size(), (t.result.nIterations + 2) / 3);
}

TEST(LogRecord, details_without_a_log_are_harmless)
{
    LoggedRun t;
    t.bench.parameters.saveIterationDetails = true;
    EXPECT_EQ(t.bench.align(t.local, t.global).verdict, Verdict::aligned);
}

TEST(LogRecord, maps_are_shared_with_the_caller_unless_they_are_edited)
{
    LoggedRun t;
    const auto shared = std::make_shared<metric_map_t>(t.local);
    t.bench.parameters.functor_before_logging_global = [](metric_map_t& m) { m.layers.clear(); };
    t.bench.icp.align(*shared, t.global, {}, t.bench.parameters, t.result, std::nullopt, t.log);
    EXPECT_EQ(t.log.pcLocal.get(), shared.get());
    EXPECT_TRUE(t.log.pcGlobal->empty());
    EXPECT_FALSE(t.global.empty()) << "the caller's map is not touched";
}

TEST(LogRecord, survives_writing_and_reading_bit_by_bit)
{
    LoggedRun t;
    t.bench.parameters.saveIterationDetails = true;
    t.run();
    t.log.dynamicVariables["SIGMA"] = 0.1;
    const std::string bytes = bytes_of(t.log);
    mrpt::io::CMemoryStream stream;
    stream.Write(bytes.data(), bytes.size());
    stream.Seek(0);
    auto archive = mrpt::serialization::archiveFrom(stream);
    LogRecord again;
    archive >> again;
    EXPECT_EQ(bytes_of(again), bytes);
    EXPECT_EQ(again.icpResult.finalPairings.size(), t.result.finalPairings.size());
    EXPECT_EQ(again.dynamicVariables.at("SIGMA"), 0.1);
}

TEST(debug_log, is_written_under_the_name_asked_for_in_folders_that_are_made)
{
    LoggedRun t;
    const auto folder = std::filesystem::path(temp_path("_logs"));
    std::filesystem::remove_all(folder);
    t.local.id = 7, t.local.label = "here", t.global.id = 8;
    t.bench.parameters.generateDebugFiles = true;
    t.bench.parameters.debugFileNameFormat =
        (folder / "sub" / "run-$LOCAL_ID-$LOCAL_LABEL-$GLOBAL_ID$GLOBAL_LABEL.icplog").string();
    t.bench.align(t.local, t.global);
    const auto file = folder / "sub" / "run-7-here-8.icplog";
    ASSERT_TRUE(std::filesystem::exists(file));
    const LogRecord again = LogRecord::load_from_file(file.string());
    EXPECT_EQ(again.pcLocal->label.value_or(""), "here");
    std::filesystem::remove_all(folder);
}

TEST(debug_log, the_environment_can_ask_for_it)
{
    LoggedRun t;
    const std::string file = temp_path(".icplog");
    std::filesystem::remove(file);
    t.bench.parameters.debugFileNameFormat = file;
    t.bench.align(t.local, t.global);
    EXPECT_FALSE(std::filesystem::exists(file));
    setenv("MP2P_ICP_GENERATE_DEBUG_FILES", "1", 1);
    t.bench.align(t.local, t.global);
    unsetenv("MP2P_ICP_GENERATE_DEBUG_FILES");
    EXPECT_TRUE(std::filesystem::exists(file));
    std::filesystem::remove(file);
}

TEST(Results, print_says_the_verdict_first)
{
    LoggedRun t;
    t.run();
    std::ostringstream text;
    t.result.print(text);
    EXPECT_EQ(text.str().rfind("verdict: aligned", 0), 0u) << text.str();
}

TEST(Parameters, survive_saving_and_loading)
{
    Parameters a, b;
    a.maxIterations = 17, a.minAbsStep_rot = 1.0 / 3, a.quality_checkpoints = {{3, 0.25}},
    a.saveIterationDetails = true;
    yaml saved;
    a.save_to(saved);
    b.load_from(saved);
    EXPECT_EQ(b.maxIterations, 17u);
    EXPECT_EQ(b.minAbsStep_rot, 1.0 / 3);
    EXPECT_EQ(b.quality_checkpoints, a.quality_checkpoints);
    EXPECT_TRUE(b.saveIterationDetails);
}
