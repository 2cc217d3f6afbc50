#include "surface_agreement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
std::optional<SurfaceAgreement> least_agreement(const std::vector<SurfaceDistance>& distances,
                                                double local_thickness, double spacing)
{
    constexpr size_t FEWEST_POINTS = 50;
    constexpr double LEAST_PART = 0.05;  // of all that is seen
    if (distances.size() < FEWEST_POINTS) return {};
    Eigen::Matrix3d all = Eigen::Matrix3d::Zero(), agreeing = Eigen::Matrix3d::Zero();
    for (const auto& d : distances)
    {
        const Eigen::Matrix3d seen = d.normal * d.normal.transpose();
        const double tolerance = std::max(3 * std::hypot(d.thickness, local_thickness), spacing / 4);
        all += seen;
        if (std::abs(d.distance) <= tolerance) agreeing += seen;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(all);
    std::optional<SurfaceAgreement> least;
    for (int i = 0; i < 3; i++)
    {
        const double seen = eigen.eigenvalues()(i);
        if (seen < LEAST_PART * static_cast<double>(distances.size())) continue;
        const Eigen::Vector3d axis = eigen.eigenvectors().col(i);
        const double share = axis.dot(agreeing * axis) / seen;
        if (!least || share < least->share) least = SurfaceAgreement{axis, share};
    }
    return least;
}

}  // namespace mp2p_icp
