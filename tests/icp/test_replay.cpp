#include <gtest/gtest.h>
#include <mp2p_icp/Matcher_Planes.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/replay.h>

#include <filesystem>

#include "icp_test_tools.h"
#include "quality_worlds.h"
#include "test_data.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
/// As a file holds it.
LogRecord through_a_file(const LogRecord& log)
{
    const std::string path = temp_path(".icplog");
    EXPECT_TRUE(log.save_to_file(path));
    LogRecord again = LogRecord::load_from_file(path);
    std::filesystem::remove(path);
    return again;
}

void expect_identical(const LogRecord& log)
{
    const auto outcome = replay(through_a_file(log));
    EXPECT_TRUE(outcome.same && outcome.identical) << outcome.sentence;
    EXPECT_NE(outcome.sentence.find("same to the last bit"), std::string::npos) << outcome.sentence;
}

/// A run of a pipeline in YAML, its filters included.
LogRecord run_pipeline(const std::string& text, const metric_map_t& local, const metric_map_t& global,
                       const CPose3D& guess = {},
                       const std::optional<mrpt::poses::CPose3DPDFGaussianInf>& prior = {})
{
    Pipeline pipeline = pipeline_from_yaml(yaml_from_text(text));
    ParameterSource source;
    source.updateVariables(extent_variables(local, global));
    pipeline.attachToParameterSource(source);
    metric_map_t l = local, g = global;
    for (metric_map_t* map : {&l, &g})
        mp2p_icp_filters::apply_filter_pipeline(pipeline.filters["filters"], *map);
    pipeline.parameters.saveIterationDetails = true;
    LogRecord log;
    Results results;
    pipeline.icp->align(l, g, guess.asTPose(), pipeline.parameters, results, prior, log);
    EXPECT_GT(log.iterations.size(), 0u);
    return log;
}

std::string pipeline_with(const std::string& matcher, const std::string& solver = "Solver_GaussNewton",
                          const std::string& solver_parameters = "{maxIterations: 5}",
                          const std::string& filters = "[]")
{
    return "class_name: mp2p_icp::ICP\nparams: {maxIterations: 30}\nmatchers: [" + matcher +
           "]\nsolvers: [{class: mp2p_icp::" + solver + ", params: " + solver_parameters +
           "}]\nquality: [{class: mp2p_icp::QualityEvaluator_PairedRatio, params: ~, weight: 0.3}, {class: "
           "mp2p_icp::QualityEvaluator_Voxels, params: ~}]\nfilters: " +
           filters + "\n";
}

const ScanPair& rooms()
{
    static const ScanPair pair = room_pair(3);
    return pair;
}
metric_map_t with_layers_of(const metric_map_t& map, const std::string& second)
{
    metric_map_t out = map;
    out.layers[second] = map.layers.at("raw");
    return out;
}
}  // namespace

TEST(replay, of_all_default_pipelines_is_identical)
{
    for (const auto& name : shipped_pipeline_names())
    {
        SCOPED_TRACE(name);
        if (name == "icp-2d-walls")
            continue;  // its filter takes scans of one height alone; see the laser scans below
        const auto local = with_layers_of(rooms().local, "dense"),
                   global = with_layers_of(rooms().global, "dense");
        expect_identical(run_pipeline(shipped_pipeline(name), local, global));
    }
}

TEST(replay, of_all_kinds_of_pairings_is_identical)
{
    const std::string planes =
        "[{class_name: mp2p_icp_filters::FilterPlanes, params: ~}, {class_name: "
        "mp2p_icp_filters::FilterLines, params: ~}]";
    const std::vector<std::pair<std::string, std::string>> matchers = {
        {"{class: mp2p_icp::Matcher_Point2Plane, params: {distanceThreshold: 0.8}}", "[]"},
        {"{class: mp2p_icp::Matcher_Point2Line, params: {distanceThreshold: 0.8}}, {class: "
         "mp2p_icp::Matcher_Points_DistanceThreshold, params: {threshold: '0.5*0.9^ICP_ITERATION+0.1'}}",
         "[]"},
        {"{class: mp2p_icp::Matcher_Adaptive, params: {absoluteMaxSearchDistance: 1.0}}", "[]"},
        {"{class: mp2p_icp::Matcher_Points_InlierRatio, params: {inliersRatio: 0.7}}", "[]"},
        {"{class: mp2p_icp::Matcher_Planes, params: {distanceThreshold: 1.0}}, {class: "
         "mp2p_icp::Matcher_Lines, params: {distanceThreshold: 1.0}}",
         planes}};
    for (const auto& [matcher, filters] : matchers)
    {
        SCOPED_TRACE(matcher);
        const auto text = pipeline_with(matcher, "Solver_GaussNewton", "{maxIterations: 5}", filters);
        expect_identical(run_pipeline(text, rooms().local, rooms().global));
    }
}

