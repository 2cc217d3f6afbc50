#include "aligned_cloud.h"

#include <mp2p_icp/se3.h>

#include <stdexcept>

namespace mp2p_icp_apps
{
using mp2p_icp::metric_map_t;
using mp2p_icp::to_eigen;
using mrpt::poses::CPose3D;

CPose3D pose_between_stored(const CPose3D& T_global_local, const metric_map_t& local,
                            const metric_map_t& global)
{
    const Eigen::Matrix3d R = mp2p_icp::rotation_of(T_global_local);
    const Eigen::Vector3d t = mp2p_icp::translation_of(T_global_local);
    return mp2p_icp::make_pose(
        R, t - to_eigen(global.coordinate_offset()) + R * to_eigen(local.coordinate_offset()));
}

std::string main_cloud_layer(const metric_map_t& map)
{
    const auto has_points = [&](const std::string& name)
    {
        const auto it = map.layers.find(name);
        const auto* cloud = it == map.layers.end() ? nullptr : mp2p_icp::MapToPointsMap(*it->second);
        return cloud && !cloud->empty();
    };
    if (has_points(metric_map_t::PT_LAYER_RAW)) return metric_map_t::PT_LAYER_RAW;
    for (const auto& [name, layer] : map.layers)
        if (has_points(name)) return name;
    throw std::invalid_argument("the local map has no cloud layer with points");
}

metric_map_t aligned_cloud(const metric_map_t& local, const metric_map_t& global,
                           const CPose3D& T_global_local)
{
    const std::string layer = main_cloud_layer(local);
    const auto cloud =
        std::dynamic_pointer_cast<mrpt::maps::CPointsMap>(local.point_layer(layer)->duplicateGetSmartPtr());
    const CPose3D moved = pose_between_stored(T_global_local, local, global);
    for (size_t i = 0; i < cloud->size(); i++)
    {
        float x = 0, y = 0, z = 0;
        cloud->getPointFast(i, x, y, z);
        const auto p = moved.composePoint({x, y, z});
        cloud->setPointFast(i, static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    }
    cloud->mark_as_modified();
    metric_map_t out;
    out.layers[layer] = cloud;
    out.set_coordinate_offset(global.coordinate_offset());
    return out;
}

}  // namespace mp2p_icp_apps
