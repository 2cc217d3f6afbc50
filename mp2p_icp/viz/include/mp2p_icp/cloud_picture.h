#pragma once

#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/ortho_view.h>
#include <mrpt/img/CImage.h>
#include <mrpt/img/TColor.h>
#include <mrpt/opengl/COpenGLScene.h>
#include <mrpt/poses/CPose3D.h>

#include <vector>

namespace mp2p_icp
{
/// The points of all cloud layers of a map, as seen from the frame in which `T_world_map` stands; those that
/// are not finite are left out. Transformed in double. \exception std::invalid_argument if the pose is not
/// finite.
PointSet points_in_world(const metric_map_t& map, const mrpt::poses::CPose3D& T_world_map = {});

/// Points of one colour.
struct DrawnCloud
{
    const PointSet* points = nullptr;
    mrpt::img::TColor color;
    float point_size_px = 2;
};

/// Smaller points would fade in draw_clouds().
constexpr float SMALLEST_POINT_PX = 1.2f;
constexpr float LARGEST_POINT_PX = 4.0f;

/// A size at which so many points are easy to see and do not fill a picture of this size, in
/// [SMALLEST_POINT_PX, LARGEST_POINT_PX].
float point_size_for(size_t point_count, int width_px, int height_px);

/// For points of that size behind which others stand. Where points are few, those behind are larger: a rim of
/// them stays in sight. Where they are many, larger ones would only cover more of the others.
float point_size_behind(float size_px);

/** The clouds on a white ground, with the camera of the view in the main viewport; OrthoView tells the
 * scene's origin and unit. Where points of two clouds meet, the cloud that comes later in the list is
 * seen.
 * O(number of points).
 */
mrpt::opengl::COpenGLScene::Ptr make_cloud_scene(const std::vector<DrawnCloud>& clouds, const OrthoView& view,
                                                 int width_px, int height_px);

/** A picture of the clouds with smooth edges (drawn at twice the size and averaged). Errors as
 * render_offscreen(); sizes up to 4096.
 */
mrpt::img::CImage draw_clouds(std::vector<DrawnCloud> clouds, const OrthoView& view, int width_px,
                              int height_px);

}  // namespace mp2p_icp
