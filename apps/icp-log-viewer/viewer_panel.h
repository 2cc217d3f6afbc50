#pragma once

#include "viewer_tabs.h"

namespace mp2p_icp_apps
{
/// The panel at the left of the window: which log, which of its poses, and the tabs.
class ViewerPanel
{
 public:
    ViewerPanel(mrpt::gui::CDisplayWindowGUI& window, ViewerModel& model, ViewerStage& stage, int width);

    ViewerTabs& tabs() { return *tabs_; }
    const ViewerTabs& tabs() const { return *tabs_; }

    void before_frame();  ///< goes on with what takes longer than a frame

    bool playing() const { return playing_; }
    void play();  ///< one step of it

    /** Left, right, page up, page down, home, end: other logs; up, down: other poses; I: guess or final pose;
     * space: play; Q: close. Returns true for these.
     */
    bool key(int key, int action);

 private:
    void make_list();
    void make_second();
    void make_poses();
    void go_to_log(long index);
    void go_to_moment(long index);
    void refresh();  ///< all that tells what is on show
    void log_changed();
    void moment_changed();

    mrpt::gui::CDisplayWindowGUI& window_;
    ViewerModel& model_;
    ViewerStage& stage_;
    int width_;
    bool playing_ = false;

    nanogui::Window* panel_;
    nanogui::Slider *log_slider_ = nullptr, *second_slider_ = nullptr, *pose_slider_ = nullptr;
    nanogui::Label *log_label_ = nullptr, *verdict_label_ = nullptr, *second_label_ = nullptr,
                   *pose_label_ = nullptr, *problem_label_ = nullptr;
    nanogui::Button* play_button_ = nullptr;
    std::unique_ptr<ViewerTabs> tabs_;
};

}  // namespace mp2p_icp_apps
