#include <gtest/gtest.h>
#include <mp2p_icp/Solver_Certified.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/optimal_tf_certified.h>
#include <mp2p_icp/yaml_tools.h>

#include <fstream>
#include <sstream>

#include "degenerate_sets.h"
#include "test_data.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
Solver_Certified from_text(const std::string& text)
{
    Solver_Certified solver;
    solver.initialize(yaml_from_text(text));
    return solver;
}
bool solve(const Solver& solver, const Pairings& pairings, OptimalTF_Result& out, SolverContext context = {})
{
    return solver.optimal_pose(pairings, out, context);
}
}  // namespace

TEST(Solver_Certified, IsFoundByItsName)
{
    EXPECT_NE(mrpt::rtti::classFactory("mp2p_icp::Solver_Certified"), nullptr);
}

TEST(Solver_Certified, ItsParametersComeFromYaml)
{
    const auto solver = from_text(
        "{runFromIteration: 3, tolerance: 1e-7, requireProof: true, pairingsWeightParameters: {pair_weights: "
        "{pt2pl: 4}, "
        "outlier_rejection: 'OutlierRejection::GncTruncated', outlier_threshold: 0.2}}");
    EXPECT_EQ(solver.runFromIteration, 3u);
    EXPECT_EQ(solver.tolerance, 1e-7);
    EXPECT_TRUE(solver.requireProof);
    EXPECT_EQ(solver.pairingsWeightParameters.pair_weights.pt2pl, 4);
    EXPECT_EQ(solver.pairingsWeightParameters.outlier_rejection, OutlierRejection::GncTruncated);
    EXPECT_THROW(from_text("{tolerence: 1}"), ConfigError);
    EXPECT_THROW(from_text("{tolerance: 0}"), ConfigError);
    EXPECT_THROW(from_text("{tolerance: 1}"), ConfigError);
}

TEST(Solver_Certified, GivesThePoseOfTheFunctionAtItsTurn)
{
    SeededRandom random(1);
    const Pairings p = random_pairings({2, 2, 2, 2, 2}, any_rotation(random), {1, 2, 3}, random, 0.3);
    CertifiedResult expected;
    ASSERT_TRUE(optimal_tf_certified(p, expected));
    const auto solver = from_text("{runFromIteration: 2}");
    OptimalTF_Result r;
    SolverContext context;
    context.icpIteration = 1;
    EXPECT_FALSE(solve(solver, p, r, context));
    context.icpIteration = 2;
    ASSERT_TRUE(solve(solver, p, r, context));
    expect_same_bits(r.optimalPose, expected.optimalPose);
    EXPECT_EQ(r.rank, 6);
}

TEST(Solver_Certified, KeepsTheEstimateAlongFreeMotionsAndHonoursAPrior)
{
    FittingSet s(2);
    s.plane({0, 0, 1}, Vector3d::UnitZ());
    SolverContext context;
    context.guessRelativePose = s.truth;
    OptimalTF_Result r;
    ASSERT_TRUE(solve(Solver_Certified(), s.pairings, r, context));
    EXPECT_EQ(r.rank, 3);
    EXPECT_LT(rotation_between(s.truth, r.optimalPose).norm(), 1e-6);
    EXPECT_LT((translation_of(r.optimalPose) - translation_of(s.truth)).norm(), 1e-5);
    // A prior that is off along what is free moves it there.
    context.prior.emplace();
    const Vector3d shift = s.global_direction(Vector3d::UnitX());
    context.prior->mean = make_pose(rotation_of(s.truth), translation_of(s.truth) + shift);
    for (int i = 0; i < 6; i++) context.prior->cov_inv(i, i) = 1;
    ASSERT_TRUE(solve(Solver_Certified(), s.pairings, r, context));
    EXPECT_LT((translation_of(r.optimalPose) - translation_of(context.prior->mean)).norm(), 1e-6);
}

TEST(Solver_Certified, GivesNoPoseWithoutTheProofThatIsRequired)
{
    const std::string file = shared_data("solver/choilam_pairs.txt");
    MP2P_ICP_SKIP_WITHOUT(file);
    std::ifstream in(file);
    Pairings pairings;
    for (std::string text; std::getline(in, text);)
    {
        std::istringstream numbers(text);
        std::vector<double> v;
        for (double x; numbers >> x;) v.push_back(x);
        if (v.size() < 10) continue;
        pairings.paired_pt2pl.push_back({patch({v[3], v[4], v[5]}, {v[6], v[7], v[8]}), {v[0], v[1], v[2]}});
        pairings.pt2pl_weights.emplace_back(1, v[9]);
    }
    ASSERT_EQ(pairings.size(), 68u);
    CertifiedResult certified;
    ASSERT_TRUE(optimal_tf_certified(pairings, certified));
    EXPECT_EQ(certified.verdict, GlobalVerdict::Gap);
    EXPECT_GT(certified.gap, 0.1 * certified.scale);
    EXPECT_LT(certified.gap, certified.scale);
    OptimalTF_Result r;
    EXPECT_TRUE(solve(Solver_Certified(), pairings, r));
    EXPECT_FALSE(solve(from_text("{requireProof: true}"), pairings, r));
}
