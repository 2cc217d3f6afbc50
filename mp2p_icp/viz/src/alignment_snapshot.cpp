#include <mp2p_icp/alignment_snapshot.h>
#include <mp2p_icp/cloud_picture.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <stdexcept>

#include "picture_text.h"
#include "scale_bar.h"

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

namespace
{
/// Where points are few, global ones are drawn larger: a rim of them stays in sight behind the local ones.
/// Where they are many, larger ones would only cover more of the others.
float size_of_global_points(float size_px)
{
    constexpr float GROWTH = 0.75f;
    return size_px + GROWTH * (size_px - SMALLEST_POINT_PX);
}

/// From top to bottom: captions, titles, the two halves, legend and scale bar.
struct Layout
{
    Lettering lettering;
    int pad = 0;  ///< free space beside and between things
    std::vector<std::string> captions;
    int captions_top = 0, titles_top = 0, footer_top = 0;
    PictureArea before, after;
};

Layout layout_of(const SnapshotOptions& options)
{
    Layout l;
    l.lettering.scale = std::max(1, std::min(options.height / 360, options.width / 720));
    l.pad = 8 * l.lettering.scale;
    const int line = l.lettering.line_height();

    const int letters_per_line = (options.width - 2 * l.pad) / l.lettering.letter_width();
    l.captions = wrapped(options.captions, static_cast<size_t>(letters_per_line));
    const int max_lines = options.height * 2 / 5 / line;  // the clouds are what matters
    if (static_cast<int>(l.captions.size()) > max_lines) l.captions.resize(static_cast<size_t>(max_lines));

    l.captions_top = l.pad / 2;
    l.titles_top = l.captions_top + static_cast<int>(l.captions.size()) * line;
    l.footer_top = options.height - line - l.pad / 2;
    const int top = l.titles_top + line + l.pad / 2;
    const int width = (options.width - l.pad) / 2;
    l.before = {0, top, width, l.footer_top - l.pad / 2 - top};
    l.after = {options.width - width, top, width, l.before.height};
    return l;
}

void check(int value, int lowest, const char* name)
{
    constexpr int HIGHEST = 4096;
    if (value < lowest || value > HIGHEST)
        throw std::invalid_argument(std::string("SnapshotOptions::") + name + " must be in [" +
                                    std::to_string(lowest) + ", " + std::to_string(HIGHEST) + "], found " +
                                    std::to_string(value));
}

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

void draw_half(AlignmentPicture& picture, const PictureArea& area, const PointSet& global,
               const PointSet& local, const SnapshotOptions& options)
{
    const auto size = [&](const PointSet& points)
    { return point_size_for(points.size(), area.width, area.height); };
    const std::vector<DrawnCloud> clouds = {
        {&global, options.global_color, size_of_global_points(size(global))},
        {&local, options.local_color, size(local)}};
    const auto half = draw_clouds(clouds, picture.view, area.width, area.height);
    picture.image.drawImage(area.left, area.top, half);
}

void draw_legend(mrpt::img::CImage& image, const Layout& l, const SnapshotOptions& options)
{
    int left = l.pad;
    const int box = l.lettering.letter_width();
    const int box_top = l.footer_top + (l.lettering.line_height() - box) / 2;
    for (const auto& [name, color] :
         {std::pair<std::string, mrpt::img::TColor>("global", options.global_color),
          std::pair<std::string, mrpt::img::TColor>("local", options.local_color)})
    {
        image.filledRectangle(left, box_top, left + box, box_top + box, color);
        draw_text(image, left + 2 * box, l.footer_top, name, l.lettering);
        left += 4 * box + l.lettering.width(name);
    }
}

void draw_titles(mrpt::img::CImage& image, const Layout& l)
{
    for (size_t i = 0; i < l.captions.size(); i++)
        draw_text(image, l.pad, l.captions_top + static_cast<int>(i) * l.lettering.line_height(),
                  l.captions[i], l.lettering);
    const auto title = [&](const std::string& text, const PictureArea& area)
    {
        draw_text(image, area.left + (area.width - l.lettering.width(text)) / 2, l.titles_top, text,
                  l.lettering);
    };
    title("before", l.before);
    title("after", l.after);
}

void draw_frame(mrpt::img::CImage& image, const Layout& l)
{
    const mrpt::img::TColor grey(0xB0, 0xB0, 0xB0);
    const int bottom = l.before.top + l.before.height, right = static_cast<int>(image.getWidth());
    image.filledRectangle(0, l.before.top - 1, right, l.before.top - 1, grey);
    image.filledRectangle(0, bottom, right, bottom, grey);
    const int middle = right / 2;
    image.filledRectangle(middle - 1, l.titles_top, middle, bottom, grey);
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
    check(options.width, 400, "width");
    check(options.height, 300, "height");
    check(guess, "guess");
    check(result, "result");
    const PointSet global_points = points_of(global, CPose3D(), "global");
    const PointSet local_before = points_of(local, guess, "local"),
                   local_after = points_of(local, result, "local");

    const Layout l = layout_of(options);
    AlignmentPicture picture;
    picture.before = l.before;
    picture.after = l.after;
    picture.view = fit_view({global_points, local_before, local_after},
                            static_cast<double>(l.before.width) / l.before.height, options.direction);
    picture.image.resize(static_cast<size_t>(options.width), static_cast<size_t>(options.height),
                         mrpt::img::CH_RGB);
    picture.image.filledRectangle(0, 0, options.width, options.height, {255, 255, 255});

    draw_half(picture, l.before, global_points, local_before, options);
    draw_half(picture, l.after, global_points, local_after, options);
    draw_titles(picture.image, l);
    draw_frame(picture.image, l);
    draw_legend(picture.image, l, options);
    draw_scale_bar(picture.image, options.width - 2 * l.pad, l.footer_top, l.before.width / 3,
                   picture.view.height / l.before.height, l.lettering);
    return picture;
}

void save_alignment_snapshot(const metric_map_t& global, const metric_map_t& local, const CPose3D& guess,
                             const CPose3D& result, const SnapshotOptions& options,
                             const std::string& png_path)
{
    const auto picture = draw_alignment(global, local, guess, result, options);
    bool written = false;
    try
    {
        written = picture.image.saveToFile(png_path);
    }
    catch (const std::exception&)
    {
        // OpenCV throws for an unknown suffix, and returns false for everything else.
    }
    if (!written)
        throw DataError(png_path,
                        "the picture cannot be written there (is the folder there? is the suffix .png?)");
}

}  // namespace mp2p_icp
