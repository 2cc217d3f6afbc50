#include <gtest/gtest.h>
#include <mp2p_icp/pose_step.h>

#include <cmath>

using namespace mp2p_icp;
using mrpt::poses::CPose3D;

TEST(step_between, measures_how_far_one_pose_is_from_the_other)
{
    const CPose3D a(1, 2, 3, 0.4, -0.3, 0.2);
    const PoseStep moved = step_between(a, a + CPose3D(3, 0, 4, 0, 0, 0));
    EXPECT_NEAR(moved.metres, 5, 1e-12);
    EXPECT_NEAR(moved.radians, 0, 1e-12);

    const PoseStep turned = step_between(a, a + CPose3D(0, 0, 0, 0, -0.7, 0));
    EXPECT_NEAR(turned.metres, 0, 1e-12);
    EXPECT_NEAR(turned.radians, 0.7, 1e-12);

    const PoseStep both = step_between(a, a + CPose3D(2, -2, 0, M_PI / 2, 0, 0));
    EXPECT_NEAR(both.metres, std::sqrt(8), 1e-12);
    EXPECT_NEAR(both.radians, M_PI / 2, 1e-12);

    EXPECT_NEAR(step_between(a, a).metres, 0, 1e-15);
    EXPECT_TRUE(std::isnan(step_between(a, CPose3D(NAN, 0, 0, 0, 0, 0)).metres));
    EXPECT_TRUE(std::isnan(step_between(CPose3D(0, 0, 0, INFINITY, 0, 0), a).radians));
}
