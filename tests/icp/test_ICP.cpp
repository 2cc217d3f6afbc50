#include <gtest/gtest.h>
#include <mp2p_icp/ICP.h>
#include <mp2p_icp/QualityEvaluator_PairedRatio.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>

#include <limits>
#include <thread>

#include "icp_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
const CPose3D TRUTH = pose_deg(0.04, -0.03, 0.02, 5, -3, 4);

struct World
{
    mrpt::maps::CSimplePointsMap::Ptr points = wavy_surface(3000, 1);
    metric_map_t global = map_of(points), local = map_of(seen_from(TRUTH, *points));
};

void expect_rejected(const Results& r, const CPose3D& guess)
{
    // align() takes the guess as angles: that is what must come back.
    EXPECT_TRUE(same_bits(r.optimal_tf.mean, CPose3D(guess.asTPose())))
        << "the guess must come back unchanged";
    for (int i = 0; i < 6; i++) EXPECT_TRUE(std::isinf(r.optimal_tf.cov(i, i)));
    EXPECT_FALSE(r.trusted());
}
}  // namespace

TEST(ICP, recovers_the_pose_of_an_exact_copy_to_float_precision)
{
    const World w;
    const Results r = Bench().align(w.local, w.global);
    EXPECT_EQ(r.verdict, Verdict::aligned) << r.verdict_reason;
    EXPECT_EQ(r.terminationReason, IterTermReason::Stalled);
    // 3000 float coordinates of about 1 m, each rounded by 3e-8: the mean of the errors is far below 1e-7.
    EXPECT_LT(translation_error(r.optimal_tf.mean, TRUTH), 1e-7);
    EXPECT_LT(rotation_error(r.optimal_tf.mean, TRUTH), 1e-7);
    EXPECT_DOUBLE_EQ(r.quality, 1.0);
    EXPECT_EQ(r.finalPairings.size(), 3000u);
    EXPECT_EQ(r.local_points_used, 3000u);
    EXPECT_TRUE(r.unobservable.empty());
    EXPECT_LT(r.cost_at_end, r.cost_at_guess);
    EXPECT_FALSE(r.rejected_pose);
}

TEST(ICP, the_direction_is_local_with_respect_to_global)
{
    const World w;
    const Results forward = Bench().align(w.local, w.global), backward = Bench().align(w.global, w.local);
    EXPECT_LT(translation_error(backward.optimal_tf.mean, -TRUTH), 1e-7);
    EXPECT_GT(translation_error(forward.optimal_tf.mean, -TRUTH), 0.05);
}

TEST(ICP, final_pairings_quality_and_residual_belong_to_the_final_pose)
{
    const World w;
    metric_map_t noisy = map_of(seen_from(TRUTH, *wavy_surface(2000, 2, 0.003)));
    const Bench bench(0.2);
    const Results r = bench.align(noisy, w.global);
    ASSERT_EQ(r.verdict, Verdict::aligned);
    const Pairings again = run_matchers(bench.icp.matchers(), w.global, noisy, r.optimal_tf.mean, {});
    ASSERT_EQ(again.size(), r.finalPairings.size());
    double squares = 0;
    for (size_t i = 0; i < again.size(); i++)
    {
        EXPECT_EQ(again.paired_pt2pt[i].globalIdx, r.finalPairings.paired_pt2pt[i].globalIdx);
        const auto& p = r.finalPairings.paired_pt2pt[i];
        squares += (r.optimal_tf.mean.composePoint(p.local) - p.global).sqrNorm();
    }
    EXPECT_NEAR(r.residual_rms, std::sqrt(squares / static_cast<double>(again.size())), 1e-12);
}

// ---- No overlap -------------------------------------------------------------------------------------------

TEST(ICP, nothing_within_the_distance_is_no_overlap_and_returns_the_guess)
{
    const World w;
    const CPose3D guess = pose_deg(50, 1, 2, 10, 20, 30);
    const Results r = Bench().align(w.local, w.global, guess);
    EXPECT_EQ(r.verdict, Verdict::no_overlap);
    EXPECT_EQ(r.terminationReason, IterTermReason::NoPairings);
    EXPECT_EQ(r.quality, 0.0);
    EXPECT_TRUE(r.finalPairings.empty());
    EXPECT_EQ(r.nIterations, 0u);
    EXPECT_FALSE(r.rejected_pose);
    expect_rejected(r, guess);
}

