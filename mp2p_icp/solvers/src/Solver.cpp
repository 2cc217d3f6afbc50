#include <mp2p_icp/Solver.h>
#include <mp2p_icp/se3.h>

IMPLEMENTS_VIRTUAL_MRPT_OBJECT(Solver, mrpt::rtti::CObject, mp2p_icp)

namespace mp2p_icp
{
void Solver::declare_parameters(ParameterDeclaration& declare)
{
    declare.integer("runFromIteration", runFromIteration, Range::not_negative(),
                    "first ICP iteration (from 0) in which it is used");
    declare.integer("runUpToIteration", runUpToIteration, Range::not_negative(),
                    "last ICP iteration in which it is used; 0: no limit");
    declare.number("runUntilTranslationCorrectionSmallerThan", runUntilTranslationCorrectionSmallerThan, "m",
                   Range::not_negative(),
                   "hands over to the next solver for good once an ICP step was smaller than this; 0: never");
    declare.flag("enabled", enabled, "false: as if it were not in the list");
}

bool Solver::is_active(SolverContext& context) const
{
    if (!enabled || context.switched_off.count(this)) return false;
    const uint32_t iteration = context.icpIteration.value_or(0);
    if (iteration < runFromIteration || (runUpToIteration > 0 && iteration > runUpToIteration)) return false;
    if (runUntilTranslationCorrectionSmallerThan > 0 && context.lastIcpStepIncrement &&
        translation_of(*context.lastIcpStepIncrement).norm() < runUntilTranslationCorrectionSmallerThan)
    {
        context.switched_off.insert(this);
        return false;
    }
    return true;
}

bool Solver::optimal_pose(const Pairings& pairings, OptimalTF_Result& out, SolverContext& context) const
{
    return is_active(context) && impl_optimal_pose(pairings, out, context);
}

bool run_solvers(const solver_list_t& solvers, const Pairings& pairings, OptimalTF_Result& out,
                 SolverContext& context)
{
    for (const auto& solver : solvers)
        if (solver->optimal_pose(pairings, out, context)) return true;
    return false;
}

}  // namespace mp2p_icp
