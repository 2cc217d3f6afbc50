#include <gtest/gtest.h>
#include <mp2p_icp/PoseQuadratic.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/observability.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cstring>

#include "degenerate_sets.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

/// The direct sum, kind by kind: what the quadratic must be.
double direct_cost(const Pairings& in, const PairWeights& w, const CPose3D& pose, double L)
{
    const Matrix3d R = rotation_of(pose);
    const auto direction = [&](const Vector3d& g, const Vector3d& l, DirectionSign sign)
    {
        const Vector3d a = g.normalized(), b = R * l.normalized();
        return sign == DirectionSign::Free ? 1 - std::pow(a.dot(b), 2) : (a - b).squaredNorm();
    };
    const auto normal = [](const plane_patch_t& p)
    { return Vector3d(p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]); };
    const auto off = [&](const mrpt::math::TPoint3D& local, const mrpt::math::TPoint3D& global) -> Vector3d
    { return transformed(pose, to_eigen(local)) - to_eigen(global); };
    double sum = 0;
    for (const auto& p : in.paired_pt2pt)
        sum += w.pt2pt * off(mrpt::math::TPoint3D(p.local), mrpt::math::TPoint3D(p.global)).squaredNorm();
    for (const auto& p : in.paired_pt2ln)
    {
        const Vector3d u = to_eigen(p.ln_global.director).normalized();
        sum += w.pt2ln * off(p.pt_local, p.ln_global.pBase).cross(u).squaredNorm();
    }
    for (const auto& p : in.paired_pt2pl)
        sum += w.pt2pl *
               std::pow(off(p.pt_local, p.pl_global.centroid).dot(normal(p.pl_global).normalized()), 2);
    for (const auto& p : in.paired_ln2ln)
    {
        const Vector3d u = to_eigen(p.ln_global.director).normalized();
        sum += w.ln2ln * off(p.ln_local.pBase, p.ln_global.pBase).cross(u).squaredNorm();
        sum += w.ln2ln_direction.value_or(w.ln2ln * L * L) *
               direction(u, to_eigen(p.ln_local.director), w.ln2ln_sign);
    }
    for (const auto& p : in.paired_pl2pl)
    {
        const Vector3d n = normal(p.p_global).normalized();
        sum += w.pl2pl * std::pow(off(p.p_local.centroid, p.p_global.centroid).dot(n), 2);
        sum += w.pl2pl_direction.value_or(w.pl2pl * L * L) * direction(n, normal(p.p_local), w.pl2pl_sign);
    }
    return sum;
}

PairWeights some_weights(int k)
{
    PairWeights w;
    w.pt2pt = 0.5, w.pt2ln = 2, w.pt2pl = 3, w.ln2ln = 0.7, w.pl2pl = 1.5;
    if (k % 2) w.ln2ln_direction = 5, w.pl2pl_direction = 0.3;
    w.ln2ln_sign = k % 3 ? DirectionSign::Free : DirectionSign::Oriented;
    w.pl2pl_sign = k % 4 < 2 ? DirectionSign::Free : DirectionSign::Oriented;
    return w;
}

/// Of the same cost everywhere, but for rounding relative to costs of this size.
void expect_same_cost(const PoseQuadratic& a, const PoseQuadratic& b, double far, SeededRandom& random)
{
    for (int k = 0; k < 10; k++)
    {
        const CPose3D pose = any_pose(random, far);
        const double expected = a.cost(pose);
        EXPECT_NEAR(b.cost(pose), expected, 1e-12 * expected);
    }
}

PoseQuadratic reloaded(const PoseQuadratic& q)
{
    mrpt::io::CMemoryStream memory;
    auto archive = mrpt::serialization::archiveFrom(memory);
    archive << q;
    memory.Seek(0);
    PoseQuadratic out;
    auto in = mrpt::serialization::archiveFrom(memory);
    in >> out;
    return out;
}
}  // namespace

TEST(PoseQuadratic, IsTheSumOfSquaresOfAllKindsAtAnyPose)
{
    SeededRandom random(1);
    for (int k = 0; k < 12; k++)
        for (const Mix& mix :
             {Mix{5, 4, 3, 2, 1}, Mix{70, 70, 70, 70, 70}, Mix{0, 0, 0, 3, 0}, Mix{0, 0, 0, 0, 3}})
        {
            const Pairings p =
                random_pairings(mix, any_rotation(random), random_point(random, 50), random, 0.5);
            const PairWeights w = some_weights(k);
            const PoseQuadratic q = pose_quadratic(p, w);
            for (int i = 0; i < 5; i++)
            {
                const CPose3D pose = any_pose(random, 50);
                const double expected = direct_cost(p, w, pose, q.L());
                EXPECT_NEAR(q.cost(pose), expected, 1e-12 * expected);
            }
        }
}