TEST(ICP, too_small_a_share_of_paired_points_is_no_overlap)
{
    // One tenth of the local points lies on the global cloud, the rest far away: below the minimum ratio of
    // 0.2.
    const auto few = wavy_surface(100, 1);
    auto mostly_elsewhere = mrpt::maps::CSimplePointsMap::Create(*few);
    for (int i = 0; i < 900; i++) mostly_elsewhere->insertPoint(100.f + static_cast<float>(i), 0, 0);
    const metric_map_t global = map_of(few), local = map_of(mostly_elsewhere);
    const CPose3D guess = pose_deg(0.001, 0, 0, 0, 0, 0);
    const Results r = Bench(0.1).align(local, global, guess);
    EXPECT_EQ(r.verdict, Verdict::no_overlap);
    EXPECT_EQ(r.terminationReason, IterTermReason::NoPairings);
    EXPECT_EQ(r.quality, 0.0);
    expect_rejected(r, guess);
    ASSERT_TRUE(r.rejected_pose);
    EXPECT_LT(r.rejected_pose->norm(), 1e-4);  // it did find the copy, but ten percent are not believed
}

TEST(ICP, a_run_begins_only_where_one_point_in_twenty_is_paired_at_the_guess)
{
    const auto few = wavy_surface(50, 1);
    const metric_map_t global = map_of(few);
    const CPose3D guess = pose_deg(0.001, 0, 0, 0, 0, 0);
    for (const int elsewhere : {950, 951})
    {
        auto mostly_elsewhere = mrpt::maps::CSimplePointsMap::Create(*few);
        for (int i = 0; i < elsewhere; i++)
            mostly_elsewhere->insertPoint(100.f + static_cast<float>(i), 0, 0);
        Bench bench(0.1);
        bench.icp.quality_evaluators().clear();  // they would ask for more
        const Results r = bench.align(map_of(mostly_elsewhere), global, guess);
        if (elsewhere == 950)
        {
            EXPECT_GT(r.nIterations, 0u);
            EXPECT_NE(r.verdict, Verdict::no_overlap) << r.verdict_reason;
            continue;
        }
        EXPECT_EQ(r.verdict, Verdict::no_overlap);
        EXPECT_EQ(r.terminationReason, IterTermReason::NoPairings);
        EXPECT_EQ(r.nIterations, 0u);
        EXPECT_EQ(r.verdict_reason,
                  "at the guess only 50 point-point out of 1001 were within the matching distance");
        EXPECT_FALSE(r.rejected_pose);
        expect_rejected(r, guess);
    }
}

TEST(ICP, empty_clouds_are_no_overlap_and_not_an_error)
{
    const World w;
    const metric_map_t empty_layer = map_of(mrpt::maps::CSimplePointsMap::Create()), nothing;
    for (const auto* local : {&empty_layer, &nothing, &w.local})
        for (const auto* global : {&empty_layer, &nothing})
            EXPECT_EQ(Bench().align(*local, *global).verdict, Verdict::no_overlap);
}

// ---- Poses that must not be believed ----------------------------------------------------------------------

TEST(ICP, a_pose_that_fits_worse_than_the_guess_is_rejected_and_kept)
{
    const World w;
    Bench bench;
    const CPose3D wrong = TRUTH + pose_deg(0.05, 0.05, 0, 0, 0, 0);
    bench.solver->script = [wrong](const auto&, auto& out, const auto&)
    { return out.optimalPose = wrong, true; };
    const Results r = bench.align(w.local, w.global, TRUTH);
    EXPECT_EQ(r.verdict, Verdict::worse_than_guess);
    EXPECT_GT(r.cost_at_end, r.cost_at_guess);
    expect_rejected(r, TRUTH);
    ASSERT_TRUE(r.rejected_pose);
    EXPECT_TRUE(same_bits(*r.rejected_pose, wrong));
    EXPECT_LT(r.residual_rms, 1e-6) << "pairings and residuals must be those at the returned guess";
}

