#pragma once

#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/se3.h>

#include <cmath>

namespace mp2p_icp
{
/// The cloud layers with these names; without names, all cloud layers. \exception std::invalid_argument for a
/// named layer that is missing or not a cloud.
inline std::vector<const mrpt::maps::CPointsMap*> cloud_layers(const metric_map_t& map,
                                                               const std::vector<layer_name_t>& names)
{
    std::vector<const mrpt::maps::CPointsMap*> clouds;
    for (const auto& name : names) clouds.push_back(map.point_layer(name).get());
    if (!names.empty()) return clouds;
    for (const auto& [name, layer] : map.layers)
        if (const auto* cloud = layer ? MapToPointsMap(*layer) : nullptr) clouds.push_back(cloud);
    return clouds;
}

/// The points around a sensor: what maps, stored in any frame, look like from there.
class PointsFromSensor
{
 public:
    /// The local map itself.
    PointsFromSensor(const metric_map_t& local, const std::vector<layer_name_t>& layers,
                     const Eigen::Vector3d& sensor_in_local)
        : clouds_(cloud_layers(local, layers)), t_(-sensor_in_local)
    {
    }
    /// The global map, seen from the same sensor with the local frame at `local_pose`.
    PointsFromSensor(const metric_map_t& global, const std::vector<layer_name_t>& layers,
                     const Eigen::Vector3d& sensor_in_local, const mrpt::poses::CPose3D& local_pose)
        : clouds_(cloud_layers(global, layers)),
          origin_(translation_of(local_pose)),
          R_(rotation_of(local_pose).transpose()),
          t_(-sensor_in_local)
    {
    }

    /// Calls `use(point)` for all points that are finite, in their order; axes are those of the local frame.
    template <class Use>
    void for_each(const Use& use) const
    {
        for (const auto* cloud : clouds_)
        {
            const auto& x = cloud->getPointsBufferRef_x();
            const auto& y = cloud->getPointsBufferRef_y();
            const auto& z = cloud->getPointsBufferRef_z();
            for (size_t i = 0; i < x.size(); i++)
                if (std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]))
                    use(Eigen::Vector3d(
                        R_ * (Eigen::Vector3d(double(x[i]), double(y[i]), double(z[i])) - origin_) + t_));
        }
    }

 private:
    std::vector<const mrpt::maps::CPointsMap*> clouds_;
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    Eigen::Matrix3d R_ = Eigen::Matrix3d::Identity();
    Eigen::Vector3d t_;
};

}  // namespace mp2p_icp
