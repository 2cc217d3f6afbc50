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

TEST(Solver_Certified, AToleranceThatRoundingExceedsIsNoProof)
{
    SeededRandom random(4);
    const Pairings p = random_pairings({10, 0, 5, 0, 0}, any_rotation(random), {1, 2, 3}, random, 0.3);
    OptimalTF_Result r;
    const CPose3D before(7, 8, 9, 0.1, 0.2, 0.3);
    r.optimalPose = before;
    EXPECT_TRUE(solve(from_text("{requireProof: true}"), p, r)) << "proven at the default tolerance";
    r.optimalPose = before;
    EXPECT_FALSE(solve(from_text("{requireProof: true, tolerance: 1e-18}"), p, r));
    expect_same_bits(r.optimalPose, before);
    EXPECT_TRUE(solve(from_text("{tolerance: 1e-18}"), p, r)) << "without that wish, the pose is given";
}

TEST(Solver_Certified, MeasuresResidualsOfARobustKernelAtTheCurrentEstimate)
{
    SeededRandom random(5);
    const Matrix3d R = any_rotation(random);
    Pairings p = random_pairings({20, 0, 0, 0, 0}, R, {1, 2, 3}, random, 0.01);
    for (int i = 0; i < 5; i++) add_pair(p, random_point(random, 5), random_point(random, 5));
    const auto solver = from_text(
        "{pairingsWeightParameters: {robust_kernel: 'RobustKernel::GemanMcClure', robust_kernel_param: "
        "0.1}}");
    SolverContext context;
    context.guessRelativePose = make_pose(R, {1, 2, 3});
    OptimalTF_Result near, off;
    ASSERT_TRUE(solve(solver, p, near, context));
    EXPECT_LT(angle_between(rotation_of(near.optimalPose), R), 0.01);
    context.guessRelativePose = CPose3D(9, 9, 9, 1, 1, 1);
    ASSERT_TRUE(solve(solver, p, off, context));
    EXPECT_GT(rotation_between(near.optimalPose, off.optimalPose).norm(), 0.01)
        << "far from the pose, other pairings fit";
}

TEST(Solver_Certified, KeysThatItDoesNotKnowAreNamed)
{
    for (const std::string key : {"requireProff", "maxIterations", "robust_kernel"}) try
        {
            from_text("{" + key + ": 1}");
            ADD_FAILURE() << key << " was taken";
        }
        catch (const ConfigError& e)
        {
            EXPECT_NE(std::string(e.what()).find(key), std::string::npos) << e.what();
        }
}
