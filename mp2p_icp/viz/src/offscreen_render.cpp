#include <mp2p_icp/errors.h>
#include <mp2p_icp/offscreen_render.h>
#include <mrpt/opengl/CFBORender.h>

#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>

namespace mp2p_icp
{
namespace
{
// MRPT takes a viewport of one pixel for one of 100 %; Mesa's software renderer can do 8192.
constexpr int MIN_SIZE_PX = 2, MAX_SIZE_PX = 8192;

void check(int size_px, const char* name)
{
    if (size_px < MIN_SIZE_PX || size_px > MAX_SIZE_PX)
        throw std::invalid_argument(std::string("render_offscreen: ") + name + " must be in [" +
                                    std::to_string(MIN_SIZE_PX) + ", " + std::to_string(MAX_SIZE_PX) +
                                    "], found " + std::to_string(size_px));
}

std::unique_ptr<mrpt::opengl::CFBORender> make_renderer(int width_px, int height_px)
{
    try
    {
        return std::make_unique<mrpt::opengl::CFBORender>(static_cast<unsigned>(width_px),
                                                          static_cast<unsigned>(height_px));
    }
    catch (const std::exception& e)
    {
        throw std::runtime_error(
            "this machine cannot draw pictures without a display (OpenGL through EGL); "
            "installing the packages libegl1 and libgl1-mesa-dri (Debian, Ubuntu) should help. Reason: " +
            short_reason(e));
    }
}

/// What was made in the OpenGL context of a renderer must go before it does, and be made anew in the next.
void forget_context(mrpt::opengl::COpenGLScene& scene, mrpt::opengl::COpenGLViewport& viewport)
{
    scene.freeOpenGLResources();
    viewport.shaders().clear();
    scene.visitAllObjects([](const mrpt::opengl::CRenderizable::Ptr& object) { object->notifyChange(); });
}
}  // namespace

mrpt::img::CImage render_offscreen(mrpt::opengl::COpenGLScene& scene, int width_px, int height_px)
{
    check(width_px, "width_px");
    check(height_px, "height_px");
    static std::mutex one_at_a_time;  // MRPT's font and shader caches are shared by all contexts
    const std::lock_guard<std::mutex> lock(one_at_a_time);

    // MRPT 2.5.8 reads rows of pixels that OpenGL pads to four bytes: other widths would overrun its buffer.
    const int padded_width_px = (width_px + 3) / 4 * 4;
    const auto viewport = scene.getViewport();
    viewport->setViewportPosition(0, 0, width_px, height_px);
    const auto renderer = make_renderer(padded_width_px, height_px);
    renderer->setCamera(scene, viewport->getCamera());
    mrpt::img::CImage padded, picture;
    renderer->render_RGB(scene, padded);
    forget_context(scene, *viewport);
    padded.extract_patch(picture, 0, 0, static_cast<unsigned>(width_px), static_cast<unsigned>(height_px));
    return picture;
}

}  // namespace mp2p_icp
