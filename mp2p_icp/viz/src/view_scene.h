#pragma once

#include <mp2p_icp/ortho_view.h>
#include <mrpt/opengl/COpenGLScene.h>

namespace mp2p_icp
{
/// An empty scene on a white ground, with the camera of the view in the main viewport.
mrpt::opengl::COpenGLScene::Ptr scene_of_view(const OrthoView& view, int width_px, int height_px);

/** In a parallel view, a shift towards the eye changes nothing but who hides whom. In heights of the picture:
 * how much nearer to the eye the next thing is drawn. Between points that the depth buffer cannot tell apart
 * (Mesa: 1/4096 of the depth shown), the one that was drawn first is seen.
 */
constexpr double PRIORITY_SHIFT = 0.004;

/// A picture of the scene with smooth edges: drawn at twice the size and averaged.
constexpr int SUPERSAMPLING = 2;
mrpt::img::CImage render_smooth(mrpt::opengl::COpenGLScene& scene, int width_px, int height_px);

}  // namespace mp2p_icp
