#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <optional>

namespace mp2p_icp
{
/** Whether paired points lie on the surfaces with which they are paired, seen by direction: of a street laid
 * on another one, half of the points lie on the ground, as they should, but the walls do not. At a right
 * pose, all directions agree.
 */
class SurfaceAgreement
{
 public:
    /// A point at this distance (m) of a surface with this unit normal. \param tolerance what noise explains,
    /// m
    void add(const Eigen::Vector3d& normal, double distance, double tolerance)
    {
        const Eigen::Matrix3d seen = normal * normal.transpose();
        all_ += seen, count_++;
        if (std::abs(distance) <= tolerance) agreeing_ += seen;
    }

    struct Direction
    {
        Eigen::Vector3d axis;
        double share =
            1;  ///< of the points on surfaces across the axis (weighted by how far across) that lie on them
    };
    /// The principal direction that agrees least; empty if too few points say anything. Directions that
    /// hardly any surface faces do not count.
    std::optional<Direction> worst() const;

 private:
    Eigen::Matrix3d all_ = Eigen::Matrix3d::Zero(), agreeing_ = Eigen::Matrix3d::Zero();
    size_t count_ = 0;
};

}  // namespace mp2p_icp
