#include "viewer_panel.h"

#include <cmath>
#include <cstdio>

namespace mp2p_icp_apps
{
namespace
{
const std::vector<std::string> SORTS = {"name", "quality", "verdict"};
const std::vector<std::string> VERDICTS = {
    "all verdicts", "aligned", "no_overlap", "under_constrained", "diverged", "worse_than_guess", "failed"};

/// A slider over 0, 1, ..., count - 1.
void set_steps(nanogui::Slider& slider, size_t count, size_t at)
{
    slider.setRange({0.0f, static_cast<float>(count > 1 ? count - 1 : 1)});
    slider.setValue(static_cast<float>(at));
}

std::string verdict_line_of(const mp2p_icp::LogRecord& log)
{
    const auto& r = log.icpResult;
    char text[96];
    std::snprintf(text, sizeof(text), "%s, quality %.1f %%, rms %.3g m", to_string(r.verdict).c_str(),
                  100 * r.quality, r.residual_rms);
    return text;
}

std::string of_text(size_t index, size_t count)
{
    return std::to_string(index + 1) + " of " + std::to_string(count);
}
}  // namespace

ViewerPanel::ViewerPanel(mrpt::gui::CDisplayWindowGUI& window, ViewerModel& model, ViewerStage& stage,
                         int width)
    : window_(window), model_(model), stage_(stage), width_(width)
{
    panel_ = new nanogui::Window(&window, "");
    panel_->setPosition({0, 0});
    panel_->setFixedWidth(width);
    make_column(panel_, 3);
    if (model.browser()) make_list(), make_second(), make_poses();
    problem_label_ = add_label(panel_, "", width - 12);
    problem_label_->setColor(nanogui::Color(255, 140, 100, 255));
    tabs_ = std::make_unique<ViewerTabs>(panel_, model, stage, width - 8, [this] { refresh(); });
    log_changed();
}

void ViewerPanel::make_list()
{
    log_label_ = add_label(panel_, "", width_ - 12);
    verdict_label_ = add_label(panel_, "", width_ - 12);
    log_slider_ = add_slider(panel_, width_ - 12, [this](float at) { go_to_log(std::lround(at)); });
    auto* row = add_row(panel_);
    add_button(row, "<", [this] { model_.step_log(-1), log_changed(); });
    add_button(row, ">", [this] { model_.step_log(1), log_changed(); });
    add_choice(row, SORTS, 100,
               [this](int i)
               {
                   model_.listing().sort = SORTS[static_cast<size_t>(i)];
                   model_.arrange();
               });
    add_choice(row, VERDICTS, 150,
               [this](int i)
               {
                   model_.listing().verdict = i == 0 ? "" : VERDICTS[static_cast<size_t>(i)];
                   model_.arrange();
               });
    auto* quality = add_row(panel_);
    add_label(quality, "quality at least", 100);
    auto* slider = add_slider(quality, width_ - 130, {});
    slider->setFinalCallback(
        [this](float least)
        {
            model_.listing().min_quality = static_cast<double>(least);
            model_.arrange();
        });
}

void ViewerPanel::make_second()
{
    if (model_.browser()->size() < 2) return;
    auto* row = add_row(panel_);
    add_check_box(row, "a second log", false,
                  [this](bool on)
                  {
                      const auto next = static_cast<long>(model_.browser()->index()) + 1;
                      model_.show_second(on ? std::optional<long>(next) : std::nullopt);
                      log_changed();
                  });
    second_slider_ = add_slider(row, width_ - 150,
                                [this](float at)
                                {
                                    if (!model_.second()) return;
                                    model_.show_second(std::lround(at)), log_changed();
                                });
    second_label_ = add_label(panel_, "", width_ - 12);
}

void ViewerPanel::make_poses()
{
    pose_label_ = add_label(panel_, "", width_ - 12);
    pose_slider_ = add_slider(panel_, width_ - 12, [this](float at) { go_to_moment(std::lround(at)); });
    auto* row = add_row(panel_);
    add_button(row, "guess", [this] { go_to_moment(0); });
    add_button(row, "<", [this] { go_to_moment(static_cast<long>(model_.first().moment_index()) - 1); });
    add_button(row, ">", [this] { go_to_moment(static_cast<long>(model_.first().moment_index()) + 1); });
    add_button(row, "final",
               [this] { go_to_moment(static_cast<long>(model_.first().moments().size()) - 1); });
    play_button_ = add_button(row, "play", {});
    play_button_->setFlags(nanogui::Button::ToggleButton);
    play_button_->setChangeCallback([this](bool on) { playing_ = on; });
}

void ViewerPanel::before_frame()
{
    constexpr double part_of_a_frame_s = 0.01;
    const auto path = model_.first().path();
    if (!model_.arrange_some(part_of_a_frame_s)) return;
    path == model_.first().path() ? refresh() : log_changed();
}

void ViewerPanel::go_to_log(long index)
{
    if (!model_.browser() || index == static_cast<long>(model_.browser()->index())) return;
    model_.go_to_log(index);
    log_changed();
}

void ViewerPanel::go_to_moment(long index)
{
    if (index == static_cast<long>(model_.first().moment_index())) return;
    model_.go_to_moment(index);
    moment_changed();
}

void ViewerPanel::play()
{
    const auto path = model_.first().path();
    model_.play();
    path == model_.first().path() ? moment_changed() : log_changed();
}

void ViewerPanel::log_changed()
{
    stage_.set_scenes(model_.scenes());
    tabs_->log_changed();
    moment_changed();
    window_.performLayout();
}

void ViewerPanel::moment_changed()
{
    tabs_->moment_changed();
    refresh();
}

void ViewerPanel::refresh()
{
    auto& first = model_.first();
    window_.setWindowTitle(model_.title());
    problem_label_->setCaption(model_.problem());
    if (auto* browser = model_.browser(); browser)
    {
        set_steps(*log_slider_, browser->size(), browser->index());
        log_label_->setCaption("log " + of_text(browser->index(), browser->size()) + ": " +
                               first.file_name());
        const auto* log = first.log();
        verdict_label_->setCaption(log ? verdict_line_of(*log) : "");
        set_steps(*pose_slider_, first.moments().size(), first.moment_index());
        pose_label_->setCaption(log ? "pose " + of_text(first.moment_index(), first.moments().size()) + ": " +
                                          to_string(first.moments()[first.moment_index()])
                                    : "");
    }
    if (!second_slider_) return;
    set_steps(*second_slider_, model_.browser()->size(), model_.second_index());
    second_label_->setCaption(model_.second() ? "right: " + model_.second()->file_name() : "");
}

bool ViewerPanel::key(int key, int action)
{
    if (action == GLFW_RELEASE) return false;
    const auto moment = static_cast<long>(model_.first().moment_index());
    const auto step_log = [this](long by)
    {
        model_.step_log(by);
        log_changed();
        return true;
    };
    const auto to_moment = [this](long index)
    {
        go_to_moment(index);
        return true;
    };
    constexpr long FAR = 1'000'000'000;
    switch (key)
    {
        case GLFW_KEY_LEFT:
            return step_log(-1);
        case GLFW_KEY_RIGHT:
            return step_log(1);
        case GLFW_KEY_PAGE_UP:
            return step_log(-100);
        case GLFW_KEY_PAGE_DOWN:
            return step_log(100);
        case GLFW_KEY_HOME:
            return step_log(-FAR);
        case GLFW_KEY_END:
            return step_log(FAR);
        case GLFW_KEY_DOWN:
            return to_moment(moment - 1);
        case GLFW_KEY_UP:
            return to_moment(moment + 1);
        case GLFW_KEY_I:
            return to_moment(model_.first().at_last_moment() ? 0 : FAR);
        case GLFW_KEY_SPACE:
            playing_ = !playing_;
            if (play_button_) play_button_->setPushed(playing_);
            return true;
        case GLFW_KEY_Q:
            window_.setVisible(false);
            return true;
        default:
            return false;
    }
}

}  // namespace mp2p_icp_apps
