#include <mp2p_icp/alignment_snapshot.h>
#include <mp2p_icp/cloud_picture.h>
#include <mp2p_icp/se3.h>

#include <stdexcept>

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

namespace
{
void check(const CPose3D& pose, const char* name)
{
    if (!is_finite(pose))
        throw std::invalid_argument(std::string("draw_alignment: `") + name + "` must be a finite pose");
}

/// The points of a map in the world; a map without any is refused.
PointSet points_of(const metric_map_t& map, const CPose3D& T_world_map, const char* name)
{
    PointSet points = points_in_world(map, T_world_map);
    if (points.empty())
        throw std::invalid_argument(std::string("draw_alignment: the map `") + name +
                                    "` has no finite point to draw");
    return points;
}

/// Both clouds, as large as the area.
mrpt::img::CImage draw_half(const PictureArea& area, const OrthoView& view, const PointSet& global,
                            const PointSet& local, const SnapshotOptions& options)
{
    const auto size = [&](const PointSet& points)
    { return point_size_for(points.size(), area.width, area.height); };
    return draw_clouds({{&global, options.global_color, point_size_behind(size(global))},
                        {&local, options.local_color, size(local)}},
                       view, area.width, area.height);
}
}  // namespace

mrpt::math::TPoint2D AlignmentPicture::pixel(const PictureArea& half, const mrpt::math::TPoint3D& point) const
{
    const auto inside = view.project(point, half.width, half.height);
    return {half.left + inside.x, half.top + inside.y};
}

AlignmentPicture draw_alignment(const metric_map_t& global, const metric_map_t& local, const CPose3D& guess,
                                const CPose3D& result, const SnapshotOptions& options)
{
    check_picture_size(options.width, 400, "SnapshotOptions::width");
    check_picture_size(options.height, 300, "SnapshotOptions::height");
    check(guess, "guess");
    check(result, "result");
    const PointSet global_points = points_of(global, CPose3D(), "global");
    const PointSet local_before = points_of(local, guess, "local"),
                   local_after = points_of(local, result, "local");

    PicturePanels panels(options.width, options.height, options.captions, {"before", "after"}, 2);
    AlignmentPicture picture;
    picture.before = panels.panels()[0];
    picture.after = panels.panels()[1];
    picture.view =
        fit_view({global_points, local_before, local_after},
                 static_cast<double>(picture.before.width) / picture.before.height, options.direction);
    panels.draw(0, draw_half(picture.before, picture.view, global_points, local_before, options));
    panels.draw(1, draw_half(picture.after, picture.view, global_points, local_after, options));
    picture.image = panels.finish({{"global", options.global_color}, {"local", options.local_color}},
                                  picture.view.height / picture.before.height);
    return picture;
}

void save_alignment_snapshot(const metric_map_t& global, const metric_map_t& local, const CPose3D& guess,
                             const CPose3D& result, const SnapshotOptions& options,
                             const std::string& png_path)
{
    save_picture(draw_alignment(global, local, guess, result, options).image, png_path);
}

}  // namespace mp2p_icp
