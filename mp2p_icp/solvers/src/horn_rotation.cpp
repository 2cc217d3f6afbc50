#include "horn_rotation.h"

namespace mp2p_icp
{
namespace
{
/// Horn's N: q' N q = trace(R(q)' B) for unit quaternions q = (w, x, y, z).
Eigen::Matrix4d horn_matrix(const Eigen::Matrix3d& B)
{
    const Eigen::Vector3d z(B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1));  // sum w b x a
    Eigen::Matrix4d N;
    N(0, 0) = B.trace();
    N.block<1, 3>(0, 1) = z.transpose();
    N.block<3, 1>(1, 0) = z;
    N.block<3, 3>(1, 1) = B + B.transpose() - B.trace() * Eigen::Matrix3d::Identity();
    return N;
}
}  // namespace

Eigen::Matrix3d horn_rotation(const Eigen::Matrix3d& B, double scale, const Eigen::Matrix3d& guess)
{
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(horn_matrix(B));
    const Eigen::Vector4d& values = eigen.eigenvalues();  // increasing
    const Eigen::Quaterniond q0(guess);
    const Eigen::Vector4d start(q0.w(), q0.x(), q0.y(), q0.z());
    // Relative spreads below 1e-5 are float rounding, and moments are their squares.
    const double equal = 1e-10 * scale;
    Eigen::Vector4d q = Eigen::Vector4d::Zero();
    int multiplicity = 0;
    for (int i = 3; i >= 0 && values(3) - values(i) <= equal; i--, multiplicity++)
        q += eigen.eigenvectors().col(i).dot(start) * eigen.eigenvectors().col(i);
    // Alone, or with a guess exactly opposite to all optima: any of them.
    if (multiplicity == 1 || q.norm() < 1e-9) q = eigen.eigenvectors().col(3);
    q.normalize();
    return Eigen::Quaterniond(q(0), q(1), q(2), q(3)).toRotationMatrix();
}

}  // namespace mp2p_icp
