#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/se3.h>

#include <cmath>
#include <iostream>
#include <stdexcept>

#include "gauss_newton_problem.h"

namespace mp2p_icp
{
namespace
{
using mrpt::poses::CPose3D;

/// Damping, relative to H: where it begins, below which it is dropped, and where it gives up.
constexpr double FIRST_DAMPING = 1e-3, LEAST_DAMPING = 1e-6, MOST_DAMPING = 1e12;
/// A cost higher by no more than this part is equal: sums of squares round at some 1e-14.
constexpr double EQUAL_COST = 1e-13;

/// The closed form on the points; false if they are of no use for it.
bool start_from_points(const WeightedPairings& in, const CPose3D& guess, CPose3D& start)
{
    Pairings points;
    points.paired_pt2pt = in.pairings.paired_pt2pt;
    for (size_t i = 0; i < points.paired_pt2pt.size(); i++)
        points.point_weights.emplace_back(1, in.weights[i]);
    OptimalTF_Result closed_form;
    if (!optimal_tf_horn(points, {}, closed_form, guess)) return false;
    start = closed_form.optimalPose;
    return true;
}

CPose3D start_of(const WeightedPairings& in, const OptimalTF_GN_Parameters& p)
{
    CPose3D start = p.linearizationPoint.value_or(p.prior ? p.prior->mean : CPose3D());
    if (!is_finite(start))
        throw std::invalid_argument(
            "optimal_tf_gauss_newton: the start (linearizationPoint or prior.mean) "
            "must be finite");
    if (!p.linearizationPoint) start_from_points(in, start, start);
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
            const CentredPose& start)
        : problem_(problem), p_(p), L_(L), pose_(start), at_(problem.linearise(start))
    {
    }

    const CentredPose& pose() const { return pose_; }
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
            const CentredPose next = problem_.moved(pose_, scaled);
            const Linearised there = problem_.linearise(next);
            if (there.cost <= at_.cost * (1 + EQUAL_COST))
            {
                pose_ = next, at_ = there;
                damping_ = damping_ > LEAST_DAMPING ? 0.1 * damping_ : 0.0;
                return true;
            }
            if (step_norm_ < p_.minDelta) return false;
        }
        return false;
    }

    const GaussNewtonProblem& problem_;
    const OptimalTF_GN_Parameters& p_;
    const double L_;
    CentredPose pose_;
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

bool optimal_tf_gauss_newton(const Pairings& in, OptimalTF_Result& result,
                             const OptimalTF_GN_Parameters& parameters, GaussNewtonReport* report)
{
    GaussNewtonReport own;
    GaussNewtonReport& out = report ? *report : own;
    out = {};
    const WeightedPairings weighted(in, parameters.pairWeights);
    const GaussNewtonProblem problem(weighted, parameters);
    out.skipped = weighted.skipped;
    const CPose3D start = start_of(weighted, parameters);
    if (!(weighted.weight_sum > 0)) return false;
    Descent descent(problem, parameters, weighted.L, centred(start, weighted));
    const Linearised& at = descent.at();
    if (!std::isfinite(at.cost) || !at.H.allFinite() || rank_of(at.H) == 0) return false;
    descent.run(out);
    out.rank = rank_of(at.H), out.cost = at.cost;
    result.optimalPose = uncentred(descent.pose(), weighted);
    result.optimalScale = 1.0;
    result.outliers = {};
    return true;
}

}  // namespace mp2p_icp