TEST(ICP, costs_are_the_mean_truncated_squared_distances_of_all_local_points)
{
    const World w;
    const Bench bench(0.05);
    const Results r = bench.align(w.local, w.global, TRUTH + pose_deg(0.03, 0, 0, 0, 0, 0));
    ASSERT_EQ(r.verdict, Verdict::aligned);
    double oracle = 0;  // brute force at the guess
    const CPose3D guess = TRUTH + pose_deg(0.03, 0, 0, 0, 0, 0);
    const auto local = w.local.point_layer("raw");
    for (size_t i = 0; i < local->size(); i++)
    {
        mrpt::math::TPoint3D p, q;
        local->getPoint(i, p.x, p.y, p.z);
        p = guess.composePoint(p);
        double best = 0.05 * 0.05;
        for (size_t j = 0; j < w.points->size(); j++)
            w.points->getPoint(j, q.x, q.y, q.z), best = std::min(best, (p - q).sqrNorm());
        oracle += best / static_cast<double>(local->size());
    }
    EXPECT_NEAR(r.cost_at_guess, oracle, 1e-5 * oracle);  // distances are floats
}

TEST(ICP, starting_at_the_optimum_is_aligned_and_not_worse)
{
    const World w;
    const metric_map_t noisy = map_of(seen_from(TRUTH, *wavy_surface(2000, 2, 0.003)));
    const Bench bench(0.2);
    CPose3D pose = bench.align(noisy, w.global).optimal_tf.mean;
    for (int i = 0; i < 5; i++)
    {
        const Results r = bench.align(noisy, w.global, pose);
        ASSERT_EQ(r.verdict, Verdict::aligned) << r.verdict_reason;
        pose = r.optimal_tf.mean;
    }
    EXPECT_EQ(bench.align(w.local, w.global, TRUTH).verdict, Verdict::aligned);
}

TEST(ICP, a_pose_that_is_not_finite_is_diverged)
{
    const World w;
    Bench bench;
    bench.solver->script = [](const auto&, auto& out, const auto&)
    { return out.optimalPose = CPose3D(std::numeric_limits<double>::quiet_NaN(), 0, 0), true; };
    const Results r = bench.align(w.local, w.global, TRUTH);
    EXPECT_EQ(r.verdict, Verdict::diverged);
    expect_rejected(r, TRUTH);
}

TEST(ICP, moving_beyond_the_limit_is_diverged_and_the_limit_can_be_set)
{
    const World w;
    Bench bench(0.3);
    const CPose3D far = CPose3D(2.9, 0, 0) + TRUTH,
                  too_far = CPose3D(3.1, 0, 0) + TRUTH;  // 10 x 0.3 m is the limit
    const auto jump_to = [&](const CPose3D& pose)
    {
        bench.solver->script = [pose](const auto&, auto& out, const auto&)
        { return out.optimalPose = pose, true; };
        return bench.align(w.local, w.global, TRUTH);
    };
    EXPECT_EQ(jump_to(too_far).verdict, Verdict::diverged);
    expect_rejected(jump_to(too_far), TRUTH);
    EXPECT_NE(jump_to(far).verdict, Verdict::diverged);
    bench.parameters.maxMotionOverThreshold = 11;
    EXPECT_NE(jump_to(too_far).verdict, Verdict::diverged);
}

TEST(ICP, a_solver_that_gives_up_is_failed)
{
    const World w;
    Bench bench;
    bench.solver->script = [](const auto&, auto&, const auto&) { return false; };
    const Results r = bench.align(w.local, w.global, TRUTH);
    EXPECT_EQ(r.verdict, Verdict::failed);
    EXPECT_EQ(r.terminationReason, IterTermReason::SolverError);
    expect_rejected(r, TRUTH);
}

