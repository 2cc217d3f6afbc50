#include "pose_prior.h"

#include <mp2p_icp/se3.h>
#include <mrpt/math/wrap2pi.h>

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

}  // namespace mp2p_icp
