#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/se3.h>

#include <cmath>
#include <iostream>
#include <stdexcept>

#include "closed_form.h"
#include "gauss_newton_problem.h"
#include "nearest_to_guess.h"
#include "pairing_sums.h"

namespace mp2p_icp
{
namespace
{
using mrpt::poses::CPose3D;

/// Damping, relative to H: where it begins, below which it is dropped, and where it gives up.
constexpr double FIRST_DAMPING = 1e-3, LEAST_DAMPING = 1e-6, MOST_DAMPING = 1e12;
/// Costs are equal if they differ by no more than the rounding of a sum of squares, and of residuals: some
/// 1e-15 of the size of the scene each, relative to their own size.
constexpr double EQUAL_COST = 1e-13, RESIDUAL_ROUNDING = 1e-14;

CPose3D start_of(PreparedPairings& in, const OptimalTF_GN_Parameters& p)
{
    CPose3D start = p.linearizationPoint.value_or(p.prior ? p.prior->mean : CPose3D());
    if (!is_finite(start))
        throw std::invalid_argument(
            "optimal_tf_gauss_newton: the start (linearizationPoint or prior.mean) "
            "must be finite");
    if (!p.linearizationPoint) solve_globally(in, start, start);
    return start;
}

void print(const GaussNewtonReport& report, double cost, double step_norm, double damping)
{
    std::cout << "[optimal_tf_gauss_newton] step " << report.iterations << ": cost " << cost << " m^2, step "
              << step_norm << ", damping " << damping << "\n";
}

/// From `pose`, to where it ends.
class Descent
{
 public:
    Descent(const GaussNewtonProblem& problem, const OptimalTF_GN_Parameters& p, double L,
            const OriginPose& start)
        : problem_(problem), p_(p), L_(L), pose_(start), at_(problem.linearise(start))
    {
    }

    const OriginPose& pose() const { return pose_; }
    const Linearised& at() const { return at_; }

    void run(GaussNewtonReport& report)
    {
        for (;;)
        {
            report.end = GaussNewtonEnd::CostReached;
            if (std::sqrt(at_.cost) <= p_.maxCost) return;
            report.end = GaussNewtonEnd::MaxIterations;
            if (report.iterations == p_.maxInnerLoopIterations) return;
            const bool lower = step();
            report.end = GaussNewtonEnd::SmallStep;
            if (lower) report.iterations++;
            if (lower && p_.verbose) print(report, at_.cost, step_norm_, damping_);
            if (step_norm_ < p_.minDelta) return;
            report.end = GaussNewtonEnd::NoDescent;
            if (!lower) return;
        }
    }

 private:
    /// One step, damped as far as needed. \return false if none lowers the cost; then nothing changed.
    bool step()
    {
        for (; damping_ <= MOST_DAMPING; damping_ = std::max(10 * damping_, FIRST_DAMPING))
        {
            const Vector6 scaled = least_squares_step(at_, damping_);
            step_norm_ = std::hypot(scaled.head<3>().norm(), scaled.tail<3>().norm() / L_);
            const OriginPose next = problem_.moved(pose_, scaled);
            const Linearised there = problem_.linearise(next);
            if (there.cost <= at_.cost * (1 + EQUAL_COST) + residual_rounding(next))
            {
                pose_ = next, at_ = there;
                damping_ = damping_ > LEAST_DAMPING ? 0.1 * damping_ : 0.0;
                return true;
            }
            if (step_norm_ < p_.minDelta) return false;
        }
        return false;
    }

    /// What rounding of the residuals makes of the cost.
    double residual_rounding(const OriginPose& pose) const
    {
        const double rounding = RESIDUAL_ROUNDING * (L_ + pose.c.norm());
        return rounding * std::sqrt(at_.cost * at_.H.topLeftCorner<3, 3>().trace());
    }

    const GaussNewtonProblem& problem_;
    const OptimalTF_GN_Parameters& p_;
    const double L_;
    OriginPose pose_;
    Linearised at_;
    double damping_ = 0, step_norm_ = 0;
};
}  // namespace

std::string to_string(GaussNewtonEnd end)
{
    switch (end)
    {
        case GaussNewtonEnd::SmallStep:
            return "small step";
        case GaussNewtonEnd::CostReached:
            return "cost reached";
        case GaussNewtonEnd::MaxIterations:
            return "max iterations";
        case GaussNewtonEnd::NoDescent:
            return "no descent";
        default:
            return "no usable pairing";
    }
}

CPose3D descend(const PreparedPairings& in, const OptimalTF_GN_Parameters& parameters, const CPose3D& start,
                GaussNewtonReport& report)
{
    const GaussNewtonProblem problem(in, parameters);
    const CentredPairings& about = problem.centred();
    Descent descent(problem, parameters, about.L, relative_to(about.global_mean, about.local_mean, start));
    const Linearised& at = descent.at();
    report.end = GaussNewtonEnd::NoUsablePairing;
    if (!std::isfinite(at.cost) || !at.H.allFinite() || rank_of(at.H) == 0) return start;
    descent.run(report);
    report.rank = rank_of(at.H), report.cost = at.cost;
    return absolute(about.global_mean, about.local_mean, descent.pose());
}

namespace
{
/// The pairings with what the kernel leaves of their weights at a pose.
PreparedPairings left_by_kernel(const PreparedPairings& in, const OptimalTF_GN_Parameters& p,
                                const CPose3D& pose)
{
    if (p.kernel == RobustKernel::None) return in;
    std::vector<double> factors = squared_residuals(in, pose);
    for (double& f : factors) f = robust_weight(p.kernel, f, p.kernelParam);
    return in.with_factors(factors);
}
}  // namespace

bool optimal_tf_gauss_newton(const Pairings& pairings, OptimalTF_Result& result,
                             const OptimalTF_GN_Parameters& parameters, GaussNewtonReport* report)
{
    PreparedPairings in(pairings, parameters.pairWeights);
    return gauss_newton(in, parameters, result, report);
}

bool gauss_newton(PreparedPairings& in, const OptimalTF_GN_Parameters& parameters, OptimalTF_Result& result,
                  GaussNewtonReport* report)
{
    GaussNewtonReport own;
    GaussNewtonReport& out = report ? *report : own;
    out = {}, result.status = SolveStatus::NoPairings, result.rank = 0, result.free.clear();
    if (parameters.kernel != RobustKernel::None && !(parameters.kernelParam > 0))
        throw std::invalid_argument("optimal_tf_gauss_newton: kernelParam must be positive");
    const bool usable = pairing_sums(in).weight(in) > 0;  // also drops what is not finite
    out.skipped = result.skipped = in.skipped();
    const CPose3D start = start_of(in, parameters);
    if (!usable) return false;
    CPose3D pose = descend(in, parameters, start, out);
    if (out.end == GaussNewtonEnd::NoUsablePairing) return false;
    const PreparedPairings left = left_by_kernel(in, parameters, pose);
    if (out.rank < 6 && !parameters.prior) pose = nearest_to_guess(left, pose, start);
    result.optimalPose = pose, result.optimalScale = 1.0, result.outliers = {};
    describe_pose(left, parameters.sigma, result);
    return true;
}

}  // namespace mp2p_icp
