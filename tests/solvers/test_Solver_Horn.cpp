#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/optimal_tf_horn.h>

#include "expect_problem.h"
#include "pose_minimiser.h"
#include "solver_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
CPose3D solved(const Pairings& p, const SolverContext& in, const Solver_Horn& solver = Solver_Horn())
{
    SolverContext context = in;
    OptimalTF_Result r;
    EXPECT_TRUE(solver.optimal_pose(p, r, context));
    return r.optimalPose;
}

/// The cost that the header states, written out.
struct StatedCost
{
    Pairings pairings;
    std::vector<double> weights;
    CPose3D mean;
    Matrix6 information;

    double operator()(const Vector6& c) const
    {
        const CPose3D pose = pose_of(c);
        Vector6 e = c - coordinates(mean);
        for (int i = 3; i < 6; i++) e(i) = std::remainder(e(i), 2 * M_PI);
        return point_cost(pairings, weights, rotation_of(pose), translation_of(pose)) +
               e.dot(information * e);
    }
};

}  // namespace

TEST(SolverHorn, WithoutAPriorIsOptimalTfHornAtTheGuess)
{
    Pairings two;
    add_pair(two, {1, 2, 3}, {0, 0, 0});
    add_pair(two, {1, 2, 5}, {2, 0, 0});  // leaves the roll about the line to the guess
    SolverContext context;
    context.guessRelativePose = CPose3D(0, 0, 0, 0.3, -0.2, 2);
    OptimalTF_Result direct;
    ASSERT_TRUE(optimal_tf_horn(two, {}, direct, *context.guessRelativePose));
    expect_same_bits(solved(two, context), direct.optimalPose);
}

TEST(SolverHorn, UsesItsWeightParameters)
{
    Pairings p = moved_points(random_points(30, 10, 9), rotation_about({1, 0, 1}, 0.3), {1, 2, 3}, 0.3);
    add_pair(p, {50, 0, 0}, {-50, 0, 0});
    SolverContext context;
    context.guessRelativePose = make_pose(rotation_about({1, 0, 1}, 0.3), {1, 2, 3});
    Solver_Horn solver;
    solver.initialize(
        yaml_from_text("pairingsWeightParameters: {robust_kernel: Cauchy, robust_kernel_param: 0.5, "
                       "use_scale_outlier_detector: true}"));
    WeightParameters wp;
    wp.robust_kernel = RobustKernel::Cauchy, wp.robust_kernel_param = 0.5,
    wp.use_scale_outlier_detector = true;
    wp.currentEstimateForRobust = context.guessRelativePose;
    OptimalTF_Result direct;
    ASSERT_TRUE(optimal_tf_horn(p, wp, direct, *context.guessRelativePose));
    expect_same_bits(solved(p, context, solver), direct.optimalPose);
    EXPECT_GT((translation_of(solved(p, context)) - translation_of(direct.optimalPose)).norm(), 0.1);
}

TEST(SolverHorn, FailsLikeOptimalTfHorn)
{
    SolverContext context;
    context.prior = prior_of(CPose3D(), Matrix6::Identity());
    OptimalTF_Result r;
    r.optimalPose = CPose3D(1, 2, 3, 0, 0, 0);
    EXPECT_FALSE(Solver_Horn().optimal_pose(Pairings(), r, context));
    EXPECT_EQ(r.optimalPose.x(), 1);
    Pairings bad = moved_points(random_points(5, 5, 1), Matrix3d::Identity(), {1, 2, 3});
    bad.point_weights = {{1, -1.0}};
    EXPECT_THROW(Solver_Horn().optimal_pose(bad, r, context), std::invalid_argument);
}

