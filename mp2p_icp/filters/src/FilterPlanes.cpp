#include <mp2p_icp/point_fields.h>
#include <mp2p_icp_filters/FilterPlanes.h>

#include "filter_layers.h"

IMPLEMENTS_MRPT_OBJECT(FilterPlanes, FilterBase, mp2p_icp_filters)

namespace mp2p_icp_filters
{
FilterPlanes::FilterPlanes()
{
    setLoggerName("FilterPlanes");
}

void FilterPlanes::declare_parameters(mp2p_icp::ParameterDeclaration& declare)
{
    declare.text("input_pointcloud_layer", input_pointcloud_layer, "The cloud in which planes are sought.");
    declare.text("output_layer_centroids", output_layer_centroids,
                 "Layer for the centroids of the planes; empty: not written.");
    declare.text("output_layer_plane_points", output_layer_plane_points,
                 "Layer for the inliers of all planes; empty: not written.");
    declare.text("output_layer_other_points", output_layer_other_points,
                 "Layer for all other points; empty: not written.");
    declare.formulas("sensor_position", sensor_position.data(), 3, "m",
                     "Where the layer was seen from, in its frame: x, y, z. Normals point there.");
    plane_parameters.declare_parameters(declare);
}

void FilterPlanes::filter(mp2p_icp::metric_map_t& inOut) const
{
    const auto cloud = input_layer(*this, inOut, input_pointcloud_layer);
    const Eigen::Vector3d sensor = position_value(sensor_position, variables(), "sensor_position");
    inOut.planes.clear();
    std::vector<bool> in_plane(cloud->size(), false);
    for (const auto& found : extract_planes(*cloud, plane_parameters, sensor))
    {
        inOut.planes.push_back(found.plane);
        for (const uint32_t i : found.inliers) in_plane[i] = true;
    }
    write_centroids(inOut, output_layer_centroids);
    std::vector<size_t> chosen, others;
    for (const size_t i : mp2p_icp::finite_points(*cloud)) (in_plane[i] ? chosen : others).push_back(i);
    write_layer(inOut, output_layer_plane_points, *cloud, chosen);
    write_layer(inOut, output_layer_other_points, *cloud, others);
}

}  // namespace mp2p_icp_filters
