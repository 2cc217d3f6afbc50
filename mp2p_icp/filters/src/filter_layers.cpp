#include "filter_layers.h"

#include <mp2p_icp/point_fields.h>

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

void write_layer(mp2p_icp::metric_map_t& map, const std::string& name, const mrpt::maps::CPointsMap& from,
                 const std::vector<size_t>& indices)
{
    if (name.empty()) return;
    const auto cloud = mp2p_icp::new_cloud_like(from);
    mp2p_icp::append_points(*cloud, from, indices);
    map.layers[name] = cloud;
}

}  // namespace mp2p_icp_filters
