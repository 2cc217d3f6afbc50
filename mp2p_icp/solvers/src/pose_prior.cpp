#include "pose_prior.h"

#include <mp2p_icp/se3.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "euler_rates.h"

namespace mp2p_icp
{
PosePrior::PosePrior(const mrpt::poses::CPose3DPDFGaussianInf& prior) : mean_(prior.mean)
{
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) information_(r, c) = prior.cov_inv(r, c);
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(information_);
    sqrt_information_ =
        eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
}

PosePrior::Vector6 PosePrior::error(const mrpt::poses::CPose3D& pose) const
{
    Vector6 e;
    e << translation_of(pose) - translation_of(mean_), mrpt::math::wrapToPi(pose.yaw() - mean_.yaw()),
        mrpt::math::wrapToPi(pose.pitch() - mean_.pitch()), mrpt::math::wrapToPi(pose.roll() - mean_.roll());
    return e;
}

double PosePrior::cost(const mrpt::poses::CPose3D& pose) const
{
    const Vector6 e = error(pose);
    return e.dot(information_ * e);
}

PosePrior::Matrix6 PosePrior::jacobian(const mrpt::poses::CPose3D& pose, const Eigen::Vector3d& centre)
{
    Matrix6 J = Matrix6::Identity();
    J.topRightCorner<3, 3>() = skew(rotation_of(pose) * centre);  // t = R centre + t - R centre
    J.bottomRightCorner<3, 3>() = euler_rates(pose).completeOrthogonalDecomposition().pseudoInverse();
    return J;
}

PosePrior::Vector6 unitless_eigenvalues(const PosePrior::Matrix6& information)
{
    PosePrior::Vector6 scale;
    for (const int first : {0, 3})
    {
        const auto own = information.diagonal().segment<3>(first).array();
        const double least = std::max(1e-5 * own.maxCoeff(), std::numeric_limits<double>::min());
        scale.segment<3>(first) = own.max(least).rsqrt();
    }
    const PosePrior::Matrix6 scaled = scale.asDiagonal() * information * scale.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<PosePrior::Matrix6>(scaled, Eigen::EigenvaluesOnly).eigenvalues();
}

PosePrior::Matrix6 twist_information(const mrpt::poses::CPose3DPDFGaussianInf& prior)
{
    const PosePrior in(prior);
    if (!is_finite(prior.mean) || !in.information().allFinite())
        throw std::invalid_argument("a prior needs a finite mean and a finite information matrix");
    if (!(unitless_eigenvalues(in.information())(0) >= -1e-9))
        throw std::invalid_argument("the information matrix of a prior must be positive semidefinite");
    const PosePrior::Matrix6 J = PosePrior::jacobian(prior.mean, Eigen::Vector3d::Zero()),
                             out = J.transpose() * in.information() * J;
    return 0.5 * (out + out.transpose());
}

}  // namespace mp2p_icp
