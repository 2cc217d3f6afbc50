#include "map_objects.h"

#include <mp2p_icp/cloud_picture.h>
#include <mp2p_icp/point_fields.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
using mrpt::math::TPoint3D;
using mrpt::opengl::CSetOfObjects;
using mrpt::poses::CPose3D;

namespace
{
const char* const PLANES = "planes";
const char* const LINES = "lines";

bool is_finite_vector(const TPoint3D& p)
{
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}
bool is_direction(const Eigen::Vector3d& v)
{
    return v.allFinite() && v.stableNorm() > 0;
}
bool is_drawable(const fitted_plane_t& plane)
{
    return is_finite_vector(plane.centroid) && is_direction(plane.normal());
}
bool is_drawable(const fitted_line_t& line)
{
    const auto& u = line.director;
    return is_finite_vector(line.pBase) && is_direction({u[0], u[1], u[2]});
}

/// What was seen of a plane, as a square of the same girth; empty if that is not known.
std::optional<double> seen_half_width(const fitted_plane_t& plane)
{
    if (!plane.fit || !plane.fit->is_sound()) return {};
    const auto& f = *plane.fit;
    return 0.25 * (f.u_max - f.u_min + f.v_max - f.v_min);
}

/// What was seen of a line, as a segment around a base point; else one of that length.
std::pair<fitted_line_t, double> seen_piece(fitted_line_t line, double length_if_unknown)
{
    if (!line.fit || !line.fit->is_sound()) return {line, length_if_unknown};
    const auto director = line.director.unitarize();
    line.pBase += director * (0.5 * (line.fit->begin + line.fit->end));
    return {line, line.fit->length()};
}

void append_if_finite(PointSet& out, const TPoint3D& p)
{
    if (is_finite_vector(p)) out.push_back(p);
}

/// The corners of a square on the plane, or the middle alone.
void append_extent(PointSet& out, const fitted_plane_t& plane, const TPoint3D& shift)
{
    const Eigen::Vector3d centre = to_eigen(plane.centroid + shift);
    const Eigen::Vector3d u = plane.normal().stableNormalized().unitOrthogonal() *
                              seen_half_width(plane).value_or(0),
                          v = plane.normal().stableNormalized().cross(u);
    for (const Eigen::Vector3d& corner : {u, v, Eigen::Vector3d(-u), Eigen::Vector3d(-v)})
        append_if_finite(out, to_mrpt(centre + corner));
}

void append_extent(PointSet& out, const fitted_line_t& line, const TPoint3D& shift)
{
    const auto [piece, length] = seen_piece(line, 0);
    const auto half = piece.director.unitarize() * (0.5 * length);
    for (const auto& end : {piece.pBase - half, piece.pBase + half}) append_if_finite(out, end + shift);
}

/// Maps of another kind than points: the corners of what MRPT draws of them.
void append_extent(PointSet& out, const mrpt::maps::CMetricMap& layer, const TPoint3D& shift)
{
    const auto drawn = layer.getVisualization();
    if (!drawn || drawn->empty()) return;
    const auto box = drawn->getBoundingBox();
    for (const auto& corner : {box.min, box.max}) append_if_finite(out, corner + shift);
}

std::shared_ptr<CloudObject> cloud_object(const mrpt::maps::CPointsMap& layer, const SceneFrame& frame,
                                          const std::shared_ptr<size_t>& uploads)
{
    const auto &xs = layer.getPointsBufferRef_x(), &ys = layer.getPointsBufferRef_y(),
               &zs = layer.getPointsBufferRef_z();
    std::vector<mrpt::math::TPoint3Df> vertices;
    vertices.reserve(layer.size());
    for (const size_t i : finite_points(layer))
    {
        const auto p = frame.in_scene(TPoint3D(xs[i], ys[i], zs[i]));
        if (p.norm() < FARTHEST_DRAWN) vertices.push_back(p.cast<float>());
    }
    if (vertices.empty()) return nullptr;
    return std::make_shared<CloudObject>(vertices, frame.unit, uploads);
}

CSetOfObjects::Ptr in_metres(const SceneFrame& frame)
{
    auto set = CSetOfObjects::Create();
    set->setScale(static_cast<float>(1 / frame.unit));
    return set;
}

/// Drawn relative to the origin of the frame, in metres.
CSetOfObjects::Ptr plane_objects(const metric_map_t& map, const SceneFrame& frame)
{
    auto set = in_metres(frame);
    for (const auto& plane : map.planes)
    {
        if (!is_drawable(plane) || frame.in_scene(plane.centroid).norm() > FARTHEST_DRAWN) continue;
        metric_map_t one;
        const Eigen::Vector3d normal = plane.normal().stableNormalized();
        const TPoint3D centroid = plane.centroid - frame.origin;
        one.planes.push_back(plane_patch_t(
            mrpt::math::TPlane(normal.x(), normal.y(), normal.z(), -normal.dot(to_eigen(centroid))),
            centroid));
        render_params_planes_t style;
        style.halfWidth = std::max(seen_half_width(plane).value_or(frame.unit / 20), 1e-3 * frame.unit);
        style.gridSpacing = style.halfWidth / 4;
        one.get_visualization_planes(*set, style);
    }
    return set;
}

CSetOfObjects::Ptr line_objects(const metric_map_t& map, const SceneFrame& frame)
{
    auto set = in_metres(frame);
    for (const auto& line : map.lines)
    {
        if (!is_drawable(line) || frame.in_scene(line.pBase).norm() > FARTHEST_DRAWN) continue;
        auto [piece, length] = seen_piece(line, frame.unit / 4);
        piece.pBase -= frame.origin;
        metric_map_t one;
        one.lines.push_back(piece);
        render_params_lines_t style;
        style.length = length;
        one.get_visualization_lines(*set, style);
    }
    return set;
}

/// Maps of another kind than points, as MRPT draws them.
CSetOfObjects::Ptr other_object(const mrpt::maps::CMetricMap::Ptr& layer, const SceneFrame& frame)
{
    auto set = in_metres(frame);
    metric_map_t::get_visualization_map_layer(*set, {}, layer);
    set->setPose(CPose3D(frame.in_scene(TPoint3D(0, 0, 0))));
    return set;
}

mrpt::opengl::CRenderizable::Ptr layer_object(const mrpt::maps::CMetricMap::Ptr& layer,
                                              const SceneFrame& frame, const std::shared_ptr<size_t>& uploads)
{
    if (const auto* points = MapToPointsMap(*layer); points) return cloud_object(*points, frame, uploads);
    return other_object(layer, frame);
}
}  // namespace

