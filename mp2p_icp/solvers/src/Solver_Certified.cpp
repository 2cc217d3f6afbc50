#include <mp2p_icp/Solver_Certified.h>
#include <mp2p_icp/optimal_tf_certified.h>

IMPLEMENTS_MRPT_OBJECT(Solver_Certified, mp2p_icp::Solver, mp2p_icp)

namespace mp2p_icp
{
void Solver_Certified::declare_parameters(ParameterDeclaration& declare)
{
    Solver::declare_parameters(declare);
    declare.group("pairingsWeightParameters", pairingsWeightParameters,
                  "weights, and which pairings to reject");
    declare.number(
        "tolerance", tolerance, "", Range::open(0, 1),
        "largest gap that counts as proof of the optimum, relative to the cost of typical rotations");
    declare.flag(
        "requireProof", requireProof,
        "gives no pose unless it is proven to be the best of all; the next solver of the list has its turn");
}

bool Solver_Certified::impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                                         const SolverContext& context) const
{
    CertifiedParameters p;
    p.weights = pairingsWeightParameters, p.tolerance = tolerance;
    p.guess = context.guessRelativePose, p.prior = context.prior;
    if (!p.weights.currentEstimateForRobust)
        p.weights.currentEstimateForRobust = context.guessRelativePose.value_or(mrpt::poses::CPose3D());
    CertifiedResult result;
    result.optimalPose = out.optimalPose;
    if (!optimal_tf_certified(pairings, result, p)) return false;
    if (requireProof && result.verdict == GlobalVerdict::Gap) return false;
    out = result;
    return true;
}

}  // namespace mp2p_icp
