#pragma once

#include <mp2p_icp/Solver.h>
#include <mp2p_icp/WeightParameters.h>
#include <mp2p_icp/optimal_tf_olae.h>

namespace mp2p_icp
{
/** optimal_tf_olae() as a step of a pipeline, at the current estimate. With a prior, the closed form starts a
 * few Gauss-Newton steps on the cost of all pairings plus the prior's: (pose - mean)' Lambda (pose - mean),
 * in the prior's coordinates (x y z yaw pitch roll). A pairing weight of 1 then stands for 1/m^2, that is,
 * for a standard deviation of 1 m per axis.
 */
class Solver_OLAE : public Solver
{
    DEFINE_MRPT_OBJECT(Solver_OLAE, mp2p_icp)

 public:
    Solver_OLAE() { mrpt::system::COutputLogger::setLoggerName("Solver_OLAE"); }

    WeightParameters pairingsWeightParameters;
    OlaeParameters parameters;

    void declare_parameters(ParameterDeclaration& declare) override;

 protected:
    bool impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                           const SolverContext& context) const override;
};

}  // namespace mp2p_icp
