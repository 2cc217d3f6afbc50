#include "surface_agreement.h"

#include <Eigen/Eigenvalues>

namespace mp2p_icp
{
std::optional<SurfaceAgreement::Direction> SurfaceAgreement::worst() const
{
    constexpr size_t FEWEST_POINTS = 50;
    constexpr double LEAST_PART = 0.05;  // of all that is seen
    if (count_ < FEWEST_POINTS) return {};
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(all_);
    std::optional<Direction> worst;
    for (int i = 0; i < 3; i++)
    {
        const double seen = eigen.eigenvalues()(i);
        if (seen < LEAST_PART * static_cast<double>(count_)) continue;
        const Eigen::Vector3d axis = eigen.eigenvectors().col(i);
        const double share = axis.dot(agreeing_ * axis) / seen;
        if (!worst || share < worst->share) worst = Direction{axis, share};
    }
    return worst;
}

}  // namespace mp2p_icp
