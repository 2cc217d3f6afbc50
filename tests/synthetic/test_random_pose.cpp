#include <gtest/gtest.h>
#include <mp2p_icp/synthetic/random_pose.h>

#include <cmath>

using mp2p_icp::SeededRandom;
using mp2p_icp::synthetic::random_pose;

TEST(random_pose, each_coordinate_is_uniform_within_its_own_limit)
{
    const mrpt::math::TPose3D limit(1, 2, 3, 0.4, 0.5, 0.6);
    SeededRandom random(1);
    constexpr int N = 20000;
    double sum[6] = {}, squares[6] = {};
    for (int i = 0; i < N; i++)
    {
        const auto pose = random_pose(limit, random).asTPose();
        for (size_t c = 0; c < 6; c++)
        {
            const double unit = pose[c] / limit[c];
            ASSERT_LE(std::abs(unit), 1 + 1e-12);
            sum[c] += unit;
            squares[c] += unit * unit;
        }
    }
    for (size_t c = 0; c < 6; c++)
    {
        EXPECT_NEAR(sum[c] / N, 0, 5 * std::sqrt(1.0 / 3 / N)) << c;  // 5 standard errors
        EXPECT_NEAR(squares[c] / N, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / N)) << c;
    }
}

TEST(random_pose, same_seed_same_poses)
{
    SeededRandom a(3), b(3), c(4);
    const mrpt::math::TPose3D limit(1, 1, 1, 1, 1, 1);
    const auto first = random_pose(limit, a);
    EXPECT_EQ(first, random_pose(limit, b));
    EXPECT_NE(first, random_pose(limit, c));
    EXPECT_NE(first, random_pose(limit, a)) << "the next pose is another one";
}

TEST(random_pose, bad_limits_are_refused)
{
    SeededRandom random(1);
    EXPECT_THROW(random_pose({-1, 0, 0, 0, 0, 0}, random), std::invalid_argument);
    EXPECT_THROW(random_pose({0, 0, 0, 0, 0, NAN}, random), std::invalid_argument);
    EXPECT_EQ(random_pose({0, 0, 0, 0, 0, 0}, random), mrpt::poses::CPose3D());
}
