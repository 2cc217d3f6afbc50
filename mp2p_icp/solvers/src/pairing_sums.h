#pragma once

#include <Eigen/Dense>
#include <optional>

#include "point_sums.h"

namespace mp2p_icp
{
using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Vector12 = Eigen::Matrix<double, 12, 1>;

/** Sums over position terms C (R b + c - q), b and q relative to the origins: with z = (b, 1),
 * K = sum w (z z') (x) C and k = sum w z (x) C q, so that sum w |C (R b + c - q)|^2 = X' K X - 2 k' X + qq,
 * where X = (columns of R, c).
 */
struct RowSums
{
    double w = 0, bb = 0;                         ///< sum w, sum w |b|^2
    Eigen::Vector3d b = Eigen::Vector3d::Zero();  ///< sum w b
    Matrix12 K = Matrix12::Zero();
    Vector12 k = Vector12::Zero();
    double qq = 0;

    RowSums& operator+=(const RowSums& o);
    void add(double weight, const ResidualTerm& relative);
};

/// Sums over directions, whose common weight is not in them yet (it depends on L).
struct DirectionSums
{
    PointSums oriented;  ///< of pairs (u_g, u_l)
    Eigen::Matrix<double, 9, 9> free =
        Eigen::Matrix<double, 9, 9>::Zero();  ///< sum w u_l u_l' (x) (I - u_g u_g')

    DirectionSums& operator+=(const DirectionSums& o);
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
    double L = 1;  ///< rms radius of the paired local points about their centroid, m; 1 if they coincide

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