TEST(PoseQuadratic, OfTwoSetsAddUp)
{
    SeededRandom random(2);
    const PairWeights w = some_weights(1);  // directions with weights of their own
    for (const double apart : {0.0, 1.0, 1000.0})
    {
        const Matrix3d R = any_rotation(random);
        Pairings a = random_pairings({3, 2, 5, 2, 2}, R, {1, 2, 3}, random, 0.3),
                 b = random_pairings({1, 4, 0, 1, 3}, R, {1 + apart, 2, 3}, random, 0.3), both = a;
        both.push_back(b);
        PoseQuadratic sum = pose_quadratic(a, w), other = pose_quadratic(b, w);
        const PoseQuadratic first = sum, second = other, joint = pose_quadratic(both, w);
        sum += second, other += first;
        expect_same_cost(joint, sum, 10 + apart, random);
        expect_same_cost(joint, other, 10 + apart, random);
        EXPECT_EQ(sum.rows, joint.rows);
        EXPECT_NEAR(sum.position_weight, joint.position_weight, 1e-12 * joint.position_weight);
        EXPECT_LT((sum.b_centre - joint.b_centre).norm(), 1e-12 * (10 + apart));
    }
    PoseQuadratic empty;
    const PoseQuadratic q =
        pose_quadratic(random_pairings({3, 1, 1, 1, 1}, any_rotation(random), {1, 2, 3}, random), w);
    empty += q;
    expect_same_cost(q, empty, 10, random);
    PoseQuadratic same = q;
    same += PoseQuadratic();
    expect_same_cost(q, same, 10, random);
    EXPECT_TRUE(PoseQuadratic().empty());
    EXPECT_FALSE(q.empty());
}

TEST(PoseQuadratic, APointBesideALineHasNoRadiusWhateverItsWeight)
{
    SeededRandom random(3);
    for (int k = 0; k < 100; k++)
    {
        Pairings p = random_pairings({1, 0, 0, 1, 0}, any_rotation(random), random_point(random, 20), random);
        p.point_weights = {{1, random.uniform(0.1, 3)}};
        const PoseQuadratic q = pose_quadratic(p);
        EXPECT_EQ(q.radius, 0);
        EXPECT_EQ(q.L(), 1);
    }
}

TEST(PoseQuadratic, SkipsAndCountsWhatIsNotFinite)
{
    SeededRandom random(4);
    const Pairings good = random_pairings({3, 2, 2, 2, 2}, any_rotation(random), {1, 2, 3}, random, 0.1);
    Pairings bad = good;
    add_pair(bad, {1, NaN, 3}, {1, 2, 3});
    bad.paired_pt2pl.push_back({patch({1, 2, 3}, {0, 0, 0}), {1, 2, 3}});
    const PoseQuadratic a = pose_quadratic(good), b = pose_quadratic(bad);
    EXPECT_EQ(b.skipped, 2u);
    EXPECT_EQ(a.K, b.K);
    EXPECT_EQ(a.k, b.k);
    EXPECT_EQ(a.rows, 3 * 3u + 2 * 2u + 2u + 4 * 2u + 3 * 2u);
    EXPECT_EQ(b.rows, a.rows);
    EXPECT_THROW(
        {
            PairWeights w;
            w.pt2pt = -1;
            pose_quadratic(good, w);
        },
        std::invalid_argument);
}

TEST(PoseQuadratic, IsTheSameBitsOnAnyNumberOfThreads)
{
    SeededRandom random(5);
    const Pairings p =
        random_pairings({3000, 1500, 1500, 1500, 1500}, any_rotation(random), {1, 2, 3}, random, 0.1);
    PoseQuadratic one, many;
    with_threads(1, [&] { one = pose_quadratic(p); });
    for (const int threads : {2, 8})
    {
        with_threads(threads, [&] { many = pose_quadratic(p); });
        EXPECT_EQ(one.K, many.K);
        EXPECT_EQ(one.k, many.k);
        EXPECT_EQ(one.qq, many.qq);
    }
}

TEST(PoseQuadratic, IsSavedAndReloadedToTheBit)
{
    SeededRandom random(6);
    PairWeights w = some_weights(2);
    const PoseQuadratic q =
        pose_quadratic(random_pairings({3, 2, 2, 2, 2}, any_rotation(random), {1e7, 2, 3}, random, 0.1), w);
    const PoseQuadratic again = reloaded(q);
    EXPECT_EQ(q.K, again.K);
    EXPECT_EQ(q.k, again.k);
    EXPECT_EQ(q.qq, again.qq);
    EXPECT_EQ(q.a_centre, again.a_centre);
    EXPECT_EQ(q.b_centre, again.b_centre);
    EXPECT_EQ(q.position_weight, again.position_weight);
    EXPECT_EQ(q.radius, again.radius);
    EXPECT_EQ(q.rows, again.rows);
    EXPECT_EQ(q.skipped, again.skipped);
}

