#include "viewer_tabs.h"

#include <functional>
#include <iostream>
#include <limits>

#include "log_text.h"

namespace mp2p_icp_apps
{
namespace
{
constexpr int TAB_HEIGHT = 400;
const char* const COLORINGS[] = {"side", "height", "residual"};
}  // namespace

ViewerTabs::ViewerTabs(nanogui::Widget* parent, ViewerModel& model, ViewerStage& stage, int width,
                       std::function<void()> changed)
    : model_(model), stage_(stage), width_(width), changed_(std::move(changed))
{
    tabs_ = new nanogui::TabWidget(parent);
    tabs_->setFixedWidth(width);
    tabs_->setFontSize(15);
    if (model.browser())
    {
        summary_ = add_text_panel(add_tab("Result"), width - 24, TAB_HEIGHT);
        variables_ = add_text_panel(add_tab("Vars"), width - 24, TAB_HEIGHT);
    }
    make_maps();
    if (model.browser()) make_pairings(), make_plots();
    make_view();
    if (model.browser()) make_pose();
    tabs_->setActiveTab(0);
}

nanogui::Widget* ViewerTabs::add_tab(const std::string& name)
{
    auto* tab = tabs_->createTab(name);
    make_column(tab);
    tab->setFixedHeight(TAB_HEIGHT + 10);
    return tab;
}

void ViewerTabs::activate(int tab)
{
    if (tab >= 0 && tab < tabs_->tabCount()) tabs_->setActiveTab(tab);
}

void ViewerTabs::set_orthographic(bool on)
{
    orthographic_ = on;
    stage_.set_orthographic(on);
}

void ViewerTabs::make_maps()
{
    auto* tab = add_tab("Maps");
    auto* scroll = new nanogui::VScrollPanel(tab);
    scroll->setFixedSize({width_ - 24, TAB_HEIGHT - 70});
    layers_ = new nanogui::Widget(scroll);
    make_column(layers_, 3);
    auto* row = add_row(tab);
    for (const bool global : {true, false})
        for (const std::string suffix : {".mm", ".ply"})
        {
            if (!global && !model_.browser()) continue;
            const std::string name = !model_.browser() ? "export " : global ? "global " : "local ";
            add_button(row, name + suffix, [=] { exported_->setCaption(model_.export_map(global, suffix)); });
        }
    exported_ = add_label(tab, "", width_ - 30);
}

void ViewerTabs::list_layers(nanogui::Widget* list, const std::string& title,
                             const mp2p_icp::metric_map_t& map, std::set<std::string>& hidden)
{
    add_label(list, title, width_ - 50);
    for (const auto& part : drawable_parts(map))
    {
        const auto layer = map.layers.find(part);
        const auto* points = layer == map.layers.end() ? nullptr : mp2p_icp::MapToPointsMap(*layer->second);
        const std::string size = points                      ? std::to_string(points->size()) + " points"
                                 : layer != map.layers.end() ? layer->second->GetRuntimeClass()->className
                                 : part == "planes"          ? std::to_string(map.planes.size())
                                                             : std::to_string(map.lines.size());
        add_check_box(list, part + " (" + size + ")", hidden.count(part) == 0,
                      [this, part, &hidden](bool on)
                      {
                          on ? (void)hidden.erase(part) : (void)hidden.insert(part);
                          model_.redraw();
                      });
    }
}

void ViewerTabs::make_pairings()
{
    auto* tab = add_tab("Pairs");
    add_check_box(tab, "draw them", model_.drawing().draw_pairings,
                  [this](bool on) { model_.drawing().draw_pairings = on, model_.redraw(); });
    auto& kinds = model_.drawing().pairings;
    for (const auto& [name, flag] : {std::pair("point-point", &kinds.pt2pt),
                                     {"point-line", &kinds.pt2ln},
                                     {"point-plane", &kinds.pt2pl},
                                     {"line-line", &kinds.ln2ln},
                                     {"plane-plane", &kinds.pl2pl}})
        add_check_box(tab, name, *flag, [this, flag = flag](bool on) { *flag = on, model_.redraw(); });
    pairs_ = add_text_panel(tab, width_ - 24, TAB_HEIGHT - 170);
}

void ViewerTabs::make_view()
{
    auto* tab = add_tab("View");
    auto* directions = add_row(tab);
    for (const std::string name : {"top", "side", "iso", "fit"})
        add_button(directions, name, [this, name] { stage_.look_from(mp2p_icp::view_from_name(name)); });
    auto& drawing = model_.drawing();
    add_label(tab, "colour by", width_ - 30);
    auto* coloring = add_choice(tab, {COLORINGS, COLORINGS + 3}, 120,
                                [this](int i)
                                {
                                    auto& d = model_.drawing();
                                    d.color_by_residual = i == 2;
                                    d.global.by_height = d.local.by_height = i == 1;
                                    model_.redraw(), changed_();
                                });
    coloring->setSelectedIndex(drawing.color_by_residual ? 2 : drawing.global.by_height ? 1 : 0);
    const auto slider = [&](const char* name, const std::function<void(double)>& changed)
    {
        auto* row = add_row(tab);
        add_label(row, name, 110);
        return add_slider(row, width_ - 160,
                          [this, changed](float value)
                          { changed(static_cast<double>(value)), model_.redraw(); });
    };
    auto* size =
        slider("size of points", [&drawing](double pixels)
               { drawing.global.point_size_px = drawing.local.point_size_px = static_cast<float>(pixels); });
    size->setRange({1.0f, 12.0f});
    size->setValue(drawing.global.point_size_px);
    // The others are relative to the size of the data.
    slider(
        "as voxels", [this, &drawing](double share)
        { drawing.global.voxel_size = drawing.local.voxel_size = share < 0.02 ? 0 : 0.05 * share * unit(); });
    const double everything = std::numeric_limits<double>::infinity();
    const auto kept = [this, everything](double share)
    { return share > 0.99 ? everything : (share - 0.5) * unit(); };
    slider("keep before", [=, &drawing](double share) { drawing.clip.before = kept(share); })->setValue(1);
    slider("keep behind", [=, &drawing](double share) { drawing.clip.behind = kept(share); })->setValue(1);
    for (const auto& [name, flag] : {std::pair("coordinate axes", &drawing.frames),
                                     {"covariance of the translation (3 sigma)", &drawing.covariance},
                                     {"motions that nothing determines", &drawing.free_motions}})
        add_check_box(tab, name, *flag,
                      [this, flag = flag](bool on) { *flag = on, model_.redraw(), changed_(); });
    add_check_box(tab, "parallel projection", orthographic_, [this](bool on) { set_orthographic(on); });
    if (model_.browser())
        add_check_box(tab, "the camera follows the local map", false,
                      [this](bool on) { stage_.set_following(on); });
}

double ViewerTabs::unit()
{
    const auto* scene = model_.first().scene();
    return scene ? scene->unit() : 1;
}

void ViewerTabs::make_pose()
{
    auto* tab = add_tab("Pose");
    const std::pair<const char*, float> AXES[] = {{"x", 0},     {"y", 0},      {"z", 0},
                                                  {"yaw", 180}, {"pitch", 90}, {"roll", 180}};
    for (size_t i = 0; i < 6; i++)
    {
        auto* row = add_row(tab);
        add_label(row, AXES[i].first, 40);
        pose_sliders_[i] = add_slider(row, width_ - 90, [this](float) { pose_changed(); });
        pose_sliders_[i]->setRange({-AXES[i].second, AXES[i].second});
    }
    for (auto& label : pose_labels_) label = add_label(tab, "", width_ - 30);
    auto* row = add_row(tab);
    add_button(row, "back to the log's",
               [this] { model_.go_to_moment(static_cast<long>(model_.first().moment_index())), changed_(); });
    add_button(row, "print",
               [this]
               {
                   if (const auto* scene = model_.first().scene(); scene)
                       std::cout << scene->pose().asString() << std::endl;
               });
}

void ViewerTabs::pose_changed()
{
    std::array<double, 6> change{};
    for (size_t i = 0; i < 6; i++) change[i] = static_cast<double>(pose_sliders_[i]->value());
    model_.set_manual_pose(change);
    if (const auto* scene = model_.first().scene(); scene)
        for (size_t i = 0; i < 2; i++) pose_labels_[i]->setCaption(pose_lines(scene->pose())[i]);
}

void ViewerTabs::log_changed()
{
    auto* scene = model_.first().scene();
    const auto* log = model_.first().log();
    while (layers_->childCount() > 0) layers_->removeChild(0);
    if (scene) list_layers(layers_, log ? "global" : "map", scene->global(), model_.drawing().global.hidden);
    if (scene && log) list_layers(layers_, "local", *scene->local(), model_.drawing().local.hidden);
    if (summary_) summary_->set_lines(log ? summary_lines(*log) : TextLines{});
    if (variables_) variables_->set_lines(log ? variable_lines(*log) : TextLines{});
    if (step_plot_) draw_plots();
    if (scene && pose_sliders_[0])
        for (size_t i = 0; i < 3; i++)
            pose_sliders_[i]->setRange(
                {static_cast<float>(-scene->unit()), static_cast<float>(scene->unit())});
    moment_changed();
}

void ViewerTabs::moment_changed()
{
    const auto& shown = model_.first();
    const auto* log = shown.log();
    if (pairs_)
        pairs_->set_lines(log ? pairing_lines(*log, shown.moments()[shown.moment_index()]) : TextLines{});
    if (histogram_) draw_histogram();
    for (size_t i = 0; pose_sliders_[0] && i < 6; i++) pose_sliders_[i]->setValue(0);
    if (const auto* scene = model_.first().scene(); scene && pose_labels_[0])
        for (size_t i = 0; i < 2; i++) pose_labels_[i]->setCaption(pose_lines(scene->pose())[i]);
}

}  // namespace mp2p_icp_apps
