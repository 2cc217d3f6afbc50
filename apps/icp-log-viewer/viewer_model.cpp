#include "viewer_model.h"

#include <mp2p_icp/cloud_picture.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/load_map.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cstdio>

namespace mp2p_icp_apps
{
using mp2p_icp::LogScene;
using mp2p_icp::metric_map_t;

ViewerModel::ViewerModel(const ViewerOptions& options, const ViewerState& state) : listing_(options)
{
    options.apply_to(drawing_);
    for (auto* style : {&drawing_.global, &drawing_.local}) style->point_size_px = state.point_size;
    const auto& path = options.inputs.front();
    if (is_map_path(path))
        first_ = std::make_unique<ShownLog>(path, metric_map_t::ConstPtr(mp2p_icp::load_map(path).map));
    else
    {
        browser_.emplace(options.inputs, options);
        first_ = read_log(0);
    }
    redraw();
}

std::unique_ptr<ShownLog> ViewerModel::read_log(size_t index)
{
    const auto log = browser_->read(index);
    const auto& summary = browser_->at(index);
    return std::make_unique<ShownLog>(summary.path, log, summary.problem);
}

std::vector<LogScene*> ViewerModel::scenes()
{
    std::vector<LogScene*> scenes{first_->scene()};
    if (second_) scenes.push_back(second_->scene());
    return scenes;
}

void ViewerModel::go_to_log(long index)
{
    if (!browser_) return;
    browser_->go_to(index);
    first_ = read_log(browser_->index());
    redraw();
}

void ViewerModel::step_log(long by)
{
    if (browser_) go_to_log(static_cast<long>(browser_->index()) + by);
}

void ViewerModel::show_second(std::optional<long> index)
{
    second_.reset();
    if (!browser_ || !index) return;
    second_index_ = static_cast<size_t>(std::clamp(*index, 0L, static_cast<long>(browser_->size()) - 1));
    second_ = read_log(second_index_);
    redraw();
}

void ViewerModel::go_to_moment(long index)
{
    first_->go_to_moment(index);
    if (second_) second_->go_to_moment(index);
}

void ViewerModel::play()
{
    if (!browser_) return;
    if (!first_->at_last_moment()) return go_to_moment(static_cast<long>(first_->moment_index()) + 1);
    if (browser_->size() > 1)
        go_to_log((static_cast<long>(browser_->index()) + 1) % static_cast<long>(browser_->size()));
    go_to_moment(0);
}

bool ViewerModel::arrange_some(double seconds)
{
    if (!browser_ || !arranging_) return false;
    if (LogBrowser::needs_summaries(listing_) && !browser_->summarize(seconds))
    {
        problem_ = "looking into the logs: " + std::to_string(browser_->summarized()) + " of " +
                   std::to_string(browser_->all());
        return true;
    }
    arranging_ = false;
    const std::string shown = first_->path();
    const bool some_left = browser_->arrange(listing_);
    problem_ = some_left ? "" : "no log has this verdict and quality";
    if (browser_->at(browser_->index()).path != shown) go_to_log(static_cast<long>(browser_->index()));
    return true;
}

void ViewerModel::redraw()
{
    for (auto* scene : scenes())
    {
        if (!scene) continue;
        auto options = drawing_;
        if (scene->log())  // a rim of the global points stays in sight
            options.global.point_size_px = mp2p_icp::point_size_behind(options.local.point_size_px);
        else
            options.global.part_colors = distinct_colors(scene->global());
        scene->set_options(options);
    }
}

void ViewerModel::set_manual_pose(const std::array<double, 6>& change)
{
    if (!first_->log()) return;
    const auto pose = pose_at(*first_->log(), first_->scene()->moment());
    using mrpt::DEG2RAD;
    first_->scene()->show_pose({pose.x() + change[0], pose.y() + change[1], pose.z() + change[2],
                                pose.yaw() + DEG2RAD(change[3]), pose.pitch() + DEG2RAD(change[4]),
                                pose.roll() + DEG2RAD(change[5])});
}

std::string ViewerModel::export_map(bool global, const std::string& suffix)
{
    const auto* scene = first_->scene();
    const metric_map_t* map = scene ? (global ? &scene->global() : first_->scene()->local()) : nullptr;
    if (!map) return "there is no such map";
    const auto& hidden = (global ? drawing_.global : drawing_.local).hidden;
    std::string name = first_->file_name();
    name.erase(std::min(name.size(), name.rfind('.')));
    name += !first_->log() ? "-export" : global ? "-global" : "-local";
    std::string written;
    try
    {
        if (suffix == ".mm") mp2p_icp::save_map(*map, written = name + suffix);
        if (suffix == ".ply")
            for (const auto& [layer, content] : map->layers)
            {
                if (!content || !mp2p_icp::MapToPointsMap(*content) || hidden.count(layer) > 0) continue;
                const std::string file = name + "-" + layer + suffix;
                mp2p_icp::save_map(*map, file, layer);
                written += (written.empty() ? "" : ", ") + file;
            }
    }
    catch (const std::exception& e)
    {
        return mp2p_icp::short_reason(e);
    }
    return written.empty() ? "no cloud layer is shown" : "written: " + written;
}

std::string ViewerModel::problem()
{
    if (!problem_.empty()) return problem_;
    if (!first_->problem().empty()) return first_->problem();
    return second_ ? second_->problem() : std::string();
}

std::string ViewerModel::title()
{
    std::string title = "icp-log-viewer: " + first_->file_name();
    if (const auto* log = first_->log(); log)
    {
        char quality[16];
        std::snprintf(quality, sizeof(quality), "%.1f %%", 100 * log->icpResult.quality);
        title += " (" + to_string(log->icpResult.verdict) + ", " + quality + ", " +
                 to_string(first_->moments()[first_->moment_index()]) + ")";
    }
    return title;
}

}  // namespace mp2p_icp_apps
