#include "view_scene.h"

#include <mp2p_icp/log_scene.h>
#include <mp2p_icp/offscreen_render.h>

namespace mp2p_icp
{
void prepare_viewport(mrpt::opengl::COpenGLViewport& viewport)
{
    viewport.setCustomBackgroundColor({1, 1, 1, 1});
    auto& light = viewport.lightParameters();
    light.ambient = {0.7f, 0.7f, 0.7f, 1}, light.diffuse = {0.3f, 0.3f, 0.3f, 1},
    light.specular = {0, 0, 0, 1};
}

mrpt::opengl::COpenGLScene::Ptr scene_of_view(const OrthoView& view, int width_px, int height_px)
{
    auto scene = mrpt::opengl::COpenGLScene::Create();
    auto viewport = scene->getViewport();
    prepare_viewport(*viewport);
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
