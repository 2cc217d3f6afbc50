#include <mp2p_icp/Solver.h>
#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/errors.h>

#include "expect_problem.h"
#include "solver_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
/// Answers with a pose that tells which one it was, or not at all.
class FixedSolver : public Solver
{
 public:
    explicit FixedSolver(double x, bool succeeds = true) : x_(x), succeeds_(succeeds) {}
    mutable int calls = 0;

 protected:
    bool impl_optimal_pose(const Pairings&, OptimalTF_Result& out, const SolverContext&) const override
    {
        calls++;
        if (succeeds_) out.optimalPose = CPose3D(x_, 0, 0, 0, 0, 0);
        return succeeds_;
    }

 private:
    double x_;
    bool succeeds_;
    // The class factory of MRPT is of no use to it.
    mrpt::rtti::CObject* clone() const override { return new FixedSolver(*this); }
};

SolverContext at_iteration(uint32_t i)
{
    SolverContext c;
    c.icpIteration = i;
    return c;
}

double answer(const solver_list_t& solvers, SolverContext& context)
{
    OptimalTF_Result r;
    return run_solvers(solvers, Pairings(), r, context) ? r.optimalPose.x() : -1;
}
}  // namespace

TEST(Solver, RunsBetweenItsIterationsBothIncluded)
{
    FixedSolver s(1);
    s.runFromIteration = 3, s.runUpToIteration = 5;
    OptimalTF_Result r;
    for (uint32_t i = 0; i < 9; i++)
    {
        auto context = at_iteration(i);
        EXPECT_EQ(s.is_active(context), i >= 3 && i <= 5) << i;
        EXPECT_EQ(s.optimal_pose(Pairings(), r, context), i >= 3 && i <= 5) << i;
    }
    EXPECT_EQ(s.calls, 3);
    s.runUpToIteration = 0;  // no limit
    auto late = at_iteration(UINT32_MAX);
    EXPECT_TRUE(s.is_active(late));
}

TEST(Solver, WithoutAnIterationItIsTheFirst)
{
    FixedSolver s(1);
    SolverContext context;
    EXPECT_TRUE(s.is_active(context));
    s.runFromIteration = 1;
    EXPECT_FALSE(s.is_active(context));
}

TEST(Solver, ADisabledOneNeverRuns)
{
    FixedSolver s(1);
    s.enabled = false;
    auto context = at_iteration(0);
    EXPECT_FALSE(s.is_active(context));
}

TEST(Solver, HandsOverForTheRestOfTheRunOnceAStepWasSmall)
{
    FixedSolver s(1);
    s.runUntilTranslationCorrectionSmallerThan = 0.1;
    auto context = at_iteration(0);
    EXPECT_TRUE(s.is_active(context));  // there was no step yet
    context.lastIcpStepIncrement = CPose3D(0.1, 0, 0, 3, 0, 0);
    EXPECT_TRUE(s.is_active(context));                                  // not smaller
    context.lastIcpStepIncrement = CPose3D(0.05, 0.05, 0.05, 3, 0, 0);  // 0.087 m
    EXPECT_FALSE(s.is_active(context));
    context.lastIcpStepIncrement = CPose3D(9, 0, 0, 0, 0, 0);
    EXPECT_FALSE(s.is_active(context));  // latched
    auto next_run = at_iteration(0);
    next_run.lastIcpStepIncrement = CPose3D(9, 0, 0, 0, 0, 0);
    EXPECT_TRUE(s.is_active(next_run));  // the latch belonged to the run
}

TEST(Solver, ASmallStepBeforeItsFirstIterationDoesNotLatchIt)
{
    FixedSolver s(1);
    s.runFromIteration = 2, s.runUntilTranslationCorrectionSmallerThan = 0.1;
    auto context = at_iteration(1);
    context.lastIcpStepIncrement = CPose3D(0.01, 0, 0, 0, 0, 0);
    EXPECT_FALSE(s.is_active(context));
    context.icpIteration = 2;
    context.lastIcpStepIncrement = CPose3D(0.5, 0, 0, 0, 0, 0);
    EXPECT_TRUE(s.is_active(context));
}

TEST(Solver, TheFirstActiveOneThatSucceedsGivesTheResult)
{
    const auto coarse = std::make_shared<FixedSolver>(1), failing = std::make_shared<FixedSolver>(2, false),
               fine = std::make_shared<FixedSolver>(3);
    coarse->runUntilTranslationCorrectionSmallerThan = 0.1;
    const solver_list_t list = {coarse, failing, fine};
    auto context = at_iteration(0);
    EXPECT_EQ(answer(list, context), 1);
    EXPECT_EQ(failing->calls, 0);
    context.lastIcpStepIncrement = CPose3D(0.01, 0, 0, 0, 0, 0);
    EXPECT_EQ(answer(list, context), 3);
    EXPECT_EQ(failing->calls, 1);
    context.lastIcpStepIncrement = CPose3D(1, 0, 0, 0, 0, 0);
    EXPECT_EQ(answer(list, context), 3);
    EXPECT_EQ(answer({failing}, context), -1);
    EXPECT_EQ(answer({}, context), -1);
    EXPECT_EQ(coarse->calls, 1);
}

TEST(Solver, CommonParametersAreLoadedAndSavedAndCheckedByName)
{
    Solver_Horn s;
    s.initialize(
        yaml_from_text("{runFromIteration: 2, runUpToIteration: 7, enabled: false, "
                       "runUntilTranslationCorrectionSmallerThan: 0.25}"));
    EXPECT_EQ(s.runFromIteration, 2u);
    EXPECT_EQ(s.runUpToIteration, 7u);
    EXPECT_FALSE(s.enabled);
    EXPECT_EQ(s.runUntilTranslationCorrectionSmallerThan, 0.25);
    Solver_Horn back;
    back.initialize(s.save_parameters());
    EXPECT_EQ(back.runUpToIteration, 7u);
    EXPECT_FALSE(back.enabled);
    expect_problem_with<ConfigError>({"runFromIterations", "did you mean 'runFromIteration'"}, []()
                                     { Solver_Horn().initialize(yaml_from_text("runFromIterations: 2")); });
    EXPECT_THROW(Solver_Horn().initialize(yaml_from_text("runUntilTranslationCorrectionSmallerThan: -1")),
                 ConfigError);
}

TEST(Solver, IsMadeByItsClassName)
{
    const auto made = mrpt::rtti::classFactory("mp2p_icp::Solver_Horn");
    ASSERT_TRUE(made);
    EXPECT_TRUE(std::dynamic_pointer_cast<Solver>(made));
}
