#pragma once

#include <mrpt/img/CImage.h>
#include <mrpt/opengl/COpenGLScene.h>

namespace mp2p_icp
{
/** Renders the main viewport of a scene, as its camera sees it, into an RGB picture. Needs no display
 * (EGL). Sets the position of that viewport.
 * \param width_px,height_px 2 to 8192.
 * \exception std::invalid_argument for other sizes.
 * \exception std::runtime_error if this machine cannot render; says which packages to install. Thread-safe
 * for different scenes: renders one picture after the other. About 0.1 s for 1600x1200 pixels without a
 * graphics card.
 */
mrpt::img::CImage render_offscreen(mrpt::opengl::COpenGLScene& scene, int width_px, int height_px);

}  // namespace mp2p_icp
