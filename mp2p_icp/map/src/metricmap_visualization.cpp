#include <mp2p_icp/metricmap.h>
#include <mrpt/opengl/CGridPlaneXY.h>
#include <mrpt/opengl/CPointCloud.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <mrpt/poses/CPose3D.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
using mrpt::opengl::CSetOfObjects;

std::shared_ptr<CSetOfObjects> metric_map_t::get_visualization(const render_params_t& p) const
{
    auto o = CSetOfObjects::Create();
    get_visualization_planes(*o, p.planes);
    get_visualization_lines(*o, p.lines);
    get_visualization_points(*o, p.points);
    return o;
}

void metric_map_t::get_visualization_planes(CSetOfObjects& o, const render_params_planes_t& p) const
{
    if (!p.visible) return;
    const float w = static_cast<float>(p.halfWidth);
    for (const auto& patch : planes)
    {
        auto grid = mrpt::opengl::CGridPlaneXY::Create(-w, w, -w, w, .0f, static_cast<float>(p.gridSpacing));
        grid->setColor_u8(p.color);
        mrpt::math::TPose3D pose;
        patch.plane.getAsPose3DForcingOrigin(patch.centroid, pose);
        grid->setPose(mrpt::poses::CPose3D(pose));
        o.insert(grid);
    }
}

void metric_map_t::get_visualization_lines(CSetOfObjects& o, const render_params_lines_t& p) const
{
    if (!p.visible || lines.empty()) return;
    auto segments = mrpt::opengl::CSetOfLines::Create();
    segments->setColor_u8(p.color);
    for (const auto& line : lines)
    {
        const auto half = line.director.unitarize() * (0.5 * p.length);
        segments->appendLine(line.pBase - half, line.pBase + half);
    }
    o.insert(segments);
}

void metric_map_t::get_visualization_points(CSetOfObjects& o, const render_params_points_t& p) const
{
    if (!p.visible) return;
    for (const auto& [name, layer] : layers)
    {
        if (p.perLayer.empty())
            get_visualization_map_layer(o, p.allLayers, layer);
        else if (const auto it = p.perLayer.find(name); it != p.perLayer.end())
            get_visualization_map_layer(o, it->second, layer);
    }
}

namespace
{
/// The values of one coordinate that the ends of the colour map stand for.
std::pair<float, float> colour_span(const mrpt::aligned_std_vector<float>& values, const color_mode_t& mode)
{
    const auto [lo, hi] = std::minmax_element(values.begin(), values.end());
    return {mode.colorMapMinCoord.value_or(*lo), mode.colorMapMaxCoord.value_or(*hi)};
}

void insert_coloured_by_coordinate(CSetOfObjects& o, const render_params_point_layer_t& p,
                                   const mrpt::maps::CPointsMap& points)
{
    const color_mode_t& mode = *p.colorMode;
    const auto& xs = points.getPointsBufferRef_x();
    const auto& ys = points.getPointsBufferRef_y();
    const auto& zs = points.getPointsBufferRef_z();
    const auto& values = *mode.recolorizeByCoordinate == Coordinate::X   ? xs
                         : *mode.recolorizeByCoordinate == Coordinate::Y ? ys
                                                                         : zs;
    const auto [lo, hi] = colour_span(values, mode);
    auto cloud = mrpt::opengl::CPointCloudColoured::Create();
    cloud->setPointSize(p.pointSize);
    for (size_t i = 0; i < values.size(); i++)
    {
        const float s = hi > lo ? std::clamp((values[i] - lo) / (hi - lo), .0f, 1.f) : .5f;
        const auto c = mrpt::img::colormap(mode.colorMap, s);
        const auto u8tof = [](uint8_t v) { return static_cast<float>(v) / 255.0f; };
        cloud->push_back(xs[i], ys[i], zs[i], u8tof(c.R), u8tof(c.G), u8tof(c.B));
    }
    o.insert(cloud);
}
}  // namespace

void metric_map_t::get_visualization_map_layer(CSetOfObjects& o, const render_params_point_layer_t& p,
                                               const mrpt::maps::CMetricMap::Ptr& map)
{
    if (!map) return;
    const auto* points = MapToPointsMap(*map);
    const bool own_colours =
        !points || (p.colorMode && p.colorMode->keep_original_cloud_color && points->hasColorPoints());
    if (own_colours)
    {
        if (const auto drawn = map->getVisualization(); drawn) o.insert(drawn);
        return;
    }
    if (points->empty()) return;
    if (p.colorMode && p.colorMode->recolorizeByCoordinate)
        return insert_coloured_by_coordinate(o, p, *points);
    auto cloud = mrpt::opengl::CPointCloud::Create();
    cloud->loadFromPointsMap(points);
    cloud->setPointSize(p.pointSize);
    cloud->setColor_u8(p.color);
    o.insert(cloud);
}

}  // namespace mp2p_icp
