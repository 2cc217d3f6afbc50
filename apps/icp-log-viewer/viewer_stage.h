#pragma once

#include <mp2p_icp/log_scene.h>
#include <mrpt/gui/CDisplayWindowGUI.h>

#include <optional>
#include <vector>

namespace mp2p_icp_apps
{
/** The 3-D part of the window, right of its panel: one scene, or two side by side seen with one camera. The
 * mouse turns it (left), moves it (right) and zooms (wheel).
 */
class ViewerStage
{
 public:
    explicit ViewerStage(mrpt::gui::CDisplayWindowGUI& window, int panel_width);

    /// At most two; those that are null leave their side empty. Looks at all again if their number changes.
    void set_scenes(const std::vector<mp2p_icp::LogScene*>& scenes);
    void look_from(const mp2p_icp::ViewDirection& direction);  ///< at all that there is
    void set_orthographic(bool orthographic);
    /// The camera goes where the local map of the first scene goes.
    void set_following(bool following);

    /// To be called before each frame.
    void before_frame();

 private:
    void fill_viewports();
    void follow();
    void clip();
    mrpt::opengl::COpenGLViewport::Ptr viewport(size_t side);
    mrpt::math::TVector3D towards_eye() const;

    mrpt::gui::CDisplayWindowGUI& window_;
    int panel_width_;
    std::vector<mp2p_icp::LogScene*> scenes_;
    mp2p_icp::ViewDirection direction_;  ///< that was looked from last
    bool following_ = false;
    std::optional<mrpt::math::TPoint3D> followed_;  ///< where the local map was, in the window
};

}  // namespace mp2p_icp_apps