TEST(ICP, repeating_from_its_own_result_is_not_worse)
{
    // Different samples, one-sided gates, a gate that cuts through the residuals: costs jitter with the pose.
    int refused = 0;
    for (uint64_t seed = 1; seed <= 20; seed++)
    {
        const metric_map_t global = map_of(wavy_surface(400, seed, 0.005)),
                           local = map_of(seen_from(TRUTH, *wavy_surface(300, seed + 100, 0.005)));
        Bench bench(0.2);
        bench.matcher->threshold = Formula("max(0.03, 0.2 * 0.9^ICP_ITERATION)");
        bench.parameters.minAbsStep_trans = 1e-4, bench.parameters.minAbsStep_rot = 1e-4;
        const Results first = bench.align(local, global);
        ASSERT_EQ(first.verdict, Verdict::aligned) << seed << ": " << first.verdict_reason;
        refused += !bench.align(local, global, first.optimal_tf.mean).trusted();
    }
    EXPECT_EQ(refused, 0);
}

TEST(ICP, no_active_matcher_is_failed_and_says_so)
{
    const World w;
    Bench bench;
    bench.matcher->runFromIteration = 1000;
    const Results r = bench.align(w.local, w.global, TRUTH);
    EXPECT_EQ(r.verdict, Verdict::failed);
    EXPECT_NE(r.verdict_reason.find("no matcher"), std::string::npos) << r.verdict_reason;
    expect_rejected(r, TRUTH);
}

// ---- Under-constrained ------------------------------------------------------------------------------------

TEST(ICP, collinear_points_leave_the_roll_and_the_way_along_the_line_free_and_keep_the_guess_there)
{
    auto line = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 40; i++) line->insertPoint(0.1f * static_cast<float>(i * i) / 40, 0, 0);
    const metric_map_t map = map_of(line);
    const CPose3D guess = pose_deg(0.003, 0.02, -0.01, 0.2, 0.1, 37);
    const Results r = Bench(0.5).align(map, map, guess);
    EXPECT_EQ(r.verdict, Verdict::under_constrained);
    ASSERT_EQ(r.unobservable.size(), 2u);
    EXPECT_EQ(r.unobservable[0].name, "x");
    EXPECT_EQ(r.unobservable[0].kind, FreeTwist::Kind::Translation);
    EXPECT_EQ(r.unobservable[1].name, "roll");
    EXPECT_EQ(r.unobservable[1].kind, FreeTwist::Kind::Rotation);
    EXPECT_NEAR(r.optimal_tf.mean.x(), guess.x(), 1e-9);
    EXPECT_NEAR(r.optimal_tf.mean.roll(), mrpt::DEG2RAD(37.0),
                1e-4);  // the guess's own yaw and pitch are 0.2 deg off
    EXPECT_LT(std::hypot(r.optimal_tf.mean.y(), r.optimal_tf.mean.z()), 1e-6);
    EXPECT_TRUE(std::isinf(r.optimal_tf.cov(5, 5)));
    EXPECT_TRUE(std::isinf(r.optimal_tf.cov(0, 0)));
    EXPECT_TRUE(std::isfinite(r.optimal_tf.cov(1, 1)));
}

TEST(ICP, one_point_is_under_constrained_never_aligned)
{
    auto one = mrpt::maps::CSimplePointsMap::Create();
    one->insertPoint(1, 2, 3);
    const metric_map_t map = map_of(one);
    const CPose3D guess = pose_deg(0.01, 0.02, 0.03, 1, 2, 3);
    const Results r = Bench(0.5).align(map, map, guess);
    EXPECT_EQ(r.verdict, Verdict::under_constrained);
    EXPECT_EQ(r.unobservable.size(), 3u);
    EXPECT_LT(rotation_error(r.optimal_tf.mean, guess), 1e-9) << "the rotation of the guess must stay";
    EXPECT_LT((r.optimal_tf.mean.composePoint({1, 2, 3}) - mrpt::math::TPoint3D(1, 2, 3)).norm(), 1e-9);
}

// ---- How runs end -----------------------------------------------------------------------------------------

TEST(ICP, still_moving_at_the_last_iteration_is_failed)
{
    const World w;
    Bench bench;
    bench.parameters.maxIterations = 2;
    const CPose3D guess = TRUTH + pose_deg(0.1, 0, 0, 5, 0, 0);
    const Results r = bench.align(w.local, w.global, guess);
    EXPECT_EQ(r.terminationReason, IterTermReason::MaxIterations);
    EXPECT_EQ(r.verdict, Verdict::failed);
    EXPECT_EQ(r.nIterations, 2u);
    expect_rejected(r, guess);
}