TEST(replay, with_a_prior_and_random_subsets_far_away_is_identical)
{
    mrpt::poses::CPose3DPDFGaussianInf prior;
    prior.mean = pose_deg(0.5, 0.4, 0.1, 10, 0, 0);
    for (int i = 0; i < 6; i++) prior.cov_inv(i, i) = 100.0 / 3;
    prior.cov_inv(0, 3) = prior.cov_inv(3, 0) = 0.1;
    auto local = rooms().local, global = rooms().global;
    global.set_coordinate_offset({500123, 4649776, -12});
    prior.mean = CPose3D(500123, 4649776, -12, 0, 0, 0) + prior.mean;
    const auto matcher =
        "{class: mp2p_icp::Matcher_Points_DistanceThreshold, params: {threshold: 0.5, "
        "maxLocalPointsPerLayer: 300}}";
    const auto log = run_pipeline(pipeline_with(matcher), local, global, prior.mean, prior);
    expect_identical(log);
    auto without = log;
    without.prior.reset();
    EXPECT_FALSE(replay(without).same) << "the prior matters";
}

TEST(replay, of_failed_and_stopped_runs_is_identical)
{
    const auto matcher = "{class: mp2p_icp::Matcher_Points_DistanceThreshold, params: {threshold: 0.5}}";
    const auto far =
        run_pipeline(pipeline_with(matcher), rooms().local, rooms().global, pose_deg(3, 0, 0, 100, 0, 0));
    expect_identical(far);

    Bench bench;
    bench.icp.setIterationHook([](const auto& in)
                               { return ICP::IterationHook_Output{in.currentIteration == 2}; });
    LogRecord log;
    Results results;
    bench.icp.align(rooms().local, rooms().global, {}, bench.parameters, results, std::nullopt, log);
    ASSERT_EQ(results.terminationReason, IterTermReason::HookRequest);
    expect_identical(log);
}

TEST(replay, on_other_numbers_of_threads_is_identical)
{
    const auto matcher = "{class: mp2p_icp::Matcher_Adaptive, params: {absoluteMaxSearchDistance: 1.0}}";
    LogRecord log;
    with_threads(1, [&] { log = run_pipeline(pipeline_with(matcher), rooms().local, rooms().global); });
    EXPECT_EQ(log.environment.threads, 1u);
    with_threads(3, [&] { expect_identical(log); });
}

TEST(replay, of_real_scans_is_identical)
{
    const auto global = shared_data("maps_2d/global_001.mm"), local = shared_data("maps_2d/local_001.mm");
    MP2P_ICP_SKIP_WITHOUT(global);
    auto pipeline = shipped_pipeline("icp-2d-points");
    expect_identical(run_pipeline(pipeline, *load_map(local).map, *load_map(global).map));
}

// ---- Differences ------------------------------------------------------------------------------------------

namespace
{
LogRecord plain_log()
{
    const auto matcher = "{class: mp2p_icp::Matcher_Points_DistanceThreshold, params: {threshold: 0.5}}";
    return run_pipeline(pipeline_with(matcher), rooms().local, rooms().global);
}
void expect_different(const LogRecord& log, const std::vector<std::string>& words)
{
    const auto outcome = replay(log);
    EXPECT_FALSE(outcome.same) << outcome.sentence;
    for (const auto& word : words)
        EXPECT_NE(outcome.sentence.find(word), std::string::npos)
            << word << " is not in " << outcome.sentence;
}
}  // namespace

TEST(replay, says_that_the_log_was_changed)
{
    auto log = plain_log();
    log.pipeline.matchers[0].params.asMap()["threshold"] = yaml::node_t(std::string("0.3"));
    expect_different(log, {"different", "from iteration 0 on", "the log was changed"});
}

TEST(replay, names_another_processor_and_allows_it_the_last_digits_only)
{
    auto log = plain_log();
    log.environment.processor = "an abacus";
    EXPECT_TRUE(replay(log).identical);
    const CPose3D truth = log.icpResult.optimal_tf.mean;
    log.icpResult.optimal_tf.mean = truth + pose_deg(1e-10, 0, 0, 0, 0, 0);
    const auto near = replay(log);
    EXPECT_TRUE(near.same && !near.identical) << near.sentence;
    EXPECT_NE(near.sentence.find("an abacus"), std::string::npos);
    log.icpResult.optimal_tf.mean = truth + pose_deg(1e-8, 0, 0, 0, 0, 0);
    expect_different(log, {"an abacus", "all iterations the same"});
    log.environment = this_environment();
    log.icpResult.optimal_tf.mean = truth + pose_deg(1e-10, 0, 0, 0, 0, 0);
    expect_different(log, {"pose by 1"});
}

TEST(replay, says_what_cannot_be_made_again)
{
    auto log = plain_log();
    log.pipeline.solvers[0].class_name = "my::Solver_Secret";
    expect_different(log, {"cannot be run again", "my::Solver_Secret"});

    Bench bench;
    bench.solver->script = [](const Pairings&, OptimalTF_Result& out, const SolverContext&)
    {
        out.optimalPose = pose_deg(0.01, 0, 0, 0, 0, 0);
        return true;
    };
    Results results;
    bench.icp.align(rooms().local, rooms().global, {}, bench.parameters, results, std::nullopt, log);
    expect_different(log, {"derived from mp2p_icp::Solver_Horn"});
}

TEST(replay, names_parameters_that_the_log_lacks)
{
    auto log = plain_log();
    log.pipeline.matchers[0].params.asMap().erase("pairingsPerPoint");
    log.icpResult.quality += 1;
    expect_different(log,
                     {"parameter pairingsPerPoint of mp2p_icp::Matcher_Points_DistanceThreshold", "absent"});
}
