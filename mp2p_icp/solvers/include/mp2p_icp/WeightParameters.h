#pragma once

#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/robust_kernels.h>
#include <mrpt/poses/CPose3D.h>

#include <optional>

namespace mp2p_icp
{
/// Weights of the kinds of pairings: factors on squared residuals, dimensionless, not negative.
struct PairWeights : public Parameterizable
{
    double pt2pt = 1, pt2ln = 1, pt2pl = 1, ln2ln = 1, pl2pl = 1;

    void declare_parameters(ParameterDeclaration& declare) override;
};

/// How a closed-form solver weighs and rejects pairings.
struct WeightParameters : public Parameterizable
{
    /** Rejects point pairings by the scale test of the OLAE-ICP report, eq. (3): a and b being the two points
     * relative to the centroids, max(|a|,|b|) / min(|a|,|b|) >= scale_outlier_threshold is an outlier.
     */
    bool use_scale_outlier_detector = false;
    double scale_outlier_threshold = 1.20;

    PairWeights pair_weights;

    RobustKernel robust_kernel = RobustKernel::None;
    double robust_kernel_param = 1.0;  ///< scale of the kernel, m

    /// Where residuals for the kernel are measured. Solvers set it to the current estimate.
    std::optional<mrpt::poses::CPose3D> currentEstimateForRobust;

    void declare_parameters(ParameterDeclaration& declare) override;
};

}  // namespace mp2p_icp