TEST(SolverHornPrior, IsTheMinimumOfTheStatedCost)
{
    SeededRandom random(1);
    for (int k = 0; k < 12; k++)
    {
        const CPose3D truth = synthetic::random_pose({5, 5, 5, 2.5, 1.2, 2.5}, random);
        StatedCost cost;
        cost.pairings = moved_points(random_points(15, 2, static_cast<uint64_t>(k)), rotation_of(truth),
                                     translation_of(truth), 0.1, static_cast<uint64_t>(k));
        cost.weights.resize(15);
        for (auto& w : cost.weights) w = random.uniform(0.1, 2);
        cost.pairings.point_weights = as_runs(cost.weights);
        cost.mean =
            pose_of(coordinates(truth) + 0.3 * Vector6::NullaryExpr([&]() { return random.gaussian(); }));
        cost.information = random_information(random, std::pow(10.0, random.uniform(-1, 2)));
        SolverContext context;
        context.guessRelativePose = truth;
        context.prior = prior_of(cost.mean, cost.information);
        const CPose3D mine = solved(cost.pairings, context);
        OptimalTF_Result horn;
        ASSERT_TRUE(optimal_tf_horn(cost.pairings, {}, horn));
        const Vector6 best = brute_force(cost, {cost.mean, horn.optimalPose, mine});
        // At a minimum, costs equal to 1e-12 mean coordinates equal to 1e-6.
        EXPECT_LE(cost(coordinates(mine)), cost(best) * (1 + 1e-9)) << k;
        EXPECT_LT(angle_between(rotation_of(mine), rotation_of(pose_of(best))), 2e-5) << k;
        EXPECT_LT((translation_of(mine) - best.head<3>()).norm(), 2e-5) << k;
        // A gradient of zero, by central differences.
        for (int i = 0; i < 6; i++)
        {
            Vector6 step = Vector6::Zero();
            step(i) = 1e-5;
            const double slope = (cost(coordinates(mine) + step) - cost(coordinates(mine) - step)) / 2e-5;
            EXPECT_LT(std::abs(slope), 1e-5 * (1 + cost.information.norm() + 15 * 25)) << k << " " << i;
        }
        // It is neither of the two ends.
        EXPECT_GT(cost(coordinates(horn.optimalPose)), cost(coordinates(mine)));
        EXPECT_GT(cost(coordinates(cost.mean)), cost(coordinates(mine)));
    }
}

TEST(SolverHornPrior, AStrongOneGivesItsOwnPoseAWeakOneHorns)
{
    SeededRandom random(2);
    for (int k = 0; k < 30; k++)
    {
        const CPose3D truth = any_pose(random);
        const Pairings p =
            moved_points(random_points(15, 2, 3), rotation_of(truth), translation_of(truth), 0.1);
        const CPose3D mean = synthetic::random_pose({20, 20, 20, M_PI, 1.4, M_PI}, random);
        OptimalTF_Result horn;
        ASSERT_TRUE(optimal_tf_horn(p, {}, horn));
        SolverContext context;
        context.guessRelativePose = mean;
        context.prior = prior_of(mean, Matrix6::Identity() * 1e12);
        const CPose3D strong = solved(p, context);
        EXPECT_LT((translation_of(strong) - translation_of(mean)).norm(), 1e-8) << k;
        EXPECT_LT(angle_between(rotation_of(strong), rotation_of(mean)), 1e-8) << k;
        context.prior = prior_of(mean, Matrix6::Identity() * 1e-12);
        const CPose3D weak = solved(p, context);
        EXPECT_LT((translation_of(weak) - translation_of(horn.optimalPose)).norm(), 1e-7) << k;
        EXPECT_LT(angle_between(rotation_of(weak), rotation_of(horn.optimalPose)), 1e-7) << k;
    }
}

TEST(SolverHornPrior, InformationOnSomeCoordinatesLeavesTheOthersToThePoints)
{
    const CPose3D truth(1, 2, 3, 0.3, 0, 0);
    const Pairings p = moved_points(random_points(20, 2, 3), rotation_of(truth), translation_of(truth));
    SolverContext context;
    Matrix6 height = Matrix6::Zero();
    height(2, 2) = 1e12;
    context.prior = prior_of(CPose3D(-50, 70, 3.5, 3, 1, 2), height);
    const CPose3D pose = solved(p, context);
    EXPECT_NEAR(pose.z(), 3.5, 1e-8);
    EXPECT_NEAR(pose.yaw(), 0.3, 0.2);  // the points give way a little
    Matrix6 flat = Matrix6::Zero();
    flat(2, 2) = flat(4, 4) = flat(5, 5) = 1e10;
    context.prior = prior_of(CPose3D(), flat);
    const CPose3D planar = solved(p, context);
    EXPECT_NEAR(planar.z(), 0, 1e-8);
    EXPECT_NEAR(planar.pitch(), 0, 1e-8);
    EXPECT_NEAR(planar.roll(), 0, 1e-8);
    // In a plane, with all three held, x and y follow the centroids and the yaw is the truth's.
    Vector3d b = Vector3d::Zero();
    for (size_t i = 0; i < 20; i++) b += local_of(p, i) / 20;
    EXPECT_NEAR(planar.yaw(), 0.3, 1e-7);
    EXPECT_NEAR(planar.x(), 1, 1e-6);
    EXPECT_NEAR(planar.y(), 2, 1e-6);
}

