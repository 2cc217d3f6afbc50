#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mrpt/rtti/CObject.h>

#include <functional>

#include "expect_problem.h"
#include "pose_minimiser.h"
#include "random_pairings.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
const CPose3D TRUTH(1, 2, 3, 0.4, -0.5, 2), GUESS(1.1, 2.2, 2.9, 0.5, -0.4, 2.1);

Pairings pairings()
{
    SeededRandom random(1);
    return random_pairings({4, 4, 4, 4, 4}, rotation_of(TRUTH), translation_of(TRUTH), random, 0.1);
}
CPose3D solved(const Solver& solver, const SolverContext& in)
{
    SolverContext context = in;
    OptimalTF_Result r;
    EXPECT_TRUE(solver.optimal_pose(pairings(), r, context));
    return r.optimalPose;
}
CPose3D direct(const OptimalTF_GN_Parameters& p)
{
    OptimalTF_Result r;
    EXPECT_TRUE(optimal_tf_gauss_newton(pairings(), r, p));
    return r.optimalPose;
}
Solver_GaussNewton loaded(const std::string& text)
{
    Solver_GaussNewton solver;
    solver.initialize(yaml_from_text(text, "f.yaml"), {"f.yaml", "s"});
    return solver;
}
}  // namespace

TEST(SolverGaussNewton, IsOptimalTfGaussNewtonWithItsParameters)
{
    const auto solver = loaded(
        "{maxIterations: 2, pair_weights: {pt2pt: 2, pt2ln: 3, pt2pl: 4, ln2ln: 5, pl2pl: 6}, "
        "robustKernel: 'RobustKernel::Huber', robustKernelParam: '0.3/(1+ICP_ITERATION)'}");
    SolverContext context;
    context.guessRelativePose = GUESS;
    context.prior = prior_of(CPose3D(1, 2, 3, 0.3, -0.3, 2), 50 * Matrix6::Identity());
    context.variables["ICP_ITERATION"] = 2;
    OptimalTF_GN_Parameters p;
    p.linearizationPoint = GUESS, p.prior = context.prior, p.maxInnerLoopIterations = 2;
    p.kernel = RobustKernel::Huber, p.kernelParam = 0.3 / 3;
    p.pairWeights.pt2pt = 2, p.pairWeights.pt2ln = 3, p.pairWeights.pt2pl = 4, p.pairWeights.ln2ln = 5,
    p.pairWeights.pl2pl = 6;
    const CPose3D expected = direct(p);
    expect_same_bits(solved(solver, context), expected);
    // Each of them matters.
    for (const auto& change :
         std::vector<std::function<void(OptimalTF_GN_Parameters&)>>{
             [](auto& q) { q.linearizationPoint = TRUTH; }, [](auto& q) { q.prior.reset(); },
             [](auto& q) { q.maxInnerLoopIterations = 1; }, [](auto& q) { q.kernel = RobustKernel::None; },
             [](auto& q) { q.kernelParam = 0.3; }, [](auto& q) { q.pairWeights.pt2pt = 1; },
             [](auto& q) { q.pairWeights.pt2ln = 1; }, [](auto& q) { q.pairWeights.pt2pl = 1; },
             [](auto& q) { q.pairWeights.ln2ln = 1; }, [](auto& q) { q.pairWeights.pl2pl = 1; }})
    {
        auto changed = p;
        change(changed);
        EXPECT_GT((translation_of(direct(changed)) - translation_of(expected)).norm(), 1e-7);
    }
}

TEST(SolverGaussNewton, WithoutAGuessItStartsFromTheClosedForm)
{
    OptimalTF_GN_Parameters p;
    p.maxInnerLoopIterations = 5;
    expect_same_bits(solved(loaded("{maxIterations: 5}"), {}), direct(p));
}

TEST(SolverGaussNewton, FailsWithoutPairings)
{
    SolverContext context;
    OptimalTF_Result r;
    EXPECT_FALSE(Solver_GaussNewton().optimal_pose(Pairings(), r, context));
}

TEST(SolverGaussNewton, ValuesThatMakeNoSenseAreRefused)
{
    const auto refused = [](const std::string& text, const std::vector<std::string>& parts)
    { expect_problem_with<ConfigError>(parts, [&]() { loaded(text); }); };
    refused("{}", {"maxIterations"});
    refused("{maxIterations: 0}", {"s.maxIterations"});
    refused("{maxIterations: 5, robustKernelParam: 0}", {"s.robustKernelParam"});
    refused("{maxIterations: 5, robustKernel: Hubert}", {"s.robustKernel", "Huber"});
    refused("{maxIterations: 5, pair_weights: {ln2ln: -1}}", {"s.pair_weights.ln2ln"});
    refused("{maxIterations: 5, maxIteration: 5}", {"s.maxIteration", "did you mean"});
    SolverContext context;
    context.variables["ICP_ITERATION"] = 1;
    OptimalTF_Result r;
    const auto solver = loaded("{maxIterations: 5, robustKernelParam: '1-ICP_ITERATION'}");
    EXPECT_THROW(solver.optimal_pose(pairings(), r, context), std::runtime_error);
}

TEST(SolverGaussNewton, IsMadeByNameAndItsParametersAreLoadedAgain)
{
    const auto made = std::dynamic_pointer_cast<Solver_GaussNewton>(
        mrpt::rtti::classFactory("mp2p_icp::Solver_GaussNewton"));
    ASSERT_TRUE(made);
    made->maxIterations = 7, made->robustKernel = RobustKernel::Tukey, made->innerLoopVerbose = true;
    made->pairWeights.pl2pl = 0.5, made->robustKernelParam = Formula("2*ICP_ITERATION");
    Solver_GaussNewton back;
    back.initialize(made->save_parameters());
    EXPECT_EQ(back.maxIterations, 7);
    EXPECT_EQ(back.robustKernel, RobustKernel::Tukey);
    EXPECT_TRUE(back.innerLoopVerbose);
    EXPECT_EQ(back.pairWeights.pl2pl, 0.5);
    EXPECT_EQ(back.robustKernelParam.text(), "2*ICP_ITERATION");
}
