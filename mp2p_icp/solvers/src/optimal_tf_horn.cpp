#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/se3.h>

#include <cmath>
#include <stdexcept>

#include "horn_rotation.h"
#include "point_moments.h"
#include "point_weights.h"

namespace mp2p_icp
{
namespace
{
/// Do the points coincide, but for the rounding of their mean? Then their directions from it mean nothing.
bool coincide(double spread_sq, double weight, const Eigen::Vector3d& mean)
{
    return std::sqrt(spread_sq / weight) <=
           1e-12 * mean.norm();  // sums of blocks of 1024: up to some 1000 units of rounding
}

Eigen::Matrix3d best_rotation(const PointMoments& m, const Eigen::Matrix3d& guess)
{
    if (coincide(m.aa, m.weight, m.a_mean) || coincide(m.bb.trace(), m.weight, m.b_mean)) return guess;
    return horn_rotation(m.B, std::sqrt(m.aa * m.bb.trace()), guess);
}
}  // namespace

bool optimal_tf_horn(const Pairings& in, const WeightParameters& wp_in, OptimalTF_Result& result,
                     const mrpt::poses::CPose3D& guess)
{
    if (in.size() != in.paired_pt2pt.size())
        throw std::invalid_argument("optimal_tf_horn: takes point-point pairings only, got " +
                                    in.contents_summary());
    WeightParameters wp = wp_in;
    if (!wp.currentEstimateForRobust) wp.currentEstimateForRobust = guess;
    OutlierIndices outliers;
    const auto weights = point_weights(in, wp, outliers);
    const PointMoments m = point_moments(in.paired_pt2pt, weights);
    if (!m.usable()) return false;
    const Eigen::Matrix3d R = best_rotation(m, rotation_of(guess));
    result.optimalPose = make_pose(R, m.a_mean - R * m.b_mean);
    result.optimalScale = 1.0;
    result.outliers = outliers;
    return true;
}

}  // namespace mp2p_icp