TEST(SolverHornPrior, DecidesWhatThePointsLeaveFree)
{
    Pairings one;
    add_pair(one, {1, 2, 3}, {4, 5, 6});
    SolverContext context;
    Matrix6 rotation = Matrix6::Zero();
    rotation.bottomRightCorner<3, 3>().setIdentity();
    const CPose3D mean(0, 0, 0, 0.5, -0.4, 0.3);
    context.prior = prior_of(mean, rotation);
    const CPose3D pose = solved(one, context);
    EXPECT_LT(angle_between(rotation_of(pose), rotation_of(mean)), 1e-9);
    EXPECT_LT((to_eigen(pose.composePoint(mrpt::math::TPoint3D(4, 5, 6))) - Vector3d(1, 2, 3)).norm(), 1e-9);
}

TEST(SolverHornPrior, AnglesThatDifferByAWholeTurnAreEqual)
{
    const CPose3D truth(1, 2, 3, M_PI - 0.01, 0, M_PI - 0.02);
    const Pairings p = moved_points(random_points(20, 2, 3), rotation_of(truth), translation_of(truth));
    SolverContext context;
    context.prior = prior_of(CPose3D(1, 2, 3, -M_PI + 0.01, 0, -M_PI + 0.02), Matrix6::Identity());
    // 0.02 and 0.04 rad apart, not almost 2 pi: the pose stays between them.
    EXPECT_LT(angle_between(rotation_of(solved(p, context)), rotation_of(truth)), 0.05);
}

TEST(SolverHornPrior, SurvivesGimbalLock)
{
    for (const double pitch : {M_PI / 2, -M_PI / 2, M_PI / 2 - 1e-9})
    {
        const CPose3D truth(1, 2, 3, 0.3, pitch, 0.2);
        const Pairings p =
            moved_points(random_points(20, 2, 3), rotation_of(truth), translation_of(truth), 0.01);
        SolverContext context;
        context.guessRelativePose = truth;
        context.prior = prior_of(truth, Matrix6::Identity() * 1e-3);
        EXPECT_LT(angle_between(rotation_of(solved(p, context)), rotation_of(truth)), 0.02);
    }
}

TEST(SolverHornPrior, HasTheSameBitsOnAnyNumberOfThreads)
{
    const Pairings p =
        moved_points(random_points(100000, 50, 10), rotation_about({1, 2, 3}, 1), {1, 2, 3}, 0.3);
    SolverContext context;
    context.prior = prior_of(CPose3D(1, 2, 4, 0, 0, 0.1), Matrix6::Identity() * 1e5);
    CPose3D one;
    with_threads(1, [&]() { one = solved(p, context); });
    for (const int threads : {2, 8})
        with_threads(threads, [&]() { expect_same_bits(solved(p, context), one); });
}

TEST(SolverHorn, ItsParametersAreSavedAndLoadedAgain)
{
    Solver_Horn solver;
    solver.pairingsWeightParameters.scale_outlier_threshold = 1.3;
    solver.pairingsWeightParameters.robust_kernel = RobustKernel::Cauchy;
    Solver_Horn back;
    back.initialize(solver.save_parameters());
    EXPECT_EQ(back.pairingsWeightParameters.scale_outlier_threshold, 1.3);
    EXPECT_EQ(back.pairingsWeightParameters.robust_kernel, RobustKernel::Cauchy);
}
