#include <mp2p_icp_filters/FilterLines.h>

#include "filter_layers.h"

IMPLEMENTS_MRPT_OBJECT(FilterLines, FilterBase, mp2p_icp_filters)

namespace mp2p_icp_filters
{
FilterLines::FilterLines()
{
    setLoggerName("FilterLines");
}

void FilterLines::declare_parameters(mp2p_icp::ParameterDeclaration& declare)
{
    declare.text("input_pointcloud_layer", input_pointcloud_layer, "The cloud in which lines are sought.");
    declare.text("output_layer_corners", output_layer_corners,
                 "2-D scans: layer for the corners; empty: not written.");
    declare.text("output_layer_pole_points", output_layer_pole_points,
                 "Layer for the inliers of all poles; empty: not written.");
    declare.flag("scan_2d", scan_2d, "Is the layer a scan of a 2-D laser? Then its walls are found.");
    declare.flag("intersect_planes", intersect, "3-D clouds: lines in which the map's planes meet?");
    declare.flag("find_poles", find_poles, "3-D clouds: poles?");
    declare.formulas("sensor_position", sensor_position.data(), 3, "m",
                     "Where the layer was seen from, in its frame: x, y, z.");
    intersection_parameters.declare_parameters(declare);
    pole_parameters.declare_parameters(declare);
    segment_parameters.declare_parameters(declare);
}

void FilterLines::filter(mp2p_icp::metric_map_t& inOut) const
{
    const auto cloud = input_layer(*this, inOut, input_pointcloud_layer);
    const Eigen::Vector3d sensor = position_value(sensor_position, variables(), "sensor_position");
    std::vector<mp2p_icp::fitted_line_t> lines;
    std::vector<mrpt::math::TPoint3D> corners;
    std::vector<size_t> pole_points;
    if (scan_2d)
    {
        const Segments2d found = extract_segments_2d(*cloud, segment_parameters, sensor);
        for (const auto& segment : found.segments) lines.push_back(segment.line);
        corners = found.corners;
    }
    if (!scan_2d && intersect) lines = intersect_planes(*cloud, inOut.planes, intersection_parameters);
    if (!scan_2d && find_poles)
        for (const auto& pole : extract_poles(*cloud, pole_parameters, sensor))
        {
            lines.push_back(pole.line);
            pole_points.insert(pole_points.end(), pole.inliers.begin(), pole.inliers.end());
        }
    inOut.lines = lines;
    write_places(inOut, output_layer_corners, corners);
    write_layer(inOut, output_layer_pole_points, *cloud, pole_points);
}

}  // namespace mp2p_icp_filters