TEST(ICP, the_last_iteration_without_motion_to_speak_of_is_aligned)
{
    const World w;
    Bench bench;
    bench.parameters.minAbsStep_trans = bench.parameters.minAbsStep_rot = 0;  // never stalls
    const Results r = bench.align(w.local, w.global);
    EXPECT_EQ(r.terminationReason, IterTermReason::MaxIterations);
    bench.parameters.minAbsStep_trans = bench.parameters.minAbsStep_rot = 1e-6;
    bench.parameters.maxIterations = static_cast<uint32_t>(bench.align(w.local, w.global).nIterations - 1);
    const Results cut = bench.align(w.local, w.global);
    EXPECT_EQ(cut.terminationReason, IterTermReason::MaxIterations);
}

TEST(ICP, a_run_that_goes_round_ends_after_one_round_at_the_best_of_its_poses)
{
    const World w;
    for (const size_t period : {2u, 3u, 7u})
        for (size_t best = 0; best < period; best++)
        {
            SCOPED_TRACE(testing::Message() << "the pose " << best << " of " << period);
            Bench bench;
            const auto pose = [&](size_t i)
            {
                const double off = i == best ? 0.001 : 0.002 + 0.0005 * static_cast<double>(i);
                return TRUTH + pose_deg(i % 2 ? off : -off, 0, 0, 0, 0, 0);
            };
            bench.solver->script = [&](const auto&, auto& out, const auto& context)
            { return out.optimalPose = pose(*context.icpIteration % period), true; };
            const Results r = bench.align(w.local, w.global);
            EXPECT_EQ(r.terminationReason, IterTermReason::Cycled);
            EXPECT_EQ(r.nIterations, period + 1);
            EXPECT_EQ(r.verdict, Verdict::aligned) << r.verdict_reason;
            EXPECT_TRUE(same_bits(r.optimal_tf.mean, pose(best)));
        }
}

TEST(ICP, a_new_stage_may_come_back_to_an_old_pose)
{
    const World w;
    Bench bench;
    const CPose3D a = TRUTH + pose_deg(0.001, 0, 0, 0, 0, 0), b = TRUTH + pose_deg(-0.002, 0, 0, 0, 0, 0);
    bench.solver->script = [a, b](const auto&, auto& out, const auto& context)
    { return out.optimalPose = *context.icpIteration % 2 ? b : a, true; };  // a, b
    bench.solver->runUpToIteration = 1;
    auto second = std::make_shared<ScriptedSolver>();
    second->script = [a](const auto&, auto& out, const auto&) { return out.optimalPose = a, true; };
    second->runFromIteration = 2;
    bench.icp.solvers().push_back(second);
    const Results r = bench.align(w.local, w.global);
    EXPECT_EQ(r.terminationReason, IterTermReason::Stalled);
    EXPECT_EQ(r.nIterations, 4u);  // a, b, a, a
}

TEST(ICP, a_quality_checkpoint_ends_a_hopeless_run)
{
    const World w;
    Bench bench(0.02);  // far too small for this start: few pairs
    bench.parameters.quality_checkpoints = {{1, 0.9}};
    const CPose3D guess = TRUTH + pose_deg(0.1, 0.1, 0, 0, 0, 0);
    const Results r = bench.align(w.local, w.global, guess);
    EXPECT_EQ(r.terminationReason, IterTermReason::QualityCheckpointFailed);
    EXPECT_EQ(r.verdict, Verdict::failed);
    expect_rejected(r, guess);
    bench.parameters.quality_checkpoints = {{1, 0.0}};
    EXPECT_NE(bench.align(w.local, w.global, guess).terminationReason,
              IterTermReason::QualityCheckpointFailed);
}

