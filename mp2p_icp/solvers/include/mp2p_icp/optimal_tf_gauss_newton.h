#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>

#include <optional>
#include <string>

namespace mp2p_icp
{
struct OptimalTF_GN_Parameters
{
    /// Where to start. Empty: the pose of least squares over all rotations (Horn's for points alone, a search
    /// on sums otherwise; free motions from the prior's mean or the identity).
    std::optional<mrpt::poses::CPose3D> linearizationPoint;

    /// Adds e' Lambda e to the cost, e = coordinates(pose) - coordinates(mean), in the prior's coordinates
    /// (x y z yaw pitch roll). A weight of 1 then stands for 1/m^2.
    std::optional<mrpt::poses::CPose3DPDFGaussianInf> prior;

    double minDelta = 1e-7;  ///< stop after a step (m of the local points' mean, rad) of a norm below this
    double maxCost = 0;      ///< stop once the root of the cost is not above this, m

    PairWeights pairWeights;

    uint32_t maxInnerLoopIterations = 6;  ///< steps, each at a new linearization

    RobustKernel kernel = RobustKernel::None;
    double kernelParam = 1.0;  ///< scale of the kernel, m

    /// Standard deviation of a residual of weight 1, m; only for the predicted deviations of free motions.
    /// Empty: from the residuals.
    std::optional<double> sigma;

    bool verbose = false;  ///< one line per step to the console
};

/// Why optimal_tf_gauss_newton() ended.
enum class GaussNewtonEnd : uint8_t
{
    NoUsablePairing,  ///< none with a positive weight and finite numbers, or the kernel gives all of them 0
    SmallStep,        ///< the last step was below minDelta: converged
    CostReached,      ///< maxCost was reached
    MaxIterations,    ///< the pose after maxInnerLoopIterations steps
    NoDescent         ///< no step, however damped, lowers the cost: the pose before it
};
/// Such as `small step`.
std::string to_string(GaussNewtonEnd end);

/// How it went.
struct GaussNewtonReport
{
    GaussNewtonEnd end = GaussNewtonEnd::NoUsablePairing;
    uint32_t iterations = 0;  ///< steps made
    size_t skipped = 0;  ///< pairings left out for numbers that are not finite, or a direction of length 0
    int rank = 0;        ///< how many degrees of freedom the pairings determine where it ended (no prior)
    double cost = 0;     ///< where it ended, m^2
};

/** The pose, near a start, that minimises sum w_i rho(|r_i|^2), plus the prior's cost, over pairings of all
 * five kinds:
 *
 *  - point-point `R p + t - q`; point-line and point-plane: the part of that across the line or along the
 *    normal;
 *  - line-line: the local base point against the global line, and the direction, as PairWeights says: of no
 *    sign by default, sin(angle);
 *  - plane-plane: the local centroid against the global plane, and the normal, oriented by default:
 *    `R n_l - n_g`.
 *
 * w_i are the weights of PairWeights times the pairings' own. rho is the kernel's loss; it sees the whole
 * residual of a pairing in m, both parts of lines and planes (the direction times the root of the ratio of
 * the weights: times L by default).
 *
 * Gauss-Newton steps (v, omega) on SE(3) about the local positions' mean, reweighted by the kernel, with
 * Levenberg damping where a step would raise the cost. Motions whose information is below 1e-10 of the
 * largest, in units where a rotation of 1 rad counts as L metres, are free: no step goes along them unless
 * the prior asks for it, so the start is kept. It finds the minimum whose basin the start is in.
 *
 * \return false (pose unchanged, reason in `report`) if there is no usable pairing. \exception
 * std::invalid_argument for a negative weight, a start that is not finite, and a scale of a kernel that is
 * not positive. The same bits on any number of threads. Cost: O(N) per step.
 */
bool optimal_tf_gauss_newton(const Pairings& in, OptimalTF_Result& result,
                             const OptimalTF_GN_Parameters& parameters = {},
                             GaussNewtonReport* report = nullptr);

}  // namespace mp2p_icp
