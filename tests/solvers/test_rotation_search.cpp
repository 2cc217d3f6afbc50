#include <gtest/gtest.h>

#include <vector>

#include "../../mp2p_icp/solvers/src/rotation_search.h"
#include "random_pairings.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Matrix10 = Eigen::Matrix<double, 10, 10>;
using Vector10 = Eigen::Matrix<double, 10, 1>;

namespace
{
RotationQuadratic random_quadratic(SeededRandom& random)
{
    return RotationQuadratic(
        pose_quadratic(random_pairings({2, 2, 2, 2, 2}, any_rotation(random), {1, 2, 3}, random, 0.5)));
}

Vector10 stacked(const Matrix3d& R)
{
    Vector10 x;
    x << R.col(0), R.col(1), R.col(2), 1;
    return x;
}

/// x' P x = 0 for all x = (columns of a rotation, 1).
std::vector<Matrix10> constraints()
{
    std::vector<Matrix10> all;
    const auto add = [&all](const auto& fill)
    {
        Matrix10 P = Matrix10::Zero();
        fill(P);
        all.push_back(P + P.transpose());
    };
    for (int a = 0; a < 3; a++)
        for (int b = 0; b <= a; b++)
        {
            add([=](Matrix10& P) {  // columns, R' R = I
                for (int i = 0; i < 3; i++) P(3 * a + i, 3 * b + i) += 1;
                P(9, 9) -= a == b ? 1 : 0;
            });
            add([=](Matrix10& P) {  // rows, R R' = I
                for (int j = 0; j < 3; j++) P(3 * j + a, 3 * j + b) += 1;
                P(9, 9) -= a == b ? 1 : 0;
            });
        }
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 3; i++)
            add([=](Matrix10& P) {  // column j x column j+1 = column j+2
                const int k = (j + 1) % 3, l = (j + 2) % 3, m = (i + 1) % 3, n = (i + 2) % 3;
                P(3 * j + m, 3 * k + n) += 1, P(3 * j + n, 3 * k + m) -= 1, P(3 * l + i, 9) -= 1;
            });
    return all;
}

Eigen::Index rank_of(const Eigen::MatrixXd& M)
{
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(M);
    qr.setThreshold(1e-10);
    return qr.rank();
}
}  // namespace

TEST(RotationQuadratic, ItsDerivativesAreThoseOfTheCost)
{
    SeededRandom random(1);
    for (int k = 0; k < 30; k++)
    {
        const RotationQuadratic f = random_quadratic(random);
        const Matrix3d R = any_rotation(random);
        const auto d = f.derivatives(R);
        const auto cost = [&](const Vector3d& omega)
        { return f.cost(omega.norm() > 0 ? Matrix3d(rotation_about(omega, omega.norm()) * R) : R); };
        EXPECT_NEAR(d.cost, f.cost(R), 1e-12 * f.matrix().norm());
        // Errors: h^2 of the third and fourth derivatives, rounding / h and / h^2; f is some |Q|.
        const double size = f.matrix().norm(), h = 1e-4;
        for (int i = 0; i < 3; i++)
        {
            const Vector3d e = h * Vector3d::Unit(i);
            EXPECT_NEAR(d.gradient(i), (cost(e) - cost(-e)) / (2 * h), 1e-6 * size);
            for (int j = 0; j < 3; j++)
            {
                const Vector3d u = h * Vector3d::Unit(j);
                const double mixed = (cost(e + u) - cost(e - u) - cost(u - e) + cost(-e - u)) / (4 * h * h);
                EXPECT_NEAR(d.hessian(i, j), mixed, 1e-6 * size);
            }
        }
        EXPECT_GT(d.gradient.norm(), 1e-3 * size) << "nothing is tested at a stationary rotation";
    }
}

TEST(RotationQuadratic, TwentyConstraintsHoldOnRotationsAndLeaveFourteenMultipliers)
{
    const auto all = constraints();
    ASSERT_EQ(all.size(), 21u);
    SeededRandom random(2);
    Eigen::MatrixXd entries(100, 21), at_rotation(10, 21);
    const Vector10 x = stacked(any_rotation(random));
    for (size_t k = 0; k < all.size(); k++)
    {
        for (int i = 0; i < 5; i++)
        {
            const Vector10 y = stacked(any_rotation(random));
            EXPECT_NEAR(y.dot(all[k] * y), 0, 1e-14);
        }
        entries.col(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::VectorXd>(all[k].data(), 100);
        at_rotation.col(static_cast<Eigen::Index>(k)) = all[k] * x;
    }
    EXPECT_EQ(rank_of(entries), 20) << "the traces of R' R and R R' agree";
    EXPECT_EQ(rank_of(at_rotation), 6) << "20 - 6 multipliers are free at a stationary rotation";
}

TEST(RotationSearch, SixtyRotationsAreSpreadOverAll)
{
    const auto& all = spread_rotations();
    ASSERT_EQ(all.size(), 60u);
    SeededRandom random(3);
    double farthest = 0;
    for (int k = 0; k < 2000; k++)
    {
        const Matrix3d R = any_rotation(random);
        double nearest = 10;
        for (const auto& S : all) nearest = std::min(nearest, angle_between(R, S));
        farthest = std::max(farthest, nearest);
    }
    // The cells of the 600-cell reach 2 * 22.24 degrees.
    EXPECT_LT(farthest, 2 * 22.25 * M_PI / 180);
    EXPECT_GT(farthest, 0.6);
}

TEST(RotationSearch, TheLowestSpreadRotationsComeInTheOrderOfTheirCosts)
{
    SeededRandom random(4);
    const RotationQuadratic f = random_quadratic(random);
    const auto lowest = lowest_spread_rotations(f, 5);
    ASSERT_EQ(lowest.size(), 5u);
    size_t lower = 0;
    for (const auto& S : spread_rotations()) lower += f.cost(S) < f.cost(lowest.back()) - 1e-9;
    EXPECT_EQ(lower, 4u);
    for (size_t i = 1; i < 5; i++) EXPECT_LE(f.cost(lowest[i - 1]), f.cost(lowest[i]) + 1e-9);
}
