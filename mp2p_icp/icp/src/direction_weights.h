#pragma once

#include <Eigen/Dense>

namespace mp2p_icp
{
/** Weights by which all directions count the same, however unevenly the surfaces face them: most of a street
 * is ground, which looks the same when one slides along it. A surface with unit normal n weighs n' A^-1 n /
 * 3, where A is the mean of n n' over all surfaces: 1 on average. What hardly faces any surface is not blown
 * up.
 */
class DirectionWeights
{
 public:
    /// The sum of n n' over so many surfaces.
    DirectionWeights(const Eigen::Matrix3d& sum, size_t count)
    {
        constexpr double LEAST_SHARE = 0.03;
        if (count == 0) return;
        const Eigen::Matrix3d mean = sum / static_cast<double>(count);
        inverse_ = (mean + LEAST_SHARE * Eigen::Matrix3d::Identity()).inverse() / 3;
    }

    double of(const Eigen::Vector3d& normal) const { return normal.dot(inverse_ * normal); }

 private:
    Eigen::Matrix3d inverse_ = Eigen::Matrix3d::Identity();
};

}  // namespace mp2p_icp
