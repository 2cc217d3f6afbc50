#include <mp2p_icp/cloud_picture.h>
#include <mp2p_icp/offscreen_render.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/se3.h>
#include <mrpt/opengl/CPointCloud.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mp2p_icp
{
namespace
{
constexpr int SUPERSAMPLING = 2;
constexpr double PRIORITY_SHIFT =
    0.004;  // of the picture's height: how much nearer to the eye the next cloud is drawn

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

mrpt::opengl::COpenGLScene::Ptr make_cloud_scene(const std::vector<DrawnCloud>& clouds, const OrthoView& view,
                                                 int width_px, int height_px)
{
    auto scene = mrpt::opengl::COpenGLScene::Create();
    auto viewport = scene->getViewport();
    viewport->setCustomBackgroundColor({1, 1, 1, 1});
    viewport->getCamera() = view.camera(width_px, height_px);
    viewport->setViewportClipDistances(0, static_cast<float>(2 * view.depth / view.height));

    // In a parallel view, a shift towards the eye changes nothing but who hides whom. Between points that the
    // depth buffer cannot tell apart (Mesa: 1/4096 of the depth shown), the one that was drawn first is seen.
    for (size_t i = clouds.size(); i-- > 0;)
        scene->insert(cloud_object(clouds[i], view, PRIORITY_SHIFT * static_cast<double>(i)));
    return scene;
}

mrpt::img::CImage draw_clouds(std::vector<DrawnCloud> clouds, const OrthoView& view, int width_px,
                              int height_px)
{
    for (auto& cloud : clouds) cloud.point_size_px *= SUPERSAMPLING;
    const int width = SUPERSAMPLING * width_px, height = SUPERSAMPLING * height_px;
    const auto scene = make_cloud_scene(clouds, view, width, height);
    const auto large = render_offscreen(*scene, width, height);
    mrpt::img::CImage picture;
    large.scaleImage(picture, static_cast<unsigned>(width_px), static_cast<unsigned>(height_px),
                     mrpt::img::IMG_INTERP_AREA);
    return picture;
}

}  // namespace mp2p_icp
