#include <mp2p_icp/cloud_picture.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/se3.h>
#include <mrpt/opengl/CPointCloud.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "view_scene.h"

namespace mp2p_icp
{
namespace
{
void append_finite(PointSet& out, const mrpt::maps::CPointsMap& cloud,
                   const mrpt::poses::CPose3D& T_world_map)
{
    const auto& xs = cloud.getPointsBufferRef_x();
    const auto& ys = cloud.getPointsBufferRef_y();
    const auto& zs = cloud.getPointsBufferRef_z();
    for (const size_t i : finite_points(cloud))
        out.push_back(T_world_map.composePoint({xs[i], ys[i], zs[i]}));
}

/// The cloud, shifted towards the eye by so many heights of the picture.
mrpt::opengl::CPointCloud::Ptr cloud_object(const DrawnCloud& cloud, const OrthoView& view, double shift)
{
    PointSet in_scene;
    in_scene.reserve(cloud.points->size());
    for (const auto& p : *cloud.points) in_scene.push_back(view.in_scene(p) + view.towards_eye() * shift);
    auto object = mrpt::opengl::CPointCloud::Create();
    object->setAllPoints(in_scene);
    object->setColor_u8(cloud.color);
    object->setPointSize(cloud.point_size_px);
    object->enableVariablePointSize(false);
    return object;
}
}  // namespace

PointSet points_in_world(const metric_map_t& map, const mrpt::poses::CPose3D& T_world_map)
{
    if (!is_finite(T_world_map)) throw std::invalid_argument("points_in_world: T_world_map must be finite");
    PointSet points;
    points.reserve(map.size_points_only());
    for (const auto& [name, layer] : map.layers)
        if (const auto* cloud = layer ? MapToPointsMap(*layer) : nullptr; cloud)
            append_finite(points, *cloud, T_world_map);
    return points;
}

float point_size_for(size_t point_count, int width_px, int height_px)
{
    const double area_per_point =
        static_cast<double>(width_px) * height_px / std::max<double>(1, static_cast<double>(point_count));
    return std::clamp(static_cast<float>(0.5 * std::sqrt(area_per_point)), SMALLEST_POINT_PX,
                      LARGEST_POINT_PX);
}

float point_size_behind(float size_px)
{
    constexpr float GROWTH = 0.75f;
    return size_px + GROWTH * (size_px - SMALLEST_POINT_PX);
}

mrpt::opengl::COpenGLScene::Ptr make_cloud_scene(const std::vector<DrawnCloud>& clouds, const OrthoView& view,
                                                 int width_px, int height_px)
{
    auto scene = scene_of_view(view, width_px, height_px);
    for (size_t i = clouds.size(); i-- > 0;)
        scene->insert(cloud_object(clouds[i], view, PRIORITY_SHIFT * static_cast<double>(i)));
    return scene;
}

mrpt::img::CImage draw_clouds(std::vector<DrawnCloud> clouds, const OrthoView& view, int width_px,
                              int height_px)
{
    for (auto& cloud : clouds) cloud.point_size_px *= SUPERSAMPLING;
    return render_smooth(*make_cloud_scene(clouds, view, width_px, height_px), width_px, height_px);
}

}  // namespace mp2p_icp
