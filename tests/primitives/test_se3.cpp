#include <gtest/gtest.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/random_pose.h>

#include <cmath>
#include <limits>

using namespace mp2p_icp;
using mrpt::poses::CPose3D;

namespace
{
Eigen::Vector3d random_direction(SeededRandom& random)
{
    return Eigen::Vector3d(random.gaussian(), random.gaussian(), random.gaussian()).normalized();
}

CPose3D any_pose(SeededRandom& random)
{
    return synthetic::random_pose({50, 50, 50, M_PI, M_PI / 2, M_PI}, random);
}
}  // namespace

TEST(Se3, RotationAngleIsAccurateEverywhere)
{
    SeededRandom random(1);
    for (const double angle :
         {0.0, 1e-12, 1e-9, 1e-5, 0.1, 1.0, M_PI / 2, 3.0, M_PI - 1e-5, M_PI - 1e-9, M_PI})
    {
        for (int i = 0; i < 50; i++)
        {
            const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, random_direction(random)).toRotationMatrix();
            // The entries of R are rounded to 1e-16: so is the sine at both ends.
            EXPECT_NEAR(rotation_angle(R), angle, 1e-15) << angle;
        }
    }
    EXPECT_EQ(rotation_angle(Eigen::Matrix3d::Identity()), 0.0);
}

TEST(Se3, RotationAngleDoesNotDependOnTheSenseOfTurning)
{
    for (const double angle : {0.3, 2.0, M_PI - 1e-9})
    {
        const Eigen::Matrix3d R =
            Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
        EXPECT_NEAR(rotation_angle(R.transpose()), angle, 1e-15);
    }
}

TEST(Se3, APoseIsTakenApartAndPutTogetherAgain)
{
    SeededRandom random(2);
    for (int i = 0; i < 100; i++)
    {
        const CPose3D pose = any_pose(random);
        const CPose3D back = make_pose(rotation_of(pose), translation_of(pose));
        EXPECT_EQ(rotation_of(back), rotation_of(pose));
        EXPECT_EQ(translation_of(back), translation_of(pose));
        EXPECT_NEAR((back - pose).norm(), 0, 1e-12);
        // The angles, which MRPT computes lazily, are those of the new rotation.
        EXPECT_NEAR(back.yaw(), pose.yaw(), 1e-9);
        EXPECT_NEAR(back.pitch(), pose.pitch(), 1e-9);
        EXPECT_NEAR(back.roll(), pose.roll(), 1e-9);
        const mrpt::math::TPoint3D p(1, -2, 3);
        const Eigen::Vector3d moved = rotation_of(pose) * to_eigen(p) + translation_of(pose);
        EXPECT_NEAR((moved - to_eigen(pose.composePoint(p))).norm(), 0, 1e-13);
    }
}

TEST(Se3, OnePointFormsAreInverse)
{
    const mrpt::math::TPoint3D p(1, 2, 3);
    EXPECT_EQ(to_mrpt(to_eigen(p)), p);
    EXPECT_EQ(to_eigen(p), Eigen::Vector3d(1, 2, 3));
}

TEST(Se3, AllTwelveNumbersMustBeFinite)
{
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(is_finite(CPose3D()));
    EXPECT_TRUE(is_finite(CPose3D(1e300, 0, 0, 1, 2, 3)));
    for (const double bad : {nan, inf, -inf})
    {
        EXPECT_FALSE(is_finite(CPose3D(bad, 0, 0, 0, 0, 0)));
        EXPECT_FALSE(is_finite(CPose3D(0, 0, bad, 0, 0, 0)));
        Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
        R(2, 1) = bad;
        EXPECT_FALSE(is_finite(make_pose(R, Eigen::Vector3d::Zero())));
    }
}

