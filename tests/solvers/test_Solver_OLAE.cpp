#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/Solver_OLAE.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/optimal_tf_olae.h>

#include <sstream>

#include "expect_problem.h"
#include "pose_minimiser.h"
#include "random_pairings.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
Solver_OLAE loaded(const std::string& text)
{
    Solver_OLAE solver;
    solver.initialize(yaml_from_text(text, "f.yaml"), {"f.yaml", "s"});
    return solver;
}

CPose3D solved(const Pairings& p, const SolverContext& in, const Solver& solver)
{
    SolverContext context = in;
    OptimalTF_Result r;
    EXPECT_TRUE(solver.optimal_pose(p, r, context));
    return r.optimalPose;
}

CPose3D direct(const Pairings& p, const SolverContext& context, const OlaeParameters& how,
               const WeightParameters& wp = {})
{
    OptimalTF_Result r;
    EXPECT_TRUE(optimal_tf_olae(p, wp, r, context.guessRelativePose, how));
    return r.optimalPose;
}

const CPose3D TRUTH(1, 2, 3, 0.7, -0.3, 2);

/// Noisy ones of all kinds, such that every setting of a solver changes the pose.
Pairings noisy_pairings(uint64_t seed, const Mix& mix = {10, 3, 3, 4, 4}, double noise = 0.3)
{
    SeededRandom random(seed);
    return random_pairings(mix, rotation_of(TRUTH), translation_of(TRUTH), random, noise);
}
SolverContext at_truth()
{
    SolverContext context;
    context.guessRelativePose = TRUTH;
    return context;
}
double angle(const CPose3D& a, const CPose3D& b)
{
    return angle_between(rotation_of(a), rotation_of(b));
}
}  // namespace

// ---- As a step of a pipeline ------------------------------------------------------------------------------

TEST(SolverOLAE, WithoutAPriorIsOptimalTfOlaeAtTheGuessWithTheLoadedSystem)
{
    const Pairings p = noisy_pairings(1);
    std::vector<CPose3D> found;
    for (const auto& [name, system] : {std::pair("Report", OlaeSystem::Report),
                                       {"OlaeSystem::LeastSquares", OlaeSystem::LeastSquares},
                                       {"Newton", OlaeSystem::Newton}})
        for (const bool normalize : {true, false})
        {
            const auto solver = loaded(std::string("{system: '") + name +
                                       "', normalize_points: " + (normalize ? "true" : "false") + "}");
            EXPECT_EQ(solver.parameters.system, system);
            EXPECT_EQ(solver.parameters.normalize_points, normalize);
            OlaeParameters how;
            how.system = system, how.normalize_points = normalize;
            found.push_back(solved(p, at_truth(), solver));
            expect_same_bits(found.back(), direct(p, at_truth(), how));
        }
    for (size_t i = 0; i < found.size(); i++)
        for (size_t j = 0; j < i; j++) EXPECT_GT(angle(found[i], found[j]), 1e-6) << i << " " << j;
}

TEST(SolverOLAE, TheGuessChoosesTheSignsOfLinesAndTheProjections)
{
    const Pairings p = noisy_pairings(2);
    EXPECT_GT(angle(solved(p, at_truth(), Solver_OLAE()), solved(p, {}, Solver_OLAE())), 1e-4);
    expect_same_bits(solved(p, {}, Solver_OLAE()), direct(p, {}, {}));
}

TEST(SolverOLAE, UsesItsWeightParameters)
{
    Pairings p = noisy_pairings(3);
    add_pair(p, {50, 0, 0}, {-50, 0, 0});
    const auto solver = loaded(
        "{pairingsWeightParameters: {robust_kernel: Cauchy, robust_kernel_param: 0.5, pair_weights: "
        "{pl2pl_direction: 3, pl2pl_sign: Free}}}");
    WeightParameters wp;
    wp.robust_kernel = RobustKernel::Cauchy, wp.robust_kernel_param = 0.5;
    wp.currentEstimateForRobust = TRUTH;
    wp.pair_weights.pl2pl_direction = 3, wp.pair_weights.pl2pl_sign = DirectionSign::Free;
    const CPose3D pose = solved(p, at_truth(), solver);
    expect_same_bits(pose, direct(p, at_truth(), {}, wp));
    EXPECT_GT(angle(pose, solved(p, at_truth(), Solver_OLAE())), 1e-2);
    EXPECT_LT(angle(pose, TRUTH), 0.2);
}