TEST(ICP, a_quality_checkpoint_leaves_discarding_to_the_end)
{
    const World w;
    Bench bench;
    auto evaluator = std::make_shared<QualityEvaluator_PairedRatio>();
    evaluator->absolute_minimum_pairing_ratio = 0.9;
    bench.icp.quality_evaluators() = {{evaluator, 1.0}};
    const CPose3D away = TRUTH + pose_deg(0.4, 0.3, 0, 0, 0, 0);
    size_t paired = 0, of = 0;
    bench.solver->script = [&](const Pairings& pairings, OptimalTF_Result& out, const SolverContext& c)
    {
        if (*c.icpIteration == 1) paired = pairings.size(), of = pairings.potential_pairings;
        out.optimalPose = *c.icpIteration < 1 ? away : TRUTH;
        return true;
    };
    bench.parameters.quality_checkpoints = {{0, 0.05}};
    const Results r = bench.align(w.local, w.global, away + pose_deg(0, 0, 0.1, 0, 0, 0));
    EXPECT_LT(static_cast<double>(paired), 0.9 * static_cast<double>(of)) << "nothing to discard there";
    EXPECT_EQ(r.verdict, Verdict::aligned) << r.verdict_reason;
}

TEST(ICP, the_hook_sees_each_iteration_and_can_stop)
{
    const World w;
    Bench bench;
    std::vector<uint32_t> seen;
    bench.icp.setIterationHook(
        [&](const ICP::IterationHook_Input& in)
        {
            seen.push_back(in.currentIteration);
            EXPECT_EQ(in.pcLocal, &w.local);
            EXPECT_EQ(in.pcGlobal, &w.global);
            EXPECT_FALSE(in.currentPairings->empty());
            EXPECT_TRUE(is_finite(in.currentSolution->optimalPose));
            return ICP::IterationHook_Output{in.currentIteration == 3};
        });
    const Results r = bench.align(w.local, w.global);
    EXPECT_EQ(r.terminationReason, IterTermReason::HookRequest);
    EXPECT_EQ(seen, (std::vector<uint32_t>{0, 1, 2, 3}));
    EXPECT_EQ(r.nIterations, 4u);
}

// ---- Schedules --------------------------------------------------------------------------------------------

TEST(ICP, solvers_take_turns_by_iteration_and_a_stall_jumps_to_the_next_turn)
{
    const World w;
    Bench bench;
    std::vector<std::pair<int, uint32_t>> calls;
    const auto stay = [&calls](int who)
    {
        return [&calls, who](const Pairings&, OptimalTF_Result& out, const SolverContext& c)
        {
            calls.emplace_back(who, *c.icpIteration);
            return out.optimalPose = TRUTH, true;
        };
    };
    bench.solver->script = stay(1);
    bench.solver->runUpToIteration = 9;
    auto second = std::make_shared<ScriptedSolver>();
    second->script = stay(2);
    second->runFromIteration = 10;
    bench.icp.solvers().push_back(second);
    const Results r = bench.align(w.local, w.global);
    // The first one stalls in its second iteration; the second one still gets its turn.
    EXPECT_EQ(calls, (std::vector<std::pair<int, uint32_t>>{{1, 0}, {1, 1}, {2, 10}}));
    EXPECT_EQ(r.terminationReason, IterTermReason::Stalled);
}

TEST(ICP, a_solver_hands_over_for_good_once_a_step_is_small)
{
    const World w;
    Bench bench;
    std::vector<int> calls;
    const auto by = [&calls](int who, double x)
    {
        return [&calls, who, x](const Pairings&, OptimalTF_Result& out, const SolverContext& c)
        {
            calls.push_back(who);
            return out.optimalPose = *c.guessRelativePose + CPose3D(x, 0, 0), true;
        };
    };
    bench.solver->script = by(1, 0.001);
    bench.solver->runUntilTranslationCorrectionSmallerThan = 0.01;
    auto second = std::make_shared<ScriptedSolver>();
    second->script = by(2, 0.05);  // large steps again: the first one must not come back
    bench.icp.solvers().push_back(second);
    bench.parameters.maxIterations = 4;
    bench.align(w.local, w.global, TRUTH);
    EXPECT_EQ(calls, (std::vector<int>{1, 2, 2, 2}));
    calls.clear();
    bench.align(w.local, w.global, TRUTH);
    EXPECT_EQ(calls, (std::vector<int>{1, 2, 2, 2})) << "the hand-over belongs to the run, not to the solver";
}

