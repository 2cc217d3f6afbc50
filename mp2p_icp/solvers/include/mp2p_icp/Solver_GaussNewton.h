#pragma once

#include <mp2p_icp/Solver.h>
#include <mp2p_icp/WeightParameters.h>

namespace mp2p_icp
{
/** optimal_tf_gauss_newton() as a step of a pipeline: from the current estimate (the closed form without
 * one), with the prior if there is one, on pairings of all kinds. A weight of 1 then stands for 1/m^2.
 */
class Solver_GaussNewton : public Solver
{
    DEFINE_MRPT_OBJECT(Solver_GaussNewton, mp2p_icp)

 public:
    Solver_GaussNewton() { mrpt::system::COutputLogger::setLoggerName("Solver_GaussNewton"); }

    uint32_t maxIterations = 5;  ///< steps per call
    PairWeights pairWeights;
    RobustKernel robustKernel = RobustKernel::None;
    Formula robustKernelParam = 1.0;  ///< scale of the kernel, m
    bool innerLoopVerbose = false;    ///< one line per step to the console

    void declare_parameters(ParameterDeclaration& declare) override;

 protected:
    /// \exception std::runtime_error if robustKernelParam is not positive, or uses unknown variables.
    bool impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                           const SolverContext& context) const override;
};

}  // namespace mp2p_icp