TEST(PoseQuadratic, DamagedDataAreRefusedAndChangeNothing)
{
    SeededRandom random(7);
    const PoseQuadratic q =
        pose_quadratic(random_pairings({3, 0, 0, 0, 0}, any_rotation(random), {1, 2, 3}, random));
    mrpt::io::CMemoryStream memory;
    auto archive = mrpt::serialization::archiveFrom(memory);
    archive << q;
    const size_t size = static_cast<size_t>(memory.getTotalBytesCount());
    const std::vector<uint8_t> bytes(static_cast<const uint8_t*>(memory.getRawBufferData()),
                                     static_cast<const uint8_t*>(memory.getRawBufferData()) + size);
    const auto expect_refused = [](const std::vector<uint8_t>& data)
    {
        mrpt::io::CMemoryStream stream;
        stream.Write(data.data(), data.size());
        stream.Seek(0);
        PoseQuadratic read;
        read.qq = 42;
        auto in = mrpt::serialization::archiveFrom(stream);
        EXPECT_THROW(in >> read, DataError);
        EXPECT_EQ(read.qq, 42);
    };
    for (const size_t cut : {size_t(9), size / 2, size - 1})
        expect_refused(std::vector<uint8_t>(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(cut)));
    auto other_version = bytes;
    other_version[0] = 200;
    expect_refused(other_version);
    auto not_finite = bytes;
    std::memcpy(not_finite.data() + 1, &NaN, sizeof(NaN));
    expect_refused(not_finite);
}

// ---- Priors -----------------------------------------------------------------------------------------------

namespace
{
mrpt::poses::CPose3DPDFGaussianInf prior_of(const CPose3D& mean, const Matrix6& information)
{
    mrpt::poses::CPose3DPDFGaussianInf out;
    out.mean = mean;
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) out.cov_inv(i, j) = information(i, j);
    return out;
}
/// With correlations of all coordinates.
Matrix6 random_information(SeededRandom& random, int rank = 6)
{
    Matrix6 out = Matrix6::Zero();
    for (int k = 0; k < rank; k++)
    {
        Vector6 v;
        for (int i = 0; i < 6; i++) v(i) = random.gaussian();
        out += v * v.transpose();
    }
    return out;
}
}  // namespace

TEST(PoseQuadraticOfAPrior, IsThePriorsCostToSecondOrder)
{
    SeededRandom random(11);
    for (int k = 0; k < 200; k++)
    {
        const CPose3D mean = any_pose(random, 5);
        if (std::abs(std::cos(mean.pitch())) < 0.1)
            continue;  // the prior's own coordinates are singular there
        const Matrix6 information = random_information(random, 1 + k % 6);
        const PoseQuadratic q = pose_quadratic(prior_of(mean, information));
        EXPECT_EQ(q.rows, static_cast<size_t>(1 + k % 6));
        EXPECT_LT(q.cost(mean), 1e-12 * information.trace());
        const double h = 1e-4;
        Vector6 e;
        for (int i = 0; i < 6; i++) e(i) = h * random.gaussian();
        const CPose3D near(mean.x() + e(0), mean.y() + e(1), mean.z() + e(2), mean.yaw() + e(3),
                           mean.pitch() + e(4), mean.roll() + e(5));
        // Third-order terms, by how much coordinates bend: 1 / cos(pitch).
        const double allowed =
            20 * h * information.trace() * e.squaredNorm() / std::abs(std::cos(mean.pitch()));
        EXPECT_NEAR(q.cost(near), e.dot(information * e), allowed);
    }
}

