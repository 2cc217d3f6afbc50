#pragma once

#include <mp2p_icp/Pairings.h>

#include <Eigen/Dense>
#include <vector>

namespace mp2p_icp
{
/** All that a closed form or a Gauss-Newton step needs to know of weighted point pairings (a global, b
 * local). Centred, so that coordinates far from the origin lose nothing.
 */
struct PointMoments
{
    double weight = 0;  ///< sum w
    Eigen::Vector3d a_mean = Eigen::Vector3d::Zero(), b_mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d B = Eigen::Matrix3d::Zero();   ///< sum w (a - a_mean)(b - b_mean)'
    Eigen::Matrix3d bb = Eigen::Matrix3d::Zero();  ///< sum w (b - b_mean)(b - b_mean)'
    double aa = 0;                                 ///< sum w |a - a_mean|^2

    bool usable() const { return weight > 0 && B.allFinite() && bb.allFinite() && a_mean.allFinite(); }
};

/// Two passes over the pairings, in fixed blocks. Pairs of weight 0 have no influence at all, not even with
/// NaN coordinates.
PointMoments point_moments(const MatchedPointList& pairs, const std::vector<double>& weights);

}  // namespace mp2p_icp
