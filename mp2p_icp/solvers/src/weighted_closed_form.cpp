#include "weighted_closed_form.h"

#include <mp2p_icp/consistency_graph.h>
#include <mp2p_icp/scale_test.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <stdexcept>

#include "gauss_newton_problem.h"
#include "gnc.h"
#include "nearest_to_guess.h"

namespace mp2p_icp
{
namespace
{
using mrpt::poses::CPose3D;

bool uses_gnc(const WeightParameters& wp)
{
    return wp.outlier_rejection == OutlierRejection::GncGemanMcClure ||
           wp.outlier_rejection == OutlierRejection::GncTruncated;
}

void check(const WeightParameters& wp, const std::optional<CPose3D>& guess)
{
    if (guess && !is_finite(*guess)) throw std::invalid_argument("the guess must be finite");
    if (wp.robust_kernel != RobustKernel::None)
    {
        if (!wp.currentEstimateForRobust && !guess)
            throw std::invalid_argument(
                "WeightParameters: robust_kernel needs currentEstimateForRobust (or a guess), the pose at "
                "which "
                "residuals are measured");
        if (!(wp.robust_kernel_param > 0))
            throw std::invalid_argument("WeightParameters: robust_kernel_param must be positive");
    }
    if (wp.outlier_rejection != OutlierRejection::None &&
        !(wp.outlier_threshold > 0 && wp.outlier_threshold < 1e30))
        throw std::invalid_argument(
            "WeightParameters: outlier_threshold must be positive, and less than 1e30 m");
}

/// Of the point pairings: 1 for the kept indices, 0 and a note for the others.
void keep_points(const std::vector<size_t>& kept, PreparedPairings& in, OutlierIndices& outliers)
{
    size_t next = 0;
    for (size_t i = 0; i < in.pairings().paired_pt2pt.size(); i++)
    {
        if (next < kept.size() && kept[next] == i)
        {
            next++;
            continue;
        }
        const PairingId id{PairingKind::Point2Point, i};
        if (in.weight(id) > 0) in.note_outlier(id, outliers);
        in.scale_weight(id, 0);
    }
}

/// The report's eq. (3), at the centroids of all points.
std::vector<size_t> scale_ratio_inliers(PreparedPairings& in, double largest_ratio)
{
    const PairingSums sums = pairing_sums(in);
    std::vector<size_t> kept;
    const auto& pairs = in.pairings().paired_pt2pt;
    const Eigen::Vector3d a_mean = sums.a_mean, b_mean = sums.b_mean;
    for (size_t i = 0; i < pairs.size(); i++)
    {
        const double a = (to_eigen(mrpt::math::TPoint3D(pairs[i].global)) - sums.a_origin - a_mean).norm(),
                     b = (to_eigen(mrpt::math::TPoint3D(pairs[i].local)) - sums.b_origin - b_mean).norm();
        // max/min >= threshold, written without the division: two points at their centroids are no outlier.
        const bool outlier = std::max(a, b) > 0 && std::max(a, b) >= largest_ratio * std::min(a, b);
        if (!outlier) kept.push_back(i);
    }
    return kept;
}

/// The kernel's factors on the weights, and none for the outliers of all methods but graduated non-convexity.
void weigh_and_reject(const WeightParameters& wp, const std::optional<CPose3D>& guess, PreparedPairings& in,
                      OutlierIndices& outliers)
{
    check(wp, guess);
    if (!outliers.empty()) outliers = {};
    const bool plain = wp.robust_kernel == RobustKernel::None && !wp.use_scale_outlier_detector &&
                       wp.outlier_rejection == OutlierRejection::None;
    if (plain) return;
    in.drop_unusable();
    if (in.size() == 0) return;
    if (wp.robust_kernel != RobustKernel::None)
    {
        std::vector<double> factors =
            squared_residuals(in, wp.currentEstimateForRobust ? *wp.currentEstimateForRobust : *guess);
        for (size_t i = 0; i < factors.size(); i++)
            in.scale_weight(pairing_id(in.pairings(), i),
                            robust_weight(wp.robust_kernel, factors[i], wp.robust_kernel_param));
    }
    const MatchedPointList& points = in.pairings().paired_pt2pt;
    if (wp.use_scale_outlier_detector && !points.empty())
        keep_points(scale_ratio_inliers(in, wp.scale_outlier_threshold), in, outliers);
    if (wp.outlier_rejection == OutlierRejection::NoiseScale)
        keep_points(noise_scale_inliers(points, wp.outlier_threshold), in, outliers);
    if (wp.outlier_rejection == OutlierRejection::ConsistencyGraph)
        keep_points(consistency_graph_inliers(points, {2 * wp.outlier_threshold}), in, outliers);
    std::sort(outliers.point2point.begin(),
              outliers.point2point.end());  // two tests may have found some each
}
}  // namespace

bool solve_weighted(const Pairings& pairings, const WeightParameters& wp, const std::optional<CPose3D>& guess,
                    const WeightedSolver& solve, OptimalTF_Result& result)
{
    PreparedPairings in(pairings, wp.pair_weights);
    weigh_and_reject(wp, guess, in, result.outliers);
    if (!uses_gnc(wp)) return solve(in, result);
    return solve_gnc(in, wp.outlier_rejection, wp.outlier_threshold, solve, result);
}

bool solve_weighted(const Pairings& pairings, const WeightParameters& wp, const ClosedForm& how,
                    OptimalTF_Result& result)
{
    ClosedForm from_last = how;
    std::optional<PreparedPairings> last;
    const auto solve = [&](PreparedPairings& weighted, OptimalTF_Result& out)
    {
        const bool solved = solve_closed_form(weighted, from_last, out);
        if (solved) from_last.guess = out.optimalPose, last = weighted;
        return solved;
    };
    if (!solve_weighted(pairings, wp, how.guess, solve, result)) return false;
    // Along what the inliers leave free, not where outliers had it.
    if (uses_gnc(wp) && result.status != SolveStatus::Determined)
        result.optimalPose = nearest_to_guess(*last, result.optimalPose, how.guess.value_or(CPose3D()));
    return true;
}

void refine_with_prior(const Pairings& pairings, const WeightParameters& wp,
                       const mrpt::poses::CPose3DPDFGaussianInf& prior, OptimalTF_Result& result)
{
    PreparedPairings in(pairings, wp.pair_weights);
    OutlierIndices outliers = result.outliers, again;
    weigh_and_reject(wp, result.optimalPose, in, again);
    if (uses_gnc(wp))
    {
        const auto squares = squared_residuals(in, result.optimalPose);
        for (size_t i = 0; i < squares.size(); i++)
            if (squares[i] > wp.outlier_threshold * wp.outlier_threshold)
                in.scale_weight(pairing_id(in.pairings(), i), 0);
    }
    OptimalTF_GN_Parameters p;
    p.linearizationPoint = result.optimalPose, p.prior = prior, p.sigma = wp.sigma;
    p.minDelta = 1e-12, p.maxInnerLoopIterations = 50;
    OptimalTF_Result refined = result;
    if (gauss_newton(in, p, refined))
        result = refined;  // else all are outliers, and there is nothing to refine
    result.outliers = outliers;
}

}  // namespace mp2p_icp
