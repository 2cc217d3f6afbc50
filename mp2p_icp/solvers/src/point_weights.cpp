#include "point_weights.h"

#include <mp2p_icp/se3.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "point_moments.h"

namespace mp2p_icp
{
namespace
{
void apply_robust_kernel(const MatchedPointList& pairs, const WeightParameters& wp,
                         std::vector<double>& weights)
{
    if (wp.robust_kernel == RobustKernel::None) return;
    if (!wp.currentEstimateForRobust)
        throw std::invalid_argument(
            "WeightParameters: robust_kernel needs currentEstimateForRobust, the pose at which residuals are "
            "measured");
    if (!(wp.robust_kernel_param > 0))
        throw std::invalid_argument("WeightParameters: robust_kernel_param must be positive");
    const Eigen::Matrix3d R = rotation_of(*wp.currentEstimateForRobust);
    const Eigen::Vector3d t = translation_of(*wp.currentEstimateForRobust);
    for (size_t i = 0; i < pairs.size(); i++)
    {
        const double residual_sq =
            (R * to_eigen(pairs[i].local) + t - to_eigen(pairs[i].global)).squaredNorm();
        weights[i] *= robust_weight(wp.robust_kernel, residual_sq, wp.robust_kernel_param);
    }
}

void apply_scale_test(const MatchedPointList& pairs, const WeightParameters& wp, std::vector<double>& weights,
                      OutlierIndices& outliers)
{
    if (!wp.use_scale_outlier_detector) return;
    const PointMoments m = point_moments(pairs, weights);
    if (!m.usable()) return;
    for (size_t i = 0; i < pairs.size(); i++)
    {
        const double a = (to_eigen(pairs[i].global) - m.a_mean).norm(),
                     b = (to_eigen(pairs[i].local) - m.b_mean).norm();
        // max/min >= threshold, written without the division: two points at their centroids are no outlier.
        if (std::max(a, b) > 0 && std::max(a, b) >= wp.scale_outlier_threshold * std::min(a, b))
        {
            outliers.point2point.push_back(i);
            weights[i] = 0;
        }
    }
}
}  // namespace

std::vector<double> point_weights(const Pairings& in, const WeightParameters& wp, OutlierIndices& outliers)
{
    outliers = {};
    std::vector<double> weights = in.expanded_point_weights();
    for (auto& w : weights) w *= wp.pair_weights.pt2pt;
    for (const double w : weights)
        if (!(w >= 0) || w > std::numeric_limits<double>::max())
            throw std::invalid_argument("weights of pairings must be finite and not negative");
    apply_robust_kernel(in.paired_pt2pt, wp, weights);
    apply_scale_test(in.paired_pt2pt, wp, weights, outliers);
    return weights;
}

}  // namespace mp2p_icp
