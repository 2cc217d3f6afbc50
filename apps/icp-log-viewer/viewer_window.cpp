#include "viewer_window.h"

#include <chrono>
#include <cstdlib>
#include <ostream>
#include <stdexcept>

#include "viewer_panel.h"

namespace mp2p_icp_apps
{
namespace
{
constexpr int PANEL_WIDTH = 430;
constexpr double PLAY_PERIOD_S = 0.1;
const char* const NO_DISPLAY =
    "there is no display to open a window on; --snapshot FILE.png and --snapshot-dir DIR write pictures "
    "without one";

/// Measures how long it takes to draw a frame.
class TimedWindow : public mrpt::gui::CDisplayWindowGUI
{
 public:
    using CDisplayWindowGUI::CDisplayWindowGUI;

    void drawAll() override
    {
        const auto begin = std::chrono::steady_clock::now();
        CDisplayWindowGUI::drawAll();
        seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        frames_++;
    }
    size_t frames() const { return frames_; }
    double seconds_per_frame() const { return frames_ > 0 ? seconds_ / static_cast<double>(frames_) : 0; }

 private:
    size_t frames_ = 0;
    double seconds_ = 0;
};

/// GLFW, for as long as there is a window.
class Toolkit
{
 public:
    Toolkit()
    {
        const auto is_set = [](const char* name)
        {
            const char* value = std::getenv(name);
            return value && *value;
        };
        if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY")) throw std::runtime_error(NO_DISPLAY);
        // Before nanogui does, which would print its own lines about it.
        if (!glfwInit()) throw std::runtime_error(NO_DISPLAY);
        nanogui::init();
    }
    ~Toolkit() { nanogui::shutdown(); }
};

/// What the user chose on the command line wins over what is remembered.
ViewerOptions with_remembered(ViewerOptions options, const ViewerState& state)
{
    if (options.color == "side") options.color = state.color;
    options.pairings |= state.pairings, options.frames |= state.frames,
        options.covariance |= state.covariance;
    return options;
}

ViewerState state_of(const TimedWindow& window, ViewerModel& model, const ViewerPanel& panel)
{
    const auto& d = model.drawing();
    ViewerState s;
    s.width = window.width(), s.height = window.height();
    s.point_size = d.global.point_size_px;
    s.color = d.color_by_residual ? "residual" : d.global.by_height ? "height" : "side";
    s.pairings = d.draw_pairings, s.frames = d.frames, s.covariance = d.covariance;
    s.orthographic = panel.tabs().orthographic(), s.tab = panel.tabs().active();
    return s;
}

void print_speed(std::ostream& out, const TimedWindow& window, ViewerModel& model)
{
    const auto* scene = model.first().scene();
    if (!scene) return;
    out << "Drawn: " << window.frames() << " frames, " << 1e3 * window.seconds_per_frame()
        << " ms each; the last log: " << scene->points() << " points, sent to the graphics card "
        << scene->builds().cloud_uploads << " times" << std::endl;
}
}  // namespace

void open_viewer_window(const ViewerOptions& options, std::ostream& out)
{
    const std::string state_path = viewer_state_path();
    const ViewerState state = load_viewer_state(state_path);
    ViewerModel model(with_remembered(options, state), state);  // wrong input is told before a window opens
    const Toolkit toolkit;
    TimedWindow window("icp-log-viewer", static_cast<unsigned>(state.width),
                       static_cast<unsigned>(state.height));
    ViewerStage stage(window, PANEL_WIDTH);
    ViewerPanel panel(window, model, stage, PANEL_WIDTH);
    panel.tabs().set_orthographic(state.orthographic);
    panel.tabs().activate(state.tab);
    auto last_step = std::chrono::steady_clock::now();
    window.addLoopCallback(
        [&]
        {
            const auto now = std::chrono::steady_clock::now();
            if (panel.playing() && std::chrono::duration<double>(now - last_step).count() > PLAY_PERIOD_S)
                last_step = now, panel.play();
            panel.before_frame();
            stage.before_frame();
        });
    window.addKeyboardCallback([&](int key, int, int action, int) { return panel.key(key, action); });
    stage.look_from(options.picture().direction);
    window.drawAll();
    window.setVisible(true);
    nanogui::mainloop();
    save_viewer_state(state_of(window, model, panel), state_path);
    print_speed(out, window, model);
}

}  // namespace mp2p_icp_apps
