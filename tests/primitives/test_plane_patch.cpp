#include <gtest/gtest.h>
#include <mp2p_icp/plane_patch.h>

TEST(PlanePatch, HoldsThePlaneAndTheCentroidItIsGiven)
{
    mrpt::math::TPlane plane;
    plane.coefs = {0, 0.6, 0.8, -5};
    const mp2p_icp::plane_patch_t patch(plane, {1, 3, 4});
    EXPECT_EQ(patch.plane.coefs, plane.coefs);
    EXPECT_EQ(patch.centroid, mrpt::math::TPoint3D(1, 3, 4));
    EXPECT_NEAR(patch.plane.evaluatePoint(patch.centroid), 0, 1e-15);
}

TEST(PlanePatch, ADefaultOneHasItsCentroidAtTheOrigin)
{
    EXPECT_EQ(mp2p_icp::plane_patch_t().centroid, mrpt::math::TPoint3D(0, 0, 0));
}
