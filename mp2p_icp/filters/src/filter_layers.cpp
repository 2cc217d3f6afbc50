#include "filter_layers.h"

#include <mp2p_icp/point_fields.h>
#include <mrpt/maps/CSimplePointsMap.h>

namespace mp2p_icp_filters
{
mrpt::maps::CPointsMap::Ptr input_layer(const FilterBase& filter, const mp2p_icp::metric_map_t& map,
                                        const std::string& name)
{
    try
    {
        return map.point_layer(name);
    }
    catch (const std::invalid_argument& e)
    {
        throw std::invalid_argument(std::string(filter.GetRuntimeClass()->className) + ": " + e.what());
    }
}

Eigen::Vector3d position_value(const std::array<mp2p_icp::Formula, 3>& formulas,
                               const mp2p_icp::RunVariables& variables, const std::string& name)
{
    const auto value = [&](size_t i) {
        return mp2p_icp::checked_value(formulas[i], variables, name,
                                       mp2p_icp::Range::open(-INFINITY, INFINITY));
    };
    return {value(0), value(1), value(2)};
}

void write_layer(mp2p_icp::metric_map_t& map, const std::string& name, const mrpt::maps::CPointsMap& from,
                 const std::vector<size_t>& indices)
{
    if (name.empty()) return;
    const auto cloud = mp2p_icp::new_cloud_like(from);
    mp2p_icp::append_points(*cloud, from, indices);
    map.layers[name] = cloud;
}

void write_places(mp2p_icp::metric_map_t& map, const std::string& name,
                  const std::vector<mrpt::math::TPoint3D>& places)
{
    if (name.empty()) return;
    const auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (const auto& place : places)
    {
        const mrpt::math::TPoint3Df p(place);
        cloud->insertPoint(p.x, p.y, p.z);
    }
    map.layers[name] = cloud;
}

void write_centroids(mp2p_icp::metric_map_t& map, const std::string& name)
{
    std::vector<mrpt::math::TPoint3D> centroids;
    for (const auto& plane : map.planes) centroids.push_back(plane.centroid);
    write_places(map, name, centroids);
}

}  // namespace mp2p_icp_filters
