#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/optimal_tf_horn.h>

#include "point_moments.h"
#include "point_weights.h"
#include "refine_with_prior.h"

IMPLEMENTS_MRPT_OBJECT(Solver_Horn, mp2p_icp::Solver, mp2p_icp)

namespace mp2p_icp
{
void Solver_Horn::declare_parameters(ParameterDeclaration& declare)
{
    Solver::declare_parameters(declare);
    declare.group("pairingsWeightParameters", pairingsWeightParameters,
                  "weights, and which pairings to reject");
}

bool Solver_Horn::impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                                    const SolverContext& context) const
{
    const auto guess = context.guessRelativePose.value_or(mrpt::poses::CPose3D());
    WeightParameters wp = pairingsWeightParameters;
    if (!wp.currentEstimateForRobust) wp.currentEstimateForRobust = guess;
    if (!optimal_tf_horn(pairings, wp, out, guess)) return false;
    if (context.prior)
    {
        OutlierIndices outliers;
        const auto moments = point_moments(pairings.paired_pt2pt, point_weights(pairings, wp, outliers));
        out.optimalPose = refine_with_prior(moments, *context.prior, out.optimalPose);
    }
    return true;
}

}  // namespace mp2p_icp