TEST(ICP, a_shrinking_matching_distance_is_not_cut_short_by_a_stall)
{
    const World w;
    Bench bench;
    bench.matcher->threshold = Formula("max(0.01, 0.3 * 0.5^ICP_ITERATION)");
    std::vector<double> steps;
    bench.icp.setIterationHook([&](const auto&) { return steps.push_back(0), ICP::IterationHook_Output{}; });
    const Results r = bench.align(w.local, w.global, TRUTH);  // nothing moves at all
    EXPECT_EQ(r.terminationReason, IterTermReason::Stalled);
    EXPECT_GE(steps.size(), 6u) << "0.3 * 0.5^5 < 0.01: six iterations until the distance is final";
}

// ---- Inputs -----------------------------------------------------------------------------------------------

TEST(ICP, the_prior_reaches_every_solver)
{
    const World w;
    Bench bench;
    mrpt::poses::CPose3DPDFGaussianInf prior;
    prior.mean = pose_deg(1, 2, 3, 4, 5, 6);
    prior.cov_inv(2, 2) = 77;
    int seen = 0;
    const auto check = [&](const Pairings&, OptimalTF_Result&, const SolverContext& c)
    {
        EXPECT_TRUE(c.prior && same_bits(c.prior->mean, prior.mean) && c.prior->cov_inv(2, 2) == 77);
        return seen++, false;
    };
    bench.solver->script = check;
    auto second = std::make_shared<ScriptedSolver>();
    second->script = check;
    bench.icp.solvers().push_back(second);
    Results r;
    bench.icp.align(w.local, w.global, TRUTH.asTPose(), bench.parameters, r, prior);
    EXPECT_EQ(seen, 2);
}

TEST(ICP, a_strong_prior_on_one_coordinate_holds_it)
{
    const World w;
    const Bench bench;
    mrpt::poses::CPose3DPDFGaussianInf prior;
    prior.mean = TRUTH + pose_deg(0, 0, 0, 0, 0, 0);
    prior.mean.z(TRUTH.z() + 0.01);
    prior.cov_inv.setZero();
    prior.cov_inv(2, 2) = 1e12;
    Results r;
    bench.icp.align(w.local, w.global, TRUTH.asTPose(), bench.parameters, r, prior);
    const CPose3D& found = r.rejected_pose ? *r.rejected_pose : r.optimal_tf.mean;
    EXPECT_NEAR(found.z(), TRUTH.z() + 0.01, 1e-6);
    EXPECT_GT(std::abs(found.z() - TRUTH.z()), 0.009);
}

TEST(ICP, caller_mistakes_are_exceptions_that_name_the_rule)
{
    const World w;
    const auto message = [&](auto&& change)
    {
        Bench bench;
        CPose3D guess;
        change(bench, guess);
        try
        {
            bench.align(w.local, w.global, guess);
        }
        catch (const std::invalid_argument& e)
        {
            return std::string(e.what());
        }
        return std::string("no exception");
    };
    EXPECT_NE(message([](Bench& b, CPose3D&) { b.icp.matchers().clear(); }).find("no matchers"),
              std::string::npos);
    EXPECT_NE(message([](Bench& b, CPose3D&) { b.icp.solvers().clear(); }).find("no solvers"),
              std::string::npos);
    EXPECT_NE(message([](Bench& b, CPose3D&) { b.parameters.maxIterations = 0; }).find("maxIterations"),
              std::string::npos);
    EXPECT_NE(
        message([](Bench&, CPose3D& g) { g.x(std::numeric_limits<double>::quiet_NaN()); }).find("guess"),
        std::string::npos);
    EXPECT_NE(message([](Bench&, CPose3D& g) { g.x(std::numeric_limits<double>::infinity()); }).find("guess"),
              std::string::npos);
}

TEST(ICP, points_that_are_not_finite_are_ignored_on_both_sides)
{
    const World w;
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    const auto ridden = [&](const metric_map_t& map)
    {
        auto points = mrpt::maps::CSimplePointsMap::Create();
        points->insertAnotherMap(map.point_layer("raw").get(), CPose3D());
        for (int i = 0; i < 300; i++) points->insertPointFast(i % 3 ? nan : 0.5f, i % 2 ? inf : 0.5f, nan);
        return map_of(points);
    };
    const Results r = Bench().align(ridden(w.local), ridden(w.global));
    EXPECT_EQ(r.verdict, Verdict::aligned);
    EXPECT_LT(translation_error(r.optimal_tf.mean, TRUTH), 1e-7);
    EXPECT_EQ(r.local_points_used, 3000u);
}

