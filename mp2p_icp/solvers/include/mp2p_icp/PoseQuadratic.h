#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>
#include <mrpt/serialization/CArchive.h>

#include <Eigen/Dense>

namespace mp2p_icp
{
using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Vector12 = Eigen::Matrix<double, 12, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A pose as its rotation R and where it puts a local origin, relative to a global one: c = R b + t - a.
struct OriginPose
{
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d c = Eigen::Vector3d::Zero();
};

/** The sum of squares of all rows of pairings, as a function of the pose: one quadratic
 *
 *     f(R, t) = X' K X - 2 k' X + qq,   X = (columns of R, c),   c = R b_centre + t - a_centre,
 *
 * b_centre being the centroid of the local positions and a_centre a point near that of the global ones.
 * Whatever the number of pairings, this is all that poses of least squares depend on; C. Olsson and A.
 * Eriksson, "Solving quadratically constrained geometrical problems using Lagrangian duality", ICPR 2008. It
 * has no rule for signs: free directions are in it as w (1 - (u_g' R u_l)^2).
 *
 * Two of them add up: the sum is that of the two sets of pairings. (Where PairWeights leave the weights of
 * directions unset, those follow from each set's own size.) Not thread-safe while it is changed.
 */
struct PoseQuadratic
{
    Matrix12 K = Matrix12::Zero();
    Vector12 k = Vector12::Zero();
    double qq = 0;
    Eigen::Vector3d a_centre = Eigen::Vector3d::Zero(),
                    b_centre = Eigen::Vector3d::Zero();  ///< in their frames, m
    double position_weight = 0;                          ///< sum of the weights of all positions
    /// Of the paired local points (no base points of lines, no centroids of planes): the sum of their
    /// weights, their centroid and their rms radius about it, m; 0 if they coincide.
    double points_weight = 0;
    Eigen::Vector3d points_centre = Eigen::Vector3d::Zero();
    double radius = 0;
    /// An estimate of what rounding may have changed in f at poses that fit, m^2.
    double rounding = 0;
    size_t rows = 0;     ///< scalar equations that count
    size_t skipped = 0;  ///< pairings left out for numbers that are not finite, or a direction of length 0

    /// What turns rad into m: the radius, or 1 m without one.
    double L() const { return radius > 0 ? radius : 1; }
    /// Is there anything to solve with?
    bool empty() const { return !(K.trace() > 0); }

    /// Are all numbers finite?
    bool is_finite() const;

    /// f at a pose; never below 0.
    double cost(const OriginPose& pose) const;
    double cost(const mrpt::poses::CPose3D& pose) const;
    OriginPose relative(const mrpt::poses::CPose3D& pose) const;
    mrpt::poses::CPose3D absolute(const OriginPose& pose) const;

    /** The information J' K J in (v, omega L): v the velocity of the centroid, omega the angular one, both
     * along global axes. One unit is that of a weight, 1/m^2 times m^2.
     */
    Matrix6 information(const Eigen::Matrix3d& R) const;
    /** The c of least cost at R; along what no position determines (information below 1e-12 of the largest),
     * that of `kept`.
     */
    Eigen::Vector3d best_translation(const Eigen::Matrix3d& R, const Eigen::Vector3d& kept) const;

    /// Adds the pairings of `o`. O(1); exact but for rounding relative to the distance between both sets.
    PoseQuadratic& operator+=(const PoseQuadratic& o);
    /// To origins at these places relative to the present ones.
    void move_origins(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

    /// All numbers as they are. \exception DataError for data of another version, cut short, or not finite.
    void serializeTo(mrpt::serialization::CArchive& out) const;
    void serializeFrom(mrpt::serialization::CArchive& in);

 private:
    void add_radius(const PoseQuadratic& o);
};
mrpt::serialization::CArchive& operator<<(mrpt::serialization::CArchive& out, const PoseQuadratic& obj);
mrpt::serialization::CArchive& operator>>(mrpt::serialization::CArchive& in, PoseQuadratic& obj);

/** That of all pairings that are finite. \exception std::invalid_argument for a weight that is not
 * from 0 to 1e20. One pass in fixed blocks: the same bits on any number of threads.
 */
PoseQuadratic pose_quadratic(const Pairings& pairings, const PairWeights& weights = {});

/** That of a prior on the pose, with as many rows as its information matrix has rank. In the twist (dt,
 * omega) at the mean (t = t0 + dt, R = exp([omega]x) R0) let the information be [Ltt Ltw; Ltw' Lww]. The cost
 * is
 *
 *     (t - t0 + A s)' Ltt (t - t0 + A s) + 4 v' (Lww - Ltw' A) v,   Ltt A = Ltw,
 *
 * with s = axis sin(angle) and v = axis sin(angle / 2) of R R0': quadratic in the entries of R, and to second
 * order at the mean the prior's own (pose - mean)' Lambda (pose - mean).
 * \exception std::invalid_argument for a mean or an information matrix that is not finite, or an information
 * matrix that is not positive semidefinite.
 */
PoseQuadratic pose_quadratic(const mrpt::poses::CPose3DPDFGaussianInf& prior);

}  // namespace mp2p_icp
