#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/optimal_tf_horn.h>

#include "weighted_closed_form.h"

IMPLEMENTS_MRPT_OBJECT(Solver_Horn, mp2p_icp::Solver, mp2p_icp)

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

void Solver_Horn::declare_parameters(ParameterDeclaration& declare)
{
    Solver::declare_parameters(declare);
    declare.group("pairingsWeightParameters", pairingsWeightParameters,
                  "weights, and which pairings to reject");
}

bool Solver_Horn::impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                                    const SolverContext& context) const
{
    WeightParameters wp = pairingsWeightParameters;
    if (!wp.currentEstimateForRobust)
        wp.currentEstimateForRobust = context.guessRelativePose.value_or(CPose3D());
    if (!optimal_tf_horn(pairings, wp, out, context.guessRelativePose)) return false;
    if (context.prior) refine_with_prior(pairings, wp, *context.prior, out);
    return true;
}

}  // namespace mp2p_icp