TEST(ICP, offsets_of_far_away_maps_are_part_of_the_pose)
{
    World w;
    const mrpt::math::TPoint3D global_offset(500000, 4600000, 300), local_offset(499000, 4600100, 290);
    const Results plain = Bench().align(w.local, w.global);
    w.global.set_coordinate_offset(global_offset);
    w.local.set_coordinate_offset(local_offset);
    const CPose3D expected = CPose3D(global_offset) + plain.optimal_tf.mean + (-CPose3D(local_offset));
    const CPose3D guess = CPose3D(global_offset) + (-CPose3D(local_offset));
    const Results far = Bench().align(w.local, w.global, guess);
    ASSERT_EQ(far.verdict, Verdict::aligned);
    // |offset| 5e6 m x 1e-16 per operation: a few nanometres at the local cloud.
    const mrpt::math::TPoint3D somewhere = local_offset + mrpt::math::TPoint3D(0.5, 0.4, 0.1);
    EXPECT_LT((far.optimal_tf.mean.composePoint(somewhere) - expected.composePoint(somewhere)).norm(), 1e-7);
    const auto& pair = far.finalPairings.paired_pt2pt.front();
    EXPECT_LT((far.optimal_tf.mean.composePoint(pair.local) - pair.global).norm(), 1e-6)
        << "pairings are in original coordinates, too";
    // Turning about an origin 4600 km away: the position is as uncertain as that lever makes it, the angles
    // are not.
    EXPECT_NEAR(far.optimal_tf.cov(3, 3) / plain.optimal_tf.cov(3, 3), 1.0, 1e-3);
    EXPECT_GT(far.optimal_tf.cov(0, 0), 1e6 * plain.optimal_tf.cov(0, 0));
}

TEST(ICP, far_away_guess_is_returned_to_the_bit)
{
    World w;
    w.global.set_coordinate_offset({500000, 4600000, 300});
    const CPose3D guess(1.0 / 3, 2.0 / 3, 0.1, 0.1, 0.2, 0.3);  // 4600 km away from the cloud
    expect_rejected(Bench().align(w.local, w.global, guess), guess);
}

// ---- Bits and threads -------------------------------------------------------------------------------------

TEST(ICP, two_threads_may_share_one_object)
{
    const World w;
    const metric_map_t noisy = map_of(seen_from(TRUTH, *wavy_surface(2000, 2, 0.003)));
    const Bench bench(0.2);
    const Results alone = bench.align(noisy, w.global);
    std::vector<Results> results(4);
    std::vector<std::thread> threads;
    for (auto& r : results) threads.emplace_back([&] { r = bench.align(noisy, w.global); });
    for (auto& t : threads) t.join();
    for (const auto& r : results)
    {
        EXPECT_TRUE(same_bits(r.optimal_tf.mean, alone.optimal_tf.mean));
        EXPECT_EQ(r.nIterations, alone.nIterations);
        EXPECT_EQ(std::memcmp(r.optimal_tf.cov.data(), alone.optimal_tf.cov.data(), sizeof(double) * 36), 0);
    }
}

// ---- One call ---------------------------------------------------------------------------------------------

TEST(align, one_call_finds_the_pose_of_two_noisy_samples)
{
    const auto global = wavy_surface(5000, 1), local = seen_from(TRUTH, *wavy_surface(5000, 2));
    const Results r = align(*local, *global);
    EXPECT_EQ(r.verdict, Verdict::aligned) << r.verdict_reason;
    // Random samples of one surface, spacing 1.3 cm: the pose is good to about 1/sqrt(5000) of that, times
    // the friction of point-to-point matching; TRUTH is 5 cm and 7 degrees away.
    EXPECT_LT(translation_error(r.optimal_tf.mean, TRUTH), 2e-3);
    EXPECT_LT(rotation_error(r.optimal_tf.mean, TRUTH), mrpt::DEG2RAD(0.3));
    EXPECT_THROW(align(*local, *global, CPose3D(NAN, 0, 0)), std::invalid_argument);
}
