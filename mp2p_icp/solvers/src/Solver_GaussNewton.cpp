#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>

#include "robust_kernel_names.h"

IMPLEMENTS_MRPT_OBJECT(Solver_GaussNewton, mp2p_icp::Solver, mp2p_icp)

namespace mp2p_icp
{
void Solver_GaussNewton::declare_parameters(ParameterDeclaration& declare)
{
    Solver::declare_parameters(declare);
    declare.integer("maxIterations", maxIterations, {1, 1e6}, "steps per ICP iteration", Need::Required);
    declare.flag("innerLoopVerbose", innerLoopVerbose, "prints a line per step");
    declare.group("pair_weights", pairWeights, "weights per kind of pairing");
    declare.choice<RobustKernel>("robustKernel", robustKernel, "RobustKernel", robust_kernel_names(),
                                 "lets pairings with large residuals weigh less");
    declare.formula("robustKernelParam", robustKernelParam, "m", Range::positive(), "scale of the kernel");
}

bool Solver_GaussNewton::impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                                           const SolverContext& context) const
{
    OptimalTF_GN_Parameters p;
    p.linearizationPoint = context.guessRelativePose;
    p.prior = context.prior;
    p.maxInnerLoopIterations = maxIterations;
    p.pairWeights = pairWeights;
    p.kernel = robustKernel;
    p.kernelParam = checked_value(robustKernelParam, variables(context.variables), "robustKernelParam",
                                  Range::positive());
    p.verbose = innerLoopVerbose;
    return optimal_tf_gauss_newton(pairings, out, p);
}

}  // namespace mp2p_icp
