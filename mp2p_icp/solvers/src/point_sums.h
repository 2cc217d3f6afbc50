#pragma once

#include <mp2p_icp/Pairings.h>

#include <Eigen/Dense>
#include <optional>

#include "prepared_pairings.h"

namespace mp2p_icp
{
/// Sums over weighted pairs of vectors (a global, b local), each relative to an origin on its side.
struct PointSums
{
    double w = 0;
    Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();    ///< sum w a, sum w b
    Eigen::Matrix3d B = Eigen::Matrix3d::Zero();                                 ///< sum w a b'
    Eigen::Matrix3d aa = Eigen::Matrix3d::Zero(), bb = Eigen::Matrix3d::Zero();  ///< sum w a a', sum w b b'

    PointSums& operator+=(const PointSums& o);
    PointSums& operator*=(double factor);
    /// Adds one pair.
    void add(double weight, const Eigen::Vector3d& a_, const Eigen::Vector3d& b_);

    /// Makes them sums about the means, which are told. No change without weight.
    void centre(Eigen::Vector3d& a_mean, Eigen::Vector3d& b_mean);
    /// Are all numbers finite, and far from overflow?
    bool usable() const;
};

/** What is subtracted from the points before they are summed: a point of the data (exactly, since data of one
 * size and grid have exact differences); for unit vectors, then the centroid relative to it.
 */
struct PointOrigin
{
    Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
    Eigen::Vector3d a_mean = Eigen::Vector3d::Zero(), b_mean = Eigen::Vector3d::Zero();
    double shortest_sq = 0;  ///< for unit vectors, m^2: vectors that are not longer have no direction
};

/// One pass over the points, in fixed blocks: the same bits on any number of threads. All pairs must be
/// finite (else the sums are not).
PointSums point_sums(const MatchedPointList& pairs, const ListWeights& weights, const PointOrigin& origin);
/// The weight and the second moments (no others) of the unit vectors (point - origin - mean) / |...|; without
/// `with_squares`, B and the traces of aa and bb only.
PointSums unit_vector_sums(const MatchedPointList& pairs, const ListWeights& weights,
                           const PointOrigin& origin, bool with_squares);

}  // namespace mp2p_icp