std::vector<std::string> drawable_parts(const metric_map_t& map)
{
    std::vector<std::string> names;
    for (const auto& [name, layer] : map.layers)
        if (layer) names.push_back(name);
    if (!map.planes.empty()) names.emplace_back(PLANES);
    if (!map.lines.empty()) names.emplace_back(LINES);
    return names;
}

std::map<std::string, mrpt::img::TColor> distinct_colors(const metric_map_t& map)
{
    // Of the Okabe-Ito palette, those that are seen on white.
    static const mrpt::img::TColor COLORS[] = {{0x00, 0x72, 0xB2}, {0xD5, 0x5E, 0x00}, {0x00, 0x9E, 0x73},
                                               {0xCC, 0x79, 0xA7}, {0x56, 0xB4, 0xE9}, {0xE6, 0x9F, 0x00},
                                               {0x30, 0x30, 0x30}};
    std::map<std::string, mrpt::img::TColor> colors;
    size_t i = 0;
    for (const auto& name : drawable_parts(map)) colors[name] = COLORS[i++ % std::size(COLORS)];
    return colors;
}

PointSet extent_points(const metric_map_t& map, const TPoint3D& shift)
{
    PointSet points = points_in_world(map, CPose3D(shift));
    for (const auto& plane : map.planes)
        if (is_drawable(plane)) append_extent(points, plane, shift);
    for (const auto& line : map.lines)
        if (is_drawable(line)) append_extent(points, line, shift);
    for (const auto& [name, layer] : map.layers)
        if (layer && !MapToPointsMap(*layer)) append_extent(points, *layer, shift);
    return points;
}

CSetOfObjects::Ptr map_objects(const metric_map_t& map, const SceneFrame& frame,
                               const std::shared_ptr<size_t>& uploads)
{
    auto objects = CSetOfObjects::Create();
    const auto insert = [&](const std::string& name, const mrpt::opengl::CRenderizable::Ptr& object)
    {
        if (!object) return;
        object->setName(name);
        objects->insert(object);
    };
    for (const auto& [name, layer] : map.layers)
        if (layer) insert(name, layer_object(layer, frame, uploads));
    if (!map.planes.empty()) insert(PLANES, plane_objects(map, frame));
    if (!map.lines.empty()) insert(LINES, line_objects(map, frame));
    return objects;
}

void style_map_objects(CSetOfObjects& objects, const MapStyle& style)
{
    for (const auto& object : objects)
    {
        const std::string& name = object->getName();
        object->setVisibility(style.hidden.count(name) == 0);
        const auto own = style.part_colors.find(name);
        const auto color = own == style.part_colors.end() ? style.color : own->second;
        if (auto* cloud = dynamic_cast<CloudObject*>(object.get()); cloud)
            cloud->style(color, style);
        else if ((name == PLANES || name == LINES) && object->getColor_u8() != color)
            object->setColor_u8(color);
    }
}

}  // namespace mp2p_icp
