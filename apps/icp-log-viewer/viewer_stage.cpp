#include "viewer_stage.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp_apps
{
using mp2p_icp::LogScene;

namespace
{
constexpr float WINDOW_SCALE = 100;  // MRPT's mouse handling does not zoom nearer than 1
constexpr float NEAREST = 0.1f, FARTHEST = 2e4f;
constexpr double FIELD_OF_VIEW_DEG = 30;
constexpr double FRONT_SHIFT = 0.002;  // of the data's size: local points are seen before global ones
const char* const NAMES[] = {"main", "second"};
}  // namespace

ViewerStage::ViewerStage(mrpt::gui::CDisplayWindowGUI& window, int panel_width)
    : window_(window), panel_width_(panel_width)
{
    auto scene = mrpt::opengl::COpenGLScene::Create();
    scene->createViewport(NAMES[1]);
    for (const auto* name : NAMES)
    {
        const auto view = scene->getViewport(name);
        mp2p_icp::prepare_viewport(*view);
        view->setViewportClipDistances(NEAREST, FARTHEST);
    }
    window_.background_scene = scene;
    window_.camera().setCameraFOV(static_cast<float>(FIELD_OF_VIEW_DEG));
}

mrpt::opengl::COpenGLViewport::Ptr ViewerStage::viewport(size_t side)
{
    return window_.background_scene->getViewport(NAMES[side]);
}

void ViewerStage::set_scenes(const std::vector<LogScene*>& scenes)
{
    const bool other_layout = scenes.size() != scenes_.size();
    scenes_ = scenes;
    followed_.reset();
    fill_viewports();
    if (other_layout) look_from(direction_);
}

void ViewerStage::fill_viewports()
{
    const std::lock_guard<std::mutex> lock(window_.background_scene_mtx);
    for (size_t side = 0; side < std::size(NAMES); side++)
    {
        viewport(side)->clear();
        if (side >= scenes_.size() || !scenes_[side]) continue;
        auto enlarged = mrpt::opengl::CSetOfObjects::Create();
        enlarged->setScale(WINDOW_SCALE);
        enlarged->insert(scenes_[side]->object());
        viewport(side)->insert(enlarged);
    }
}

void ViewerStage::look_from(const mp2p_icp::ViewDirection& direction)
{
    direction_ = direction;
    if (scenes_.empty() || !scenes_[0]) return;
    const double width = std::max(1, window_.width() - panel_width_) / static_cast<double>(scenes_.size());
    const double ratio = width / std::max(1, window_.height());
    const auto view = scenes_[0]->fit(ratio, direction);
    auto& camera = window_.camera();
    const auto focus = scenes_[0]->in_scene(view.focus) * WINDOW_SCALE;
    camera.setCameraPointing(static_cast<float>(focus.x), static_cast<float>(focus.y),
                             static_cast<float>(focus.z));
    camera.setAzimuthDegrees(static_cast<float>(view.azimuth_deg));
    camera.setElevationDegrees(static_cast<float>(view.elevation_deg));
    const double height = view.height / scenes_[0]->unit() * WINDOW_SCALE;
    const double distance = 0.5 * height / std::tan(0.5 * mrpt::DEG2RAD(FIELD_OF_VIEW_DEG));
    // MRPT shows half the zoom distance along the shorter side of the picture.
    camera.setZoomDistance(
        static_cast<float>(camera.isCameraProjective() ? distance : 2 * height * std::min(1.0, ratio)));
}

void ViewerStage::set_orthographic(bool orthographic)
{
    window_.camera().setCameraProjective(!orthographic);
}

void ViewerStage::set_following(bool following)
{
    following_ = following;
    followed_.reset();
}

/// By what the local map has moved, so that the mouse may look beside it.
void ViewerStage::follow()
{
    if (!following_ || scenes_.empty() || !scenes_[0]) return;
    const auto now = scenes_[0]->in_scene(scenes_[0]->local_middle()) * WINDOW_SCALE;
    if (followed_)
    {
        const auto step = now - *followed_;
        auto& camera = window_.camera();
        camera.setCameraPointing(camera.getCameraPointingX() + static_cast<float>(step.x),
                                 camera.getCameraPointingY() + static_cast<float>(step.y),
                                 camera.getCameraPointingZ() + static_cast<float>(step.z));
    }
    followed_ = now;
}

/// Before and behind the point that the camera looks at.
void ViewerStage::clip()
{
    if (scenes_.empty() || !scenes_[0]) return;
    const auto& keep = scenes_[0]->options().clip;
    const double metre = WINDOW_SCALE / scenes_[0]->unit(), distance = window_.camera().getZoomDistance();
    const auto within = [](double d) { return static_cast<float>(std::clamp<double>(d, NEAREST, FARTHEST)); };
    const float near = within(distance - keep.before * metre), far = within(distance + keep.behind * metre);
    for (size_t side = 0; side < std::size(NAMES); side++)
        viewport(side)->setViewportClipDistances(near, std::max(far, near + NEAREST));
}

mrpt::math::TVector3D ViewerStage::towards_eye() const
{
    mp2p_icp::OrthoView view;
    view.azimuth_deg = window_.camera().getAzimuthDegrees();
    view.elevation_deg = window_.camera().getElevationDegrees();
    return view.towards_eye();
}

void ViewerStage::before_frame()
{
    const double panel = static_cast<double>(panel_width_) / std::max(panel_width_ + 1, window_.width());
    const double width = (1 - panel) / static_cast<double>(std::max<size_t>(1, scenes_.size()));
    const bool two = scenes_.size() > 1;
    const double gap = two ? 2.0 / window_.width() : 0;
    viewport(0)->setViewportPosition(panel, 0, width - gap, 1);
    // A viewport cannot be hidden: an empty one of nearly no size is as good.
    viewport(1)->setViewportPosition(two ? panel + width : 0, 0, two ? width : 1e-3, two ? 1 : 1e-3);
    window_.camera().updateCameraParams(viewport(1)->getCamera());
    follow();
    clip();
    for (auto* scene : scenes_)
        if (scene) scene->bring_forward(towards_eye() * FRONT_SHIFT);
}

}  // namespace mp2p_icp_apps
