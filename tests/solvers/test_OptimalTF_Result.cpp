#include <gtest/gtest.h>
#include <mp2p_icp/OptimalTF_Result.h>

TEST(OptimalTfResult, BeginsWithTheIdentityAndNoOutliers)
{
    mp2p_icp::OptimalTF_Result r;
    EXPECT_EQ(r.optimalPose, mrpt::poses::CPose3D());
    EXPECT_EQ(r.optimalScale, 1.0);
    EXPECT_TRUE(r.outliers.empty());
    r.outliers.point2point = {3, 5};
    EXPECT_FALSE(r.outliers.empty());
    EXPECT_EQ(r.outliers.size(), 2u);
}
