#pragma once

#include "gui_widgets.h"
#include "viewer_model.h"
#include "viewer_stage.h"

namespace mp2p_icp_apps
{
/// The tabs of the window's panel: what is known of the first log, and how it is drawn.
class ViewerTabs
{
 public:
    /// \param changed is called after anything on show has changed
    ViewerTabs(nanogui::Widget* parent, ViewerModel& model, ViewerStage& stage, int width,
               std::function<void()> changed);

    void log_changed();     ///< another log is on show
    void moment_changed();  ///< another pose of it is
    int active() const { return tabs_->activeTab(); }
    void activate(int tab);
    bool orthographic() const { return orthographic_; }
    void set_orthographic(bool on);

 private:
    nanogui::Widget* add_tab(const std::string& name);
    void make_maps();
    void make_pairings();
    void make_plots();
    void make_view();
    void make_pose();
    void list_layers(nanogui::Widget* list, const std::string& title, const mp2p_icp::metric_map_t& map,
                     std::set<std::string>& hidden);
    double unit();  ///< about the size of the data, m
    void draw_plots();
    void draw_histogram();
    void pose_changed();
    nanogui::Graph* add_graph(nanogui::Widget* tab);

    ViewerModel& model_;
    ViewerStage& stage_;
    int width_;
    std::function<void()> changed_;
    bool orthographic_ = false;

    nanogui::TabWidget* tabs_;
    TextPanel *summary_ = nullptr, *variables_ = nullptr, *pairs_ = nullptr;
    nanogui::Widget* layers_ = nullptr;
    nanogui::Label* exported_ = nullptr;
    nanogui::Graph *step_plot_ = nullptr, *cost_plot_ = nullptr, *histogram_ = nullptr;
    std::array<nanogui::Slider*, 6> pose_sliders_{};
    std::array<nanogui::Label*, 2> pose_labels_{};
};

}  // namespace mp2p_icp_apps
