#include <gtest/gtest.h>
#include <mp2p_icp/fitted_line.h>
#include <mp2p_icp/plane_patch.h>

#include <cmath>
#include <functional>
#include <limits>

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

namespace
{
/// Turned by 30 degrees, so that the axes of the covariance are not those of the fit.
Eigen::Matrix2d covariance_of_deviations(double larger, double smaller)
{
    const Eigen::Matrix2d R = Eigen::Rotation2Dd(M_PI / 6).toRotationMatrix();
    return R * Eigen::Vector2d(larger * larger, smaller * smaller).asDiagonal() * R.transpose();
}
}  // namespace

TEST(plane_fit_t, deviationsAreThoseOfTheLeastKnownDirection)
{
    mp2p_icp::plane_fit_t fit;
    fit.covariance.topLeftCorner<2, 2>() = covariance_of_deviations(0.03, 0.01);
    fit.covariance(2, 2) = 0.0004;
    EXPECT_NEAR(fit.angle_deviation(), 0.03, 1e-15);
    EXPECT_NEAR(fit.offset_deviation(), 0.02, 1e-15);
    EXPECT_TRUE(fit.is_sound());
}

TEST(line_fit_t, deviationsAreThoseOfTheLeastKnownDirection)
{
    mp2p_icp::line_fit_t fit;
    fit.covariance.topLeftCorner<2, 2>() = covariance_of_deviations(0.03, 0.01);
    fit.covariance.bottomRightCorner<2, 2>() = covariance_of_deviations(0.05, 0.01);
    EXPECT_NEAR(fit.offset_deviation(), 0.03, 1e-15);
    EXPECT_NEAR(fit.angle_deviation(), 0.05, 1e-15);
    fit.begin = -1, fit.end = 3;
    EXPECT_EQ(fit.length(), 4);
    EXPECT_TRUE(fit.is_sound());
}

TEST(plane_fit_t, isNotSoundWithNumbersThatNoFitGives)
{
    using Fit = mp2p_icp::plane_fit_t;
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    const std::function<void(Fit&)> spoils[] = {[](Fit& f) {
                                                    f.axis_u = {1, 1, 0};
                                                },
                                                [nan](Fit& f) { f.axis_u.x() = nan; },
                                                [](Fit& f) { f.u_min = 1; },
                                                [](Fit& f) { f.v_max = -1; },
                                                [inf](Fit& f) { f.v_max = inf; },
                                                [nan](Fit& f) { f.u_max = nan; },
                                                [](Fit& f) { f.sigma = -1; },
                                                [inf](Fit& f) { f.sigma = inf; },
                                                [](Fit& f) { f.covariance(1, 1) = -1e-9; },
                                                [nan](Fit& f) { f.covariance(0, 2) = nan; }};
    for (const auto& spoil : spoils)
    {
        Fit fit;
        spoil(fit);
        EXPECT_FALSE(fit.is_sound());
    }
}

TEST(line_fit_t, isNotSoundWithNumbersThatNoFitGives)
{
    using Fit = mp2p_icp::line_fit_t;
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    const std::function<void(Fit&)> spoils[] = {
        [](Fit& f) { f.axis_a = {0, 0, 0}; },    [](Fit& f) { f.begin = 1; },
        [inf](Fit& f) { f.end = inf; },          [nan](Fit& f) { f.sigma = nan; },
        [](Fit& f) { f.covariance(3, 3) = -1; }, [inf](Fit& f) { f.covariance(0, 3) = inf; }};
    for (const auto& spoil : spoils)
    {
        Fit fit;
        spoil(fit);
        EXPECT_FALSE(fit.is_sound());
    }
}
