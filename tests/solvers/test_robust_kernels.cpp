#include <gtest/gtest.h>
#include <mp2p_icp/robust_kernels.h>

#include <cmath>

using namespace mp2p_icp;

TEST(RobustKernels, AreTheirFormulas)
{
    for (const double e : {0.0, 0.1, 1.0, 30.0})
        for (const double c : {0.01, 1.0, 5.0})
        {
            EXPECT_EQ(robust_weight(RobustKernel::None, e * e, c), 1.0);
            EXPECT_NEAR(robust_weight(RobustKernel::Cauchy, e * e, c), 1 / (1 + e * e / (c * c)), 1e-15);
            EXPECT_NEAR(robust_weight(RobustKernel::GemanMcClure, e * e, c),
                        std::pow(1 + e * e / (c * c), -2), 1e-15);
        }
}

TEST(RobustKernels, FallFromOneTowardsZero)
{
    for (const auto kernel : {RobustKernel::Cauchy, RobustKernel::GemanMcClure})
    {
        EXPECT_EQ(robust_weight(kernel, 0, 0.5), 1.0);
        double before = 1;
        for (double e = 0.1; e < 1e6; e *= 2)
        {
            const double w = robust_weight(kernel, e * e, 0.5);
            EXPECT_LT(w, before);
            EXPECT_GT(w, 0);
            before = w;
        }
        EXPECT_LT(before, 1e-11);
    }
}

TEST(RobustKernels, AreTheWeightsOfTheirLosses)
{
    // Reweighting minimises a loss rho(e^2) when the weight is d rho / d e^2.
    const double c = 0.7, h = 1e-6;
    const auto cauchy = [&](double s) { return c * c * std::log1p(s / (c * c)); };
    const auto geman_mcclure = [&](double s) { return c * c * s / (c * c + s); };
    for (const double s : {0.01, 0.5, 4.0})
    {
        EXPECT_NEAR(robust_weight(RobustKernel::Cauchy, s, c), (cauchy(s + h) - cauchy(s - h)) / (2 * h),
                    1e-8);
        EXPECT_NEAR(robust_weight(RobustKernel::GemanMcClure, s, c),
                    (geman_mcclure(s + h) - geman_mcclure(s - h)) / (2 * h), 1e-8);
    }
}

TEST(RobustKernels, WeightIsTheLossesDerivativeOverTheResidualOnBothSidesOfSwitches)
{
    const double c = 0.7;
    for (const auto kernel : {RobustKernel::None, RobustKernel::GemanMcClure, RobustKernel::Cauchy,
                              RobustKernel::Huber, RobustKernel::Tukey, RobustKernel::Truncated})
        for (const double e : {0.01, 0.3, c - 1e-3, c + 1e-3, 1.5, 40.0})
        {
            const double h = 1e-5;
            const auto half_loss = [&](double x) { return 0.5 * robust_loss(kernel, x * x, c); };
            const double slope = (half_loss(e + h) - half_loss(e - h)) / (2 * h);
            // Rounding of a loss up to 800, over h.
            EXPECT_NEAR(robust_weight(kernel, e * e, c), slope / e, 1e-7) << int(kernel) << " at " << e;
        }
}

TEST(RobustKernels, WithAScaleAtWhichTheySwitchAreTheirFormulas)
{
    const double c = 2;
    EXPECT_EQ(robust_weight(RobustKernel::Huber, 4, c), 1);
    EXPECT_NEAR(robust_weight(RobustKernel::Huber, 25, c), 2.0 / 5, 1e-15);
    EXPECT_NEAR(robust_weight(RobustKernel::Tukey, 1, c), 9.0 / 16, 1e-15);
    EXPECT_EQ(robust_weight(RobustKernel::Tukey, 4, c), 0);
    EXPECT_EQ(robust_weight(RobustKernel::Tukey, 5, c), 0);
    EXPECT_EQ(robust_weight(RobustKernel::Truncated, 4, c), 1);
    EXPECT_EQ(robust_weight(RobustKernel::Truncated, 4.001, c), 0);
    for (const auto kernel : {RobustKernel::Huber, RobustKernel::Tukey, RobustKernel::Truncated})
    {
        EXPECT_EQ(robust_weight(kernel, 0, c), 1);
        EXPECT_EQ(robust_loss(kernel, 0, c), 0);
        // No jump of the loss at the switch.
        EXPECT_NEAR(robust_loss(kernel, 4 + 1e-9, c), robust_loss(kernel, 4 - 1e-9, c), 1e-8);
    }
    EXPECT_NEAR(robust_loss(RobustKernel::Huber, 25, c), 2 * 2 * 5 - 4, 1e-14);
    EXPECT_NEAR(robust_loss(RobustKernel::Tukey, 1e6, c), 4.0 / 3, 1e-15);
    EXPECT_EQ(robust_loss(RobustKernel::Truncated, 1e6, c), 4);
}
