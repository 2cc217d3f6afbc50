#include "view_scene.h"

#include <mp2p_icp/offscreen_render.h>

namespace mp2p_icp
{
mrpt::opengl::COpenGLScene::Ptr scene_of_view(const OrthoView& view, int width_px, int height_px)
{
    auto scene = mrpt::opengl::COpenGLScene::Create();
    auto viewport = scene->getViewport();
    viewport->setCustomBackgroundColor({1, 1, 1, 1});
    viewport->getCamera() = view.camera(width_px, height_px);
    viewport->setViewportClipDistances(0, static_cast<float>(2 * view.depth / view.height));
    return scene;
}

mrpt::img::CImage render_smooth(mrpt::opengl::COpenGLScene& scene, int width_px, int height_px)
{
    const auto large = render_offscreen(scene, SUPERSAMPLING * width_px, SUPERSAMPLING * height_px);
    mrpt::img::CImage picture;
    large.scaleImage(picture, static_cast<unsigned>(width_px), static_cast<unsigned>(height_px),
                     mrpt::img::IMG_INTERP_AREA);
    return picture;
}

}  // namespace mp2p_icp