TEST(SolverOLAE, FailsLikeOptimalTfOlae)
{
    SolverContext context;
    context.prior = prior_of(CPose3D(), Matrix6::Identity());
    OptimalTF_Result r;
    r.optimalPose = CPose3D(1, 2, 3, 0, 0, 0), r.status = SolveStatus::Determined;
    EXPECT_FALSE(Solver_OLAE().optimal_pose(Pairings(), r, context));
    EXPECT_EQ(r.optimalPose.x(), 1);
    EXPECT_EQ(r.status, SolveStatus::NoPairings);
    Pairings negative = noisy_pairings(4);
    negative.point_weights = {{1, -1.0}};
    EXPECT_THROW(Solver_OLAE().optimal_pose(negative, r, context), std::invalid_argument);
}

TEST(SolverOLAE, ObeysTheKeysOfAllSolvers)
{
    const auto solver = loaded("{runFromIteration: 3, system: Newton}");
    SolverContext context = at_truth();
    OptimalTF_Result r;
    context.icpIteration = 2;
    EXPECT_FALSE(solver.optimal_pose(noisy_pairings(1), r, context));
    context.icpIteration = 3;
    EXPECT_TRUE(solver.optimal_pose(noisy_pairings(1), r, context));
}

// ---- The prior --------------------------------------------------------------------------------------------

TEST(SolverOLAEPrior, IsAMinimumOfThePointsCostAndThePriors)
{
    SeededRandom random(5);
    for (uint64_t seed = 1; seed <= 20; seed++)
    {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        const Pairings p = noisy_pairings(seed, {15, 0, 0, 0, 0});
        const CPose3D mean =
            pose_of(coordinates(TRUTH) + 0.2 * Vector6::NullaryExpr([&]() { return random.gaussian(); }));
        const Matrix6 information = random_information(random, std::pow(10.0, random.uniform(0, 2)));
        const auto cost = [&](const Vector6& c)
        {
            const CPose3D pose = pose_of(c);
            Vector6 e = c - coordinates(mean);
            for (int i = 3; i < 6; i++) e(i) = std::remainder(e(i), 2 * M_PI);
            return point_cost(p, std::vector<double>(15, 1.0), rotation_of(pose), translation_of(pose)) +
                   e.dot(information * e);
        };
        SolverContext context = at_truth();
        context.prior = prior_of(mean, information);
        const CPose3D pose = solved(p, context, Solver_OLAE());
        const Vector6 c = coordinates(pose);
        // Curvatures are some 15 * 25 + |information|: a slope of 1e-6 of them is 1e-6 m or rad away.
        const double curvature = 15 * 25 + information.norm();
        for (int m = 0; m < 30; m++)
        {
            const Vector6 d = Vector6::NullaryExpr([&]() { return random.gaussian(); }).normalized();
            EXPECT_LT(std::abs(cost(c + 1e-4 * d) - cost(c - 1e-4 * d)) / 2e-4, 1e-5 * curvature);
            EXPECT_GT(cost(c + 1e-2 * d), cost(c));
        }
        // It is neither of the two ends, and the start of the steps does not show.
        EXPECT_GT(cost(coordinates(mean)), cost(c) * (1 + 1e-6));
        EXPECT_GT(cost(coordinates(direct(p, context, {}))), cost(c) * (1 + 1e-6));
        EXPECT_LT(angle(solved(p, context, Solver_Horn()), pose), 1e-6);
    }
}

