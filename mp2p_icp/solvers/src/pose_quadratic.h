#pragma once

#include <Eigen/Dense>

#include "pairing_sums.h"

namespace mp2p_icp
{
using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Vector12 = Eigen::Matrix<double, 12, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A pose as its rotation and where it puts the local origin, relative to the global origin.
struct OriginPose
{
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d c = Eigen::Vector3d::Zero();
};
OriginPose relative_to(const Eigen::Vector3d& a_origin, const Eigen::Vector3d& b_origin,
                       const mrpt::poses::CPose3D& pose);
mrpt::poses::CPose3D absolute(const Eigen::Vector3d& a_origin, const Eigen::Vector3d& b_origin,
                              const OriginPose& pose);

/** The cost of all pairings as one quadratic, X' K X - 2 k' X + qq with X = (columns of R, c), c being where
 * the centroid of the local positions goes, relative to that of the global ones. It has no sign rule: free
 * directions enter as w (1 - (u_g' R u_l)^2).
 */
struct PoseQuadratic
{
    Matrix12 K = Matrix12::Zero();
    Vector12 k = Vector12::Zero();
    double qq = 0;
    double L = 1;  ///< m
    Eigen::Vector3d a_centre = Eigen::Vector3d::Zero(),
                    b_centre = Eigen::Vector3d::Zero();  ///< in their frames

    double cost(const OriginPose& pose) const;
    /** The information J' K J in (v, omega L): v the velocity of the centroid, omega the angular one, both
     * along global axes. One unit is that of a weight, 1/m^2 times m^2.
     */
    Matrix6 information(const Eigen::Matrix3d& R) const;
    /** The c of least cost at R; along what no position determines (information below 1e-10 of the largest),
     * that of `kept`.
     */
    Eigen::Vector3d best_translation(const Eigen::Matrix3d& R, const Eigen::Vector3d& kept) const;
};

PoseQuadratic pose_quadratic(const PairingSums& sums, const PreparedPairings& of);

}  // namespace mp2p_icp
