#include <mp2p_icp/errorTerms.h>

#include "make_primitives.h"
#include "solver_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
template <class Vector>
Eigen::VectorXd as_eigen(const Vector& v)
{
    const auto n = static_cast<int>(v.size());
    Eigen::VectorXd out(n);
    for (int i = 0; i < n; i++) out(i) = v[i];
    return out;
}

using Entries = Eigen::Matrix<double, 12, 1>;
/// The 12 entries of (R, t), as the Jacobians stack them.
Entries entries(const CPose3D& pose)
{
    const Matrix3d R = rotation_of(pose);
    Entries e;
    e << R.col(0), R.col(1), R.col(2), translation_of(pose);
    return e;
}
struct Entry12Pose
{
    Matrix3d R;
    Vector3d t;
    explicit Entry12Pose(const Entries& e) : t(e.tail<3>())
    {
        R << e.segment<3>(0), e.segment<3>(3), e.segment<3>(6);
    }
};

/// Random rotations, then such within 1e-6 of, and at, half a turn.
std::vector<CPose3D> test_poses()
{
    SeededRandom random(1);
    std::vector<CPose3D> poses;
    for (int k = 0; k < 20; k++) poses.push_back(any_pose(random));
    for (const double off : {1e-3, 1e-6, 0.0})
        for (int k = 0; k < 5; k++)
            poses.push_back(
                make_pose(rotation_about(random_direction(random), M_PI - off), random_point(random, 20)));
    for (int axis = 0; axis < 3; axis++)
        poses.push_back(make_pose(rotation_about(Vector3d::Unit(axis), M_PI), random_point(random, 20)));
    return poses;
}

/** The Jacobian along twists of the pose, by central differences of the function itself, against
 * `jacobian` times d entries / d twist. The 12 entries of a rotation only move along 6 directions.
 */
template <class Residual>
void expect_tangent(const Residual& residual, const CPose3D& pose, const Eigen::MatrixXd& jacobian)
{
    const Matrix3d R = rotation_of(pose);
    const Vector3d t = translation_of(pose);
    const double h = 1e-5;
    for (int i = 0; i < 6; i++)
    {
        const auto at = [&](double s)
        {
            return i < 3 ? make_pose(R, t + s * Vector3d::Unit(i))
                         : make_pose(rotation_about(Vector3d::Unit(i - 3), s) * R, t);
        };
        const Eigen::VectorXd numeric = (residual(at(h)) - residual(at(-h))) / (2 * h);
        const Entries direction = (entries(at(h)) - entries(at(-h))) / (2 * h);
        EXPECT_LT((jacobian * direction - numeric).norm(), 1e-6 * (1 + jacobian.norm())) << "twist " << i;
    }
}

/// Each of the 12 columns, by central differences of `formula`, which takes any 12 numbers as pose.
template <class Formula>
void expect_columns(const Formula& formula, const CPose3D& pose, const Eigen::MatrixXd& jacobian)
{
    for (int c = 0; c < 12; c++)
    {
        Entries step = Entries::Zero();
        step(c) = 1e-4;  // the formulas are linear: no truncation error
        const Eigen::VectorXd numeric =
            (formula(Entry12Pose(entries(pose) + step)) - formula(Entry12Pose(entries(pose) - step))) / 2e-4;
        EXPECT_LT((jacobian.col(c) - numeric).norm(), 1e-6 * (1 + numeric.norm())) << "entry " << c;
    }
}

template <int N>
Eigen::MatrixXd as_matrix(const ErrorTermJacobian<N>& J)
{
    Eigen::MatrixXd out(N, 12);
    for (int r = 0; r < N; r++)
        for (int c = 0; c < 12; c++) out(r, c) = J(r, c);
    return out;
}

/// Value against the formula, Jacobian against differences of both.
template <int N, class Pairing, class Function, class Formula>
void check(Function function, const Pairing& pairing, const Formula& formula)
{
    for (const CPose3D& pose : test_poses())
    {
        ErrorTermJacobian<N> J;
        J.fill(777);  // every entry must be written
        const Eigen::VectorXd value = as_eigen(function(pairing, pose, J));
        EXPECT_LT((value - formula(Entry12Pose(entries(pose)))).norm(), 1e-12 * 100);  // of some 100 m
        EXPECT_EQ(value, as_eigen(function(pairing, pose, std::nullopt)));
        expect_columns(formula, pose, as_matrix<N>(J));
        expect_tangent([&](const CPose3D& p) { return as_eigen(function(pairing, p, std::nullopt)); }, pose,
                       as_matrix<N>(J));
    }
}

const Vector3d B(4, -2, 7), Q(-3, 5, 11), U(1, -2, 2), V(3, 1, -2);  // U has length 3
}  // namespace

TEST(ErrorTerms, PointToPoint)
{
    const mrpt::tfest::TMatchingPair_d pairing(0, 0, to_mrpt(Q), to_mrpt(B));
    check<3>(error_point2point, pairing,
             [](const Entry12Pose& p) -> Eigen::VectorXd { return p.R * B + p.t - Q; });
}

