#pragma once

#include <Eigen/Dense>
#include <optional>

#include "point_sums.h"

namespace mp2p_icp
{
/// The upper triangle of a symmetric 3x3 matrix: 00 01 02 11 12 22.
using Packed3 = Eigen::Matrix<double, 6, 1>;
inline Packed3 packed(const Eigen::Matrix3d& C)
{
    return (Packed3() << C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2)).finished();
}
template <class Column>
Eigen::Matrix3d unpacked(const Column& c)
{
    return (Eigen::Matrix3d() << c(0), c(1), c(2), c(1), c(3), c(4), c(2), c(4), c(5)).finished();
}

/** Sums over position terms C (R b + c - q), b and q relative to the origins: with z = (b, 1), those of (z
 * z') (x) C and of z (x) C q, so that sum w |C (R b + c - q)|^2 is a quadratic in (columns of R, c); see
 * PoseQuadratic.
 */
struct RowSums
{
    double w = 0, bb = 0;                         ///< sum w, sum w |b|^2
    Eigen::Vector3d b = Eigen::Vector3d::Zero();  ///< sum w b
    /// A column of sum w z_j z_l C for each (j, l), l <= j: 00 10 11 20 21 22 30 31 32 33.
    Eigen::Matrix<double, 6, 10> zzC = Eigen::Matrix<double, 6, 10>::Zero();
    Eigen::Matrix<double, 3, 4> zCq = Eigen::Matrix<double, 3, 4>::Zero();  ///< sum w C q z'
    double qq = 0;                                                          ///< sum w q' C q

    RowSums& operator+=(const RowSums& o);
};

/// Sums over directions, whose common weight is not in them yet (it depends on L).
struct DirectionSums
{
    PointSums oriented;  ///< of pairs (u_g, u_l)
    /// Of free ones: a column of sum w u_j u_l (I - u_g u_g') for each (j, l) of the local direction, packed
    /// as C is.
    Eigen::Matrix<double, 6, 6> free = Eigen::Matrix<double, 6, 6>::Zero();

    DirectionSums& operator+=(const DirectionSums& o);
    double weight() const;  ///< sum of the weights
};

/// All that solvers need to know of pairings; what comes after does not depend on their number.
struct PairingSums
{
    Eigen::Vector3d a_origin = Eigen::Vector3d::Zero(),
                    b_origin = Eigen::Vector3d::Zero();  ///< global, local
    Eigen::Vector3d a_mean = Eigen::Vector3d::Zero(),
                    b_mean = Eigen::Vector3d::Zero();  ///< of the point pairings, relative to the origins
    PointSums points;                                  ///< about their means
    struct Others
    {
        RowSums point_rows;  ///< points on lines and planes
        RowSums base_rows;   ///< base points of lines, centroids of planes
        DirectionSums lines, planes;
        Others& operator+=(const Others& o);
    };
    std::optional<Others> others;  ///< only if there are such pairings
    double radius = 0;  ///< rms radius of the paired local points about their centroid, m; 0 if they coincide

    /// What turns rad into m.
    double L() const { return radius > 0 ? radius : 1; }

    /// Are all numbers finite, and those of the points far from overflow?
    bool usable() const;
    /// Sum of the weights of all positions and directions.
    double weight(const PreparedPairings& of) const;
};

/** One pass over all pairings, in fixed blocks: the same bits on any number of threads. Pairings that are not
 * finite are dropped from `in` if there are any.
 */
PairingSums pairing_sums(PreparedPairings& in);

}  // namespace mp2p_icp
