#pragma once

#include <mp2p_icp/Solver.h>
#include <mp2p_icp/WeightParameters.h>

namespace mp2p_icp
{
/** optimal_tf_certified() as a step of a pipeline: the best of all poses for the pairings of this iteration,
 * whatever the current estimate. That chooses among poses that fit equally well, and is kept along free
 * motions. A prior enters as rows like any other. A pose whose optimality is not proven is returned all the
 * same unless `requireProof` is set.
 */
class Solver_Certified : public Solver
{
    DEFINE_MRPT_OBJECT(Solver_Certified, mp2p_icp)

 public:
    Solver_Certified() { mrpt::system::COutputLogger::setLoggerName("Solver_Certified"); }

    WeightParameters pairingsWeightParameters;
    double tolerance = 1e-9;  ///< see CertifiedParameters
    bool requireProof =
        false;  ///< gives no pose when the verdict is GlobalVerdict::Gap: the next solver's turn

    void declare_parameters(ParameterDeclaration& declare) override;

 protected:
    bool impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                           const SolverContext& context) const override;
};

}  // namespace mp2p_icp