TEST(PoseQuadraticOfAPrior, IsLowestAtTheMeanOfAllPoses)
{
    SeededRandom random(12);
    for (int k = 0; k < 50; k++)
    {
        const CPose3D mean = any_pose(random, 5);
        const Matrix6 information = random_information(random);
        const PoseQuadratic q = pose_quadratic(prior_of(mean, information));
        const double least = Eigen::SelfAdjointEigenSolver<Matrix6>(information).eigenvalues()(0);
        for (int i = 0; i < 20; i++)
        {
            const CPose3D pose = any_pose(random, 5);
            if (rotation_between(mean, pose).norm() < 0.1) continue;
            EXPECT_GT(q.cost(pose), 1e-6 * least) << "not zero half a turn away, either";
        }
    }
    // Yaw alone: 4 sin^2(angle / 2).
    Matrix6 yaw = Matrix6::Zero();
    yaw(3, 3) = 2;
    const PoseQuadratic q = pose_quadratic(prior_of(CPose3D(1, 2, 3, 0.5, 0, 0), yaw));
    for (const double angle : {0.1, 1.0, 3.1})
        EXPECT_NEAR(q.cost(CPose3D(7, 7, 7, 0.5 + angle, 0, 0)), 8 * std::pow(std::sin(angle / 2), 2), 1e-12);
    EXPECT_NEAR(q.cost(CPose3D(7, 7, 7, 0.5, 0, 0.7)), 0, 1e-12);
}

TEST(PoseQuadraticOfAPrior, MustBeFiniteAndPositive)
{
    Matrix6 bad = Matrix6::Identity();
    bad(2, 2) = -1;
    EXPECT_THROW(pose_quadratic(prior_of(CPose3D(), bad)), std::invalid_argument);
    bad(2, 2) = NaN;
    EXPECT_THROW(pose_quadratic(prior_of(CPose3D(), bad)), std::invalid_argument);
    EXPECT_THROW(pose_quadratic(prior_of(CPose3D(NaN, 0, 0, 0, 0, 0), Matrix6::Identity())),
                 std::invalid_argument);
    EXPECT_TRUE(pose_quadratic(prior_of(CPose3D(), Matrix6::Zero())).empty());
}

namespace
{
/// Not cut off at zero as cost() is.
double raw_cost(const PoseQuadratic& q, const CPose3D& pose)
{
    const OriginPose at = q.relative(pose);
    Vector12 x;
    x << at.R.col(0), at.R.col(1), at.R.col(2), at.c;
    return x.dot(q.K * x) - 2 * q.k.dot(x) + q.qq;
}
/// Differences of x y z yaw pitch roll.
Vector6 difference(const CPose3D& from, const CPose3D& to)
{
    const auto wrapped = [](double angle) { return std::remainder(angle, 2 * M_PI); };
    Vector6 d;
    d << translation_of(to) - translation_of(from), wrapped(to.yaw() - from.yaw()),
        wrapped(to.pitch() - from.pitch()), wrapped(to.roll() - from.roll());
    return d;
}
}  // namespace

TEST(PoseQuadraticOfAPrior, IsItsCostToSecondOrderInTheTwistAtHalfTurnsAndSteepPitchToo)
{
    SeededRandom random(14);
    for (const double pitch : {0.0, 0.7, 1.4, -1.5})
        for (const double roll : {0.3, M_PI})
            for (int k = 0; k < 20; k++)
            {
                SCOPED_TRACE("pitch " + std::to_string(pitch) + ", roll " + std::to_string(roll));
                const CPose3D mean(1, -2, 3, k % 2 ? M_PI : 0.4, pitch, roll);
                const Matrix6 information = random_information(random, 1 + k % 6);
                const PoseQuadratic q = pose_quadratic(prior_of(mean, information));
                Vector6 twist;
                const double h = 1e-4 * std::cos(pitch);
                for (int i = 0; i < 6; i++) twist(i) = h * random.gaussian();
                const auto at = [&](double sign)
                {
                    const Vector3d omega = sign * twist.tail<3>();
                    return make_pose(rotation_about(omega, omega.norm()) * rotation_of(mean),
                                     translation_of(mean) + sign * twist.head<3>());
                };
                // Third-order terms are odd and cancel; what the angles bend by is of the order h /
                // cos(pitch)^2.
                const Vector6 e = 0.5 * (difference(mean, at(1)) - difference(mean, at(-1)));
                const double expected = e.dot(information * e);
                EXPECT_NEAR(
                    0.5 * (raw_cost(q, at(1)) + raw_cost(q, at(-1))), expected,
                    1e-4 * information.trace() * e.squaredNorm() + 1e-15 * (q.K.norm() + q.k.norm() + q.qq));
                EXPECT_GT(expected, 0);
            }
}

TEST(PoseQuadraticOfAPrior, IsNowhereBelowZeroWhateverItsRank)
{
    SeededRandom random(15);
    for (int k = 0; k < 120; k++)
    {
        const Matrix6 information = random_information(random, 1 + k % 6);
        const PoseQuadratic q = pose_quadratic(prior_of(any_pose(random, 5), information));
        const double size = q.K.norm() + q.k.norm() + q.qq;
        for (int i = 0; i < 50; i++) EXPECT_GT(raw_cost(q, any_pose(random, 5)), -1e-12 * size);
    }
}