TEST(ErrorTerms, PointToLineIsTheRejectionFromALineOfAnyDirectorLength)
{
    const point_line_pair_t pairing{line(Q, U), to_mrpt(B)};
    check<3>(error_point2line, pairing,
             [](const Entry12Pose& p) -> Eigen::VectorXd
             {
                 const Vector3d d = p.R * B + p.t - Q;
                 return d - U * (U.dot(d) / 9);
             });
}

TEST(ErrorTerms, PointToPlaneIsTheSignedDistanceAlongTheUnitNormal)
{
    const point_plane_pair_t pairing{patch(Q, U), to_mrpt(B)};
    check<3>(error_point2plane, pairing,
             [](const Entry12Pose& p) -> Eigen::VectorXd { return U / 3 * (U / 3).dot(p.R * B + p.t - Q); });
    // Two metres above a floor: upwards.
    const auto above = error_point2plane({patch({7, 8, 1}, {0, 0, 5}), {0, 0, 3}}, CPose3D());
    EXPECT_NEAR(above[2], 2, 1e-15);
}

TEST(ErrorTerms, PlaneToPlaneIsTheDifferenceOfUnitNormals)
{
    const matched_plane_t pairing{patch(Q, U), patch(B, 2 * V)};
    check<3>(error_plane2plane, pairing,
             [](const Entry12Pose& p) -> Eigen::VectorXd { return p.R * V.normalized() - U / 3; });
}

TEST(ErrorTerms, LineToLinesJacobian)
{
    const matched_line_t pairing{line(Q, U), line(B, V)};
    for (const CPose3D& pose : test_poses())
    {
        ErrorTermJacobian<4> J;
        J.fill(777);
        const Eigen::VectorXd value = as_eigen(error_line2line(pairing, pose, J));
        expect_tangent([&](const CPose3D& p) { return as_eigen(error_line2line(pairing, p)); }, pose,
                       as_matrix<4>(J));
        // Linear in the 12 entries: J times them, and what is left does not depend on the pose.
        const Eigen::VectorXd left = value - as_matrix<4>(J) * entries(pose);
        ErrorTermJacobian<4> J0;
        const Eigen::VectorXd value0 = as_eigen(error_line2line(pairing, CPose3D(), J0));
        const Eigen::VectorXd left0 = value0 - as_matrix<4>(J0) * entries(CPose3D());
        EXPECT_LT((left - left0).norm(), 1e-12 * 100);
        EXPECT_LT(left.head<2>().norm(), 1e-12 * 100);
        EXPECT_LT(as_matrix<4>(J).topRightCorner(2, 3).norm(), 1e-15);  // directions do not feel t
    }
}

TEST(ErrorTerms, LineToLinesAreTheSineAndTheDistance)
{
    SeededRandom random(2);
    for (const CPose3D& pose : test_poses())
    {
        const matched_line_t pairing{line(Q, U), line(B, 0.1 * random_direction(random))};
        const auto e = as_eigen(error_line2line(pairing, pose));
        const Vector3d u = rotation_of(pose) * to_eigen(pairing.ln_local.director).normalized();
        EXPECT_NEAR(e.head<2>().norm(), u.cross(U / 3).norm(), 1e-12);
        const Vector3d d = rotation_of(pose) * B + translation_of(pose) - Q;
        EXPECT_NEAR(e.tail<2>().norm(), d.cross(U / 3).norm(), 1e-12 * 100);
        // Both parts are in the same basis: moving the line along its own deviation shows in the same place.
        const double sign = u.dot(U) < 0 ? -1 : 1;
        const auto moved =
            as_eigen(error_line2line(pairing, make_pose(rotation_of(pose), translation_of(pose) + sign * u)));
        EXPECT_LT((moved.tail<2>() - e.tail<2>() - e.head<2>()).norm(), 1e-12 * 100);
    }
}

TEST(ErrorTerms, LineDirectionsHaveNoSign)
{
    const CPose3D pose(1, 2, 3, 0.5, 0.6, 0.7);
    const auto e = as_eigen(error_line2line({line(Q, U), line(B, V)}, pose)),
               reversed = as_eigen(error_line2line({line(Q, U), line(B, -V)}, pose));
    EXPECT_EQ(e, reversed);
    EXPECT_GT(e.head<2>().norm(), 0.1);
    const auto same = as_eigen(error_line2line({line(Q, U), line(Q - 5 * U, -U)}, CPose3D()));
    EXPECT_LT(same.norm(), 1e-14);
}

TEST(ErrorTerms, WithoutADirectionThereIsNoNumber)
{
    const Vector3d zero = Vector3d::Zero();
    EXPECT_TRUE(std::isnan(error_point2line({line(Q, zero), to_mrpt(B)}, CPose3D())[0]));
    EXPECT_TRUE(std::isnan(error_point2plane({patch(Q, zero), to_mrpt(B)}, CPose3D())[0]));
    EXPECT_TRUE(std::isnan(error_line2line({line(Q, U), line(B, zero)}, CPose3D())[0]));
    EXPECT_TRUE(std::isnan(error_plane2plane({patch(Q, U), patch(B, zero)}, CPose3D())[0]));
}