TEST(SolverOLAEPrior, AStrongOneGivesItsOwnPoseAWeakOneTheBestOfAllRows)
{
    const Pairings p = noisy_pairings(6, {15, 0, 0, 0, 0});
    SolverContext context = at_truth();
    const CPose3D mean(4, 4, 4, -1, 0.5, 0.3);
    context.prior = prior_of(mean, 1e12 * Matrix6::Identity());
    const CPose3D strong = solved(p, context, Solver_OLAE());
    EXPECT_LT(angle(strong, mean), 1e-8);
    EXPECT_LT((translation_of(strong) - translation_of(mean)).norm(), 1e-8);
    context.prior = prior_of(mean, 1e-12 * Matrix6::Identity());
    const CPose3D weak = solved(p, context, Solver_OLAE()), horn = solved(p, at_truth(), Solver_Horn());
    EXPECT_LT(angle(weak, horn), 1e-7);
    EXPECT_GT(angle(direct(p, at_truth(), {}), horn), 1e-3);  // which is not where OLAE alone ends
}

TEST(SolverOLAEPrior, DecidesWhatThePointsLeaveFree)
{
    Pairings one;
    add_pair(one, {1, 2, 3}, {4, 5, 6});
    SolverContext context;
    Matrix6 rotation = Matrix6::Zero();
    rotation.bottomRightCorner<3, 3>().setIdentity();
    const CPose3D mean(0, 0, 0, 0.5, -0.4, 0.3);
    context.prior = prior_of(mean, rotation);
    const CPose3D pose = solved(one, context, Solver_OLAE());
    EXPECT_LT(angle(pose, mean), 1e-9);
    EXPECT_LT((to_eigen(pose.composePoint(mrpt::math::TPoint3D(4, 5, 6))) - Vector3d(1, 2, 3)).norm(), 1e-9);
}

// ---- YAML -------------------------------------------------------------------------------------------------

TEST(SolverOLAE, ValuesThatMakeNoSenseAreRefusedWithTheirPlace)
{
    const auto refused = [](const std::string& text, const std::vector<std::string>& parts)
    { expect_problem_with<ConfigError>(parts, [&]() { loaded(text); }); };
    refused("{system: Reports}", {"s.system", "Report"});
    refused("{normalize_points: perhaps}", {"s.normalize_points"});
    refused("{normalise_points: true}", {"s.normalise_points", "did you mean 'normalize_points'"});
    refused("{pairingsWeightParameters: {robust_kernel_param: 0}}",
            {"s.pairingsWeightParameters.robust_kernel_param"});
}

TEST(SolverOLAE, IsMadeByNameAndItsParametersAreLoadedAgain)
{
    const auto made =
        std::dynamic_pointer_cast<Solver_OLAE>(mrpt::rtti::classFactory("mp2p_icp::Solver_OLAE"));
    ASSERT_TRUE(made);
    EXPECT_EQ(made->parameters.system, OlaeSystem::Report);
    EXPECT_TRUE(made->parameters.normalize_points);
    made->parameters.system = OlaeSystem::LeastSquares, made->parameters.normalize_points = false;
    made->pairingsWeightParameters.pair_weights.ln2ln_direction = 0.25;
    made->pairingsWeightParameters.outlier_rejection = OutlierRejection::NoiseScale;
    made->runUpToIteration = 7;
    std::ostringstream text;
    made->save_parameters().printAsYAML(text);
    const Solver_OLAE back = loaded(text.str());
    EXPECT_EQ(back.parameters.system, OlaeSystem::LeastSquares);
    EXPECT_FALSE(back.parameters.normalize_points);
    EXPECT_EQ(back.pairingsWeightParameters.pair_weights.ln2ln_direction, std::optional<double>(0.25));
    EXPECT_EQ(back.pairingsWeightParameters.outlier_rejection, OutlierRejection::NoiseScale);
    EXPECT_EQ(back.runUpToIteration, 7u);
}
