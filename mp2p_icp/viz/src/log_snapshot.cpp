#include <mp2p_icp/cloud_picture.h>
#include <mp2p_icp/log_snapshot.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "decorations.h"
#include "view_scene.h"

namespace mp2p_icp
{
namespace
{
constexpr int SMALLEST_PICTURE_PX = 200, SMALLEST_PANEL_PX = 40;

std::string short_number(double value, const char* format = "%.4g")
{
    char text[32];
    std::snprintf(text, sizeof(text), format, value);
    return text;
}

/// Panels as near to squares as the picture allows.
int columns_for(size_t panels, int width, int height)
{
    const double columns = std::sqrt(static_cast<double>(panels) * width / height);
    return std::clamp(static_cast<int>(std::lround(columns)), 1, static_cast<int>(panels));
}

std::vector<std::string> titles_of(const LogScene& scene, const std::vector<LogMoment>& moments)
{
    std::vector<std::string> titles;
    for (const auto& moment : moments) titles.push_back(scene.log() ? to_string(moment) : "");
    return titles;
}

void check(const std::vector<LogMoment>& moments, const LogSnapshotOptions& options)
{
    check_picture_size(options.width, SMALLEST_PICTURE_PX, "the width of a picture");
    check_picture_size(options.height, SMALLEST_PICTURE_PX, "the height of a picture");
    if (moments.empty()) throw std::invalid_argument("draw_log: there must be at least one moment");
}

void check(const PictureArea& panel)
{
    if (panel.width < SMALLEST_PANEL_PX || panel.height < SMALLEST_PANEL_PX)
        throw std::invalid_argument("draw_log: the picture is too small for so many panels");
}

/// Sizes that suit the panel, as large as they are drawn before the picture is averaged.
LogSceneOptions panel_options(const LogScene& scene, const PictureArea& panel, bool automatic)
{
    LogSceneOptions o = scene.options();
    if (automatic)
    {
        const float size = point_size_for(scene.points(), panel.width, panel.height);
        o.local.point_size_px = size;
        o.global.point_size_px = scene.log() ? point_size_behind(size) : size;
    }
    for (auto* style : {&o.global, &o.local}) style->point_size_px *= SUPERSAMPLING;
    return o;
}

PicturePanels::Legend legend_of(const LogScene& scene)
{
    const auto& o = scene.options();
    if (!scene.log())
    {
        PicturePanels::Legend legend;
        for (const auto& part : drawable_parts(scene.global()))
            if (const auto it = o.global.part_colors.find(part);
                it != o.global.part_colors.end() && o.global.hidden.count(part) == 0)
                legend.emplace_back(part, it->second);
        return legend;
    }
    const auto with_decorations = [&](PicturePanels::Legend legend)
    {
        if (o.free_motions && !scene.log()->icpResult.unobservable.empty())
            legend.emplace_back("free motion", FREE_MOTION_COLOR);
        if (o.covariance)
            legend.emplace_back("3 sigma, x " + short_number(scene.covariance_scale()), ELLIPSOID_COLOR);
        return legend;
    };
    if (!o.color_by_residual) return with_decorations({{"global", o.global.color}, {"local", o.local.color}});
    const auto color = [](float share) { return mrpt::img::colormap(mrpt::img::cmJET, share); };
    return with_decorations({{"global", BEHIND_RESIDUALS_GLOBAL},
                             {"local, not paired", BEHIND_RESIDUALS_LOCAL},
                             {"residual 0", color(0)},
                             {short_number(scene.residual_scale(), "%.2g") + " m", color(1)}});
}
}  // namespace

ViewDirection view_from_name(const std::string& name)
{
    if (name == "fit") return {};
    if (name == "top") return {-90.0, 90.0};
    if (name == "side") return {-90.0, 0.0};
    if (name == "iso") return {-60.0, 35.0};
    throw std::invalid_argument("a view is `top`, `side`, `iso` or `fit`, not '" + name + "'");
}

mrpt::math::TPoint2D LogPicture::pixel(size_t panel, const mrpt::math::TPoint3D& point) const
{
    const auto& area = panels.at(panel);
    const auto inside = view.project(point, area.width, area.height);
    return {area.left + inside.x, area.top + inside.y};
}

std::string verdict_caption(const LogRecord& log)
{
    const auto& r = log.icpResult;
    return to_string(r.verdict) + (r.verdict_reason.empty() ? "" : ": " + r.verdict_reason) + " | quality " +
           short_number(100 * r.quality) + " %, " + std::to_string(r.nIterations) +
           (r.nIterations == 1 ? " iteration" : " iterations") + ", rms " +
           short_number(r.residual_rms, "%.3g") + " m";
}

LogPicture draw_log(LogScene& scene, const std::vector<LogMoment>& moments, const LogSnapshotOptions& options)
{
    check(moments, options);
    PicturePanels panels(options.width, options.height, options.captions, titles_of(scene, moments),
                         columns_for(moments.size(), options.width, options.height));
    LogPicture picture;
    picture.panels = panels.panels();
    const auto& first = picture.panels.front();
    check(first);
    picture.view = scene.fit(static_cast<double>(first.width) / first.height, options.direction);

    const LogSceneOptions wanted = scene.options();
    scene.set_options(panel_options(scene, first, options.automatic_point_sizes));
    for (size_t i = 0; i < moments.size(); i++)
    {
        scene.show(moments[i]);
        const auto content = scene.scene_for(picture.view, first.width, first.height);
        panels.draw(i, render_smooth(*content, first.width, first.height));
    }
    picture.image = panels.finish(legend_of(scene), picture.view.height / first.height);
    scene.set_options(wanted);
    scene.leave_view();
    return picture;
}

std::vector<LogMoment> some_moments(const std::vector<LogMoment>& all, size_t at_most)
{
    if (all.size() <= at_most || at_most < 2) return all;
    std::vector<LogMoment> some;
    size_t next = 0;  // the least that is new
    for (size_t i = 0; i < at_most; i++)
    {
        const double share = static_cast<double>(i) / static_cast<double>(at_most - 1);
        const auto wanted = static_cast<size_t>(share * share * static_cast<double>(all.size() - 1) + 0.5);
        some.push_back(all[std::max(next, wanted)]);
        next = std::max(next, wanted) + 1;
    }
    return some;
}

}  // namespace mp2p_icp
