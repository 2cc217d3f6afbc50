#include <mp2p_icp/Solver_OLAE.h>
#include <mp2p_icp/optimal_tf_olae.h>

#include "weighted_closed_form.h"

IMPLEMENTS_MRPT_OBJECT(Solver_OLAE, mp2p_icp::Solver, mp2p_icp)

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

void Solver_OLAE::declare_parameters(ParameterDeclaration& declare)
{
    Solver::declare_parameters(declare);
    declare.group("pairingsWeightParameters", pairingsWeightParameters,
                  "weights, and which pairings to reject");
    declare.choice<OlaeSystem>("system", parameters.system, "OlaeSystem",
                               {{OlaeSystem::Report, "Report"},
                                {OlaeSystem::LeastSquares, "LeastSquares"},
                                {OlaeSystem::Newton, "Newton"}},
                               "which linear system gives the rotation");
    declare.flag("normalize_points", parameters.normalize_points,
                 "points count by their directions from the centroid only, as in the report");
}

bool Solver_OLAE::impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                                    const SolverContext& context) const
{
    WeightParameters wp = pairingsWeightParameters;
    if (!wp.currentEstimateForRobust)
        wp.currentEstimateForRobust = context.guessRelativePose.value_or(CPose3D());
    if (!optimal_tf_olae(pairings, wp, out, context.guessRelativePose, parameters)) return false;
    if (context.prior) refine_with_prior(pairings, wp, *context.prior, out);
    return true;
}

}  // namespace mp2p_icp
