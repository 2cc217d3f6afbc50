#include <gtest/gtest.h>
#include <mp2p_icp/offscreen_render.h>
#include <mrpt/opengl/CPointCloud.h>

#include <cstdlib>
#include <iostream>
#include <thread>

#include "picture_checks.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
/// One large red point at the origin, on white.
mrpt::opengl::COpenGLScene::Ptr red_point()
{
    auto scene = mrpt::opengl::COpenGLScene::Create();
    scene->getViewport()->setCustomBackgroundColor({1, 1, 1, 1});
    auto cloud = mrpt::opengl::CPointCloud::Create();
    cloud->insertPoint(0, 0, 0);
    cloud->setColor_u8(RED);
    cloud->enableVariablePointSize(false);
    cloud->setPointSize(20);
    scene->insert(cloud);
    return scene;
}

/// Tells on stderr what rendering ends with, in a process without any OpenGL driver.
void render_without_drivers()
{
    setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent", 1);
    try
    {
        render_offscreen(*red_point(), 100, 100);
        std::cerr << "it worked";
    }
    catch (const std::runtime_error& e)
    {
        std::cerr << e.what();
    }
    std::exit(0);
}
}  // namespace

TEST(render_offscreen, draws_what_is_in_the_scene_at_the_size_asked_for)
{
    const auto scene = red_point();
    for (int again = 0; again < 2; again++)  // a scene may be rendered several times
    {
        const auto picture = render_offscreen(*scene, 301, 207);
        ASSERT_EQ(picture.getWidth(), 301u);
        ASSERT_EQ(picture.getHeight(), 207u);
        EXPECT_EQ(count(picture, RED), 400u);
        EXPECT_EQ(count(picture, WHITE), 301u * 207u - 400u);
        EXPECT_TRUE(seen_at(picture, {150.5, 103.5}, RED));
    }
}

TEST(render_offscreen, works_from_several_threads)
{
    size_t reds[4] = {};
    std::vector<std::thread> threads;
    for (auto& n : reds)
        threads.emplace_back([&n]() { n = count(render_offscreen(*red_point(), 100, 80), RED); });
    for (auto& t : threads) t.join();
    for (const size_t n : reds) EXPECT_EQ(n, 400u);
}

TEST(render_offscreen, sizes_out_of_range_are_refused)
{
    EXPECT_THROW(render_offscreen(*red_point(), 0, 100), std::invalid_argument);
    EXPECT_THROW(render_offscreen(*red_point(), 100, -1), std::invalid_argument);
    EXPECT_THROW(render_offscreen(*red_point(), 100000, 100), std::invalid_argument);
}

TEST(render_offscreen_DeathTest, without_drivers_the_error_names_the_packages_to_install)
{
    ::testing::FLAGS_gtest_death_test_style =
        "threadsafe";  // a fresh process: EGL reads its environment only once
    EXPECT_EXIT(render_without_drivers(), ::testing::ExitedWithCode(0), "libegl1 and libgl1-mesa-dri");
}