TEST(PoseQuadraticOfAPrior, IsRefusedWithAnyNegativeInformation)
{
    // Units differ: an angle known to 1e-6 rad makes another one's information no less negative.
    Matrix6 information = 1e-3 * Matrix6::Identity();
    information(3, 3) = 1e12, information(4, 4) = -100;
    EXPECT_THROW(pose_quadratic(prior_of(CPose3D(), information)), std::invalid_argument);
}

TEST(PoseQuadraticOfAPrior, KeepsCorrelationsOfWhatIsHardlyKnown)
{
    // A height known to 1 km, and with it the yaw: a correlation of 0.9.
    Matrix6 information = Matrix6::Identity();
    information(0, 0) = information(1, 1) = 1e6;
    information(2, 2) = 1e-6, information(2, 3) = information(3, 2) = 0.9e-3;
    const PoseQuadratic q = pose_quadratic(prior_of(CPose3D(), information));
    Vector6 e = Vector6::Zero();
    e(2) = 1, e(3) = -1e-3;
    const double expected = e.dot(information * e);
    EXPECT_NEAR(q.cost(CPose3D(0, 0, e(2), e(3), 0, 0)), expected, 1e-3 * expected);
}

TEST(PoseQuadratic, OfThreeSetsAddUpInAnyOrder)
{
    SeededRandom random(8);
    const PairWeights w = some_weights(1);
    const Matrix3d R = any_rotation(random);
    std::vector<Pairings> sets;
    Pairings all;
    for (const Mix& mix : {Mix{3, 0, 0, 0, 0}, Mix{0, 2, 3, 0, 0}, Mix{0, 0, 0, 2, 2}})
        sets.push_back(random_pairings(mix, R, random_point(random, 30), random, 0.3)),
            all.push_back(sets.back());
    const PoseQuadratic joint = pose_quadratic(all, w);
    std::vector<size_t> order = {0, 1, 2};
    do
    {
        PoseQuadratic sum;
        for (const size_t i : order) sum += pose_quadratic(sets[i], w);
        expect_same_cost(joint, sum, 40, random);
        EXPECT_EQ(sum.rows, joint.rows);
    } while (std::next_permutation(order.begin(), order.end()));
}

TEST(PoseQuadratic, OfASumHasTheRadiusOfAllItsPoints)
{
    SeededRandom random(9);
    const Matrix3d R = any_rotation(random);
    const Pairings points = random_pairings({5, 3, 0, 0, 0}, R, {1, 2, 3}, random, 0.3),
                   others = random_pairings({0, 0, 4, 3, 3}, R, {1, 2, 3}, random, 0.3);
    Pairings both = points;
    both.push_back(others);
    PairWeights w;
    w.ln2ln_direction = w.pl2pl_direction = 1;
    PoseQuadratic sum = pose_quadratic(points, w);
    sum += pose_quadratic(others, w);
    EXPECT_NEAR(sum.radius, pose_quadratic(both, w).radius, 1e-12 * sum.radius);
}

// ---- Observability from sums ------------------------------------------------------------------------------

TEST(ObservabilityOfSums, IsThatOfThePairings)
{
    SeededRandom random(21);
    for (int k = 0; k < 30; k++)
    {
        const Matrix3d R = any_rotation(random);
        const Vector3d t(1, 2, 3);
        const Mix mix = k % 3 == 0   ? Mix{10, 0, 0, 0, 0}
                        : k % 3 == 1 ? Mix{2, 0, 0, 0, 0}
                                     : Mix{0, 0, 2, 0, 1};
        const Pairings p = random_pairings(mix, R, t, random, 1e-3);
        ObservabilityParameters parameters;
        parameters.sigma = 1e-3, parameters.coordinate_rounding = 1e-12;
        const Observability a = observability(p, make_pose(R, t), parameters),
                            b = observability(pose_quadratic(p), make_pose(R, t), parameters);
        EXPECT_EQ(a.rank, b.rank);
        ASSERT_EQ(b.motions.size(), 6u);
        for (size_t i = 1; i < 6; i++)
            EXPECT_LE(b.motions[i - 1].information_ratio, b.motions[i].information_ratio * (1 + 1e-9));
        EXPECT_NEAR(b.motions[5].information_ratio, 1, 1e-12);
        if (a.rank < 6) continue;
        for (int i = 0; i < 6; i++)
            EXPECT_NEAR(a.covariance_twist(i, i), b.covariance_twist(i, i), 1e-9 * a.covariance_twist(i, i));
        EXPECT_GT(b.motions[0].sigma, 0);
    }
}