TEST(Se3, PointsOfALineMoveWithIt)
{
    SeededRandom random(3);
    for (int i = 0; i < 100; i++)
    {
        const CPose3D pose = any_pose(random);
        mrpt::math::TLine3D line;
        line.pBase = {random.uniform(-20, 20), random.uniform(-20, 20), random.uniform(-20, 20)};
        const Eigen::Vector3d u = random_direction(random);
        line.director = to_mrpt(u);
        const auto moved = compose(pose, line);
        const Eigen::Vector3d base = to_eigen(moved.pBase);
        const Eigen::Vector3d direction(moved.director.x, moved.director.y, moved.director.z);
        EXPECT_NEAR(direction.norm(), 1, 1e-14);
        for (const double s : {-7.0, 0.0, 12.5})
        {
            const auto point = pose.composePoint(to_mrpt(to_eigen(line.pBase) + s * u));
            // At the same parameter: the direction keeps its sense.
            EXPECT_NEAR((base + s * direction - to_eigen(point)).norm(), 0, 1e-12);
        }
    }
}

TEST(Se3, PointsOfAPlaneMoveWithItAndKeepTheirSide)
{
    SeededRandom random(4);
    for (int i = 0; i < 100; i++)
    {
        const CPose3D pose = any_pose(random);
        const Eigen::Vector3d n = random_direction(random);
        const Eigen::Vector3d c(random.uniform(-20, 20), random.uniform(-20, 20), random.uniform(-20, 20));
        plane_patch_t patch;
        patch.plane.coefs = {n.x(), n.y(), n.z(), -n.dot(c)};
        patch.centroid = to_mrpt(c);
        const plane_patch_t moved = compose(pose, patch);
        EXPECT_NEAR((to_eigen(moved.centroid) - to_eigen(pose.composePoint(patch.centroid))).norm(), 0,
                    1e-13);
        for (int k = 0; k < 5; k++)
        {
            const mrpt::math::TPoint3D p(random.uniform(-30, 30), random.uniform(-30, 30),
                                         random.uniform(-30, 30));
            const auto signed_distance = [](const plane_patch_t& pl, const mrpt::math::TPoint3D& q) {
                return pl.plane.coefs[0] * q.x + pl.plane.coefs[1] * q.y + pl.plane.coefs[2] * q.z +
                       pl.plane.coefs[3];
            };
            EXPECT_NEAR(signed_distance(moved, pose.composePoint(p)), signed_distance(patch, p), 1e-12);
        }
    }
}

TEST(compose, fitsTurnWithTheirPrimitives)
{
    SeededRandom random(5);
    for (int i = 0; i < 20; i++)
    {
        const CPose3D pose = any_pose(random);
        mp2p_icp::fitted_plane_t plane;
        plane.plane.coefs = {0, 0, 1, -2};
        plane.centroid = {3, 4, 2};
        plane.fit.emplace().axis_u = {0.6, 0.8, 0};
        plane.fit->u_min = -1, plane.fit->inliers = 7, plane.fit->covariance(0, 2) = 5;
        const auto moved = compose(pose, plane);
        EXPECT_NEAR((moved.fit->axis_u - rotation_of(pose) * plane.fit->axis_u).norm(), 0, 1e-14);
        EXPECT_NEAR(moved.fit->axis_u.dot(moved.normal()), 0, 1e-14);
        EXPECT_EQ(moved.fit->u_min, -1);
        EXPECT_EQ(moved.fit->inliers, 7u);
        EXPECT_EQ(moved.fit->covariance, plane.fit->covariance);
        EXPECT_EQ(moved.plane.coefs, compose(pose, static_cast<const plane_patch_t&>(plane)).plane.coefs);

        mp2p_icp::fitted_line_t line;
        line.pBase = {1, 2, 3}, line.director = {0, 0, 1};
        EXPECT_FALSE(compose(pose, line).fit);
        line.fit.emplace().axis_a = {0.6, 0.8, 0};
        line.fit->end = 2;
        const auto moved_line = compose(pose, line);
        EXPECT_NEAR((moved_line.fit->axis_a - rotation_of(pose) * line.fit->axis_a).norm(), 0, 1e-14);
        EXPECT_EQ(moved_line.fit->end, 2);
        EXPECT_EQ(moved_line.pBase, pose.composePoint(line.pBase));
    }
}
