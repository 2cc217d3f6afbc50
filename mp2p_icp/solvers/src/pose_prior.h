#pragma once

#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>

#include <Eigen/Dense>

namespace mp2p_icp
{
/// The cost e' Lambda e of a prior on a pose, e = coordinates(pose) - coordinates(mean), in the prior's
/// coordinates (x y z yaw pitch roll; angles differ by half a turn at most).
class PosePrior
{
 public:
    using Vector6 = Eigen::Matrix<double, 6, 1>;
    using Matrix6 = Eigen::Matrix<double, 6, 6>;

    explicit PosePrior(const mrpt::poses::CPose3DPDFGaussianInf& prior);

    Vector6 error(const mrpt::poses::CPose3D& pose) const;
    double cost(const mrpt::poses::CPose3D& pose) const;

    /// d e / d twist, the twist being (velocity of the local point `centre`, angular velocity), both along
    /// global axes. Where yaw and roll are not independent: their least change that makes the rotation.
    static Matrix6 jacobian(const mrpt::poses::CPose3D& pose, const Eigen::Vector3d& centre);

    const Matrix6& information() const { return information_; }
    /// S with S' S = Lambda.
    const Matrix6& sqrt_information() const { return sqrt_information_; }

 private:
    mrpt::poses::CPose3D mean_;
    Matrix6 information_, sqrt_information_;
};

/** The eigenvalues, the least first, of an information matrix whose rows and columns are divided by the roots
 * of the diagonal: metres and radians, and what is known well and badly, then have no more to do with each
 * other. (What is 1e-5 of the best known coordinate of its unit, or less, is divided as if it were that: what
 * rounding leaves in place of a zero stays small.)
 */
PosePrior::Vector6 unitless_eigenvalues(const PosePrior::Matrix6& information);

/// The prior's information in the twist (dt, omega) at its mean: t = t0 + dt, R = exp([omega]x) R0.
/// \exception std::invalid_argument unless all is finite and it is positive semidefinite.
PosePrior::Matrix6 twist_information(const mrpt::poses::CPose3DPDFGaussianInf& prior);

}  // namespace mp2p_icp
