#include <mp2p_icp/observability.h>
#include <mp2p_icp/optimal_tf_horn.h>

#include <algorithm>
#include <limits>

#include "solver_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

namespace
{
const double INF = std::numeric_limits<double>::infinity();
const double NaN = std::numeric_limits<double>::quiet_NaN();

Matrix6 as_eigen(const mrpt::math::CMatrixDouble66& m)
{
    Matrix6 out;
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) out(r, c) = m(r, c);
    return out;
}
Vector3d as_eigen(const mrpt::math::TVector3D& v)
{
    return {v.x, v.y, v.z};
}

Vector6 coordinates(const CPose3D& p)
{
    return (Vector6() << p.x(), p.y(), p.z(), p.yaw(), p.pitch(), p.roll()).finished();
}
CPose3D pose_of(const Vector6& c)
{
    return {c(0), c(1), c(2), c(3), c(4), c(5)};
}
CPose3D tame_pose(SeededRandom& random)
{
    return synthetic::random_pose({20, 20, 20, 3, 1.3, 3}, random);
}

// ---- Pairings that fit exactly at a pose ------------------------------------------------------------------

plane_patch_t patch(const Vector3d& centroid, const Vector3d& normal)
{
    plane_patch_t p;
    p.centroid = to_mrpt(centroid);
    p.plane.coefs = {normal.x(), normal.y(), normal.z(), -normal.dot(centroid)};
    return p;
}
mrpt::math::TLine3D line(const Vector3d& base, const Vector3d& u)
{
    mrpt::math::TLine3D l;
    l.pBase = to_mrpt(base), l.director = to_mrpt(u);
    return l;
}

/// Collects pairings of things given in the global frame; their local counterparts are where `pose` puts
/// them.
struct Scene
{
    CPose3D pose, inverse;
    Pairings p;
    explicit Scene(const CPose3D& at) : pose(at), inverse(-at) {}
    mrpt::math::TPoint3D local(const Vector3d& g) const { return inverse.composePoint(to_mrpt(g)); }

    void point(const Vector3d& g) { add_pair(p, g, to_eigen(local(g))); }
    void on_plane(const Vector3d& g, const Vector3d& n) { p.paired_pt2pl.push_back({patch(g, n), local(g)}); }
    void on_line(const Vector3d& g, const Vector3d& u, double along = 0)
    {
        p.paired_pt2ln.push_back({line(g + along * u, u), local(g)});
    }
    void plane(const Vector3d& c, const Vector3d& n)
    {
        p.paired_pl2pl.push_back({patch(c, n), compose(inverse, patch(c, n))});
    }
    void lines(const Vector3d& b, const Vector3d& u)
    {
        p.paired_ln2ln.push_back({line(b, u), compose(inverse, line(b, u))});
    }
    Observability seen(const std::optional<double>& sigma = 0.01) const
    {
        return observability(p, pose, known_sigma(sigma));
    }
};

// ---- The residuals of METHOD, written out, for numerical differentiation
// -----------------------------------

/// Of the paired points about their weighted centroid.
double rms_radius(const Pairings& p)
{
    std::vector<std::pair<double, Vector3d>> all;
    const auto w = p.expanded_point_weights();
    for (size_t i = 0; i < w.size(); i++) all.emplace_back(w[i], local_of(p, i));
    for (const auto& x : p.paired_pt2ln) all.emplace_back(1, to_eigen(x.pt_local));
    for (const auto& x : p.paired_pt2pl) all.emplace_back(1, to_eigen(x.pt_local));
    if (all.size() < 2) return 1;
    Vector3d mean = Vector3d::Zero();
    double weight = 0, sum = 0;
    for (const auto& [wi, x] : all) mean += wi * x, weight += wi;
    mean /= weight;
    for (const auto& [wi, x] : all) sum += wi * (x - mean).squaredNorm();
    return std::sqrt(sum / weight);
}

Eigen::VectorXd residuals(const Pairings& p, const CPose3D& pose)
{
    const Matrix3d R = rotation_of(pose);
    const Vector3d t = translation_of(pose);
    const double L = rms_radius(p);
    std::vector<double> r;
    const auto add = [&r](const Vector3d& v) { r.insert(r.end(), {v.x(), v.y(), v.z()}); };
    const auto normal = [](const plane_patch_t& x)
    { return Vector3d(x.plane.coefs[0], x.plane.coefs[1], x.plane.coefs[2]); };
    const auto across = [](const Vector3d& u) { return Matrix3d(Matrix3d::Identity() - u * u.transpose()); };
    const auto w = p.expanded_point_weights();
    for (size_t i = 0; i < w.size(); i++) add(std::sqrt(w[i]) * (R * local_of(p, i) + t - global_of(p, i)));
    for (const auto& x : p.paired_pt2ln)
        add(across(to_eigen(x.ln_global.director)) *
            (R * to_eigen(x.pt_local) + t - to_eigen(x.ln_global.pBase)));
    for (const auto& x : p.paired_pt2pl)
        r.push_back(normal(x.pl_global).dot(R * to_eigen(x.pt_local) + t - to_eigen(x.pl_global.centroid)));
    for (const auto& x : p.paired_ln2ln)
    {
        const Vector3d u = to_eigen(x.ln_global.director);
        add(across(u) * (R * to_eigen(x.ln_local.pBase) + t - to_eigen(x.ln_global.pBase)));
        add(L * across(u) * R * to_eigen(x.ln_local.director));
    }
    for (const auto& x : p.paired_pl2pl)
    {
        const Vector3d n = normal(x.p_global);
        r.push_back(n.dot(R * to_eigen(x.p_local.centroid) + t - to_eigen(x.p_global.centroid)));
        add(L * across(n) * R * normal(x.p_local));
    }
    return Eigen::Map<Eigen::VectorXd>(r.data(), static_cast<Eigen::Index>(r.size()));
}

Matrix6 numeric_information(const Pairings& p, const CPose3D& pose, double sigma)
{
    const Vector6 c = coordinates(pose);
    const double h = 1e-5;
    Eigen::MatrixXd J(residuals(p, pose).size(), 6);
    for (int i = 0; i < 6; i++)
    {
        Vector6 step = Vector6::Zero();
        step(i) = h;
        J.col(i) = (residuals(p, pose_of(c + step)) - residuals(p, pose_of(c - step))) / (2 * h);
    }
    return J.transpose() * J / (sigma * sigma);
}

/// `kinds` is a set of bits: points, lines, planes, line pairs, plane pairs; noisy, so that no residual is
/// zero.
Pairings random_pairings(int kinds, const CPose3D& pose, SeededRandom& random, size_t n = 8)
{
    Scene s(pose);
    for (size_t i = 0; i < n; i++)
    {
        const Vector3d g = translation_of(pose) + random_point(random, 10), u = random_direction(random);
        if (kinds & 1) s.point(g);
        if (kinds & 2) s.on_line(g, u, random.uniform(-5, 5));
        if (kinds & 4) s.on_plane(g, u);
        if (kinds & 8) s.lines(g, u);
        if (kinds & 16) s.plane(g, u);
    }
    for (auto& x : s.p.paired_pt2pt) x.local.x += 0.01;
    for (auto& x : s.p.paired_pt2ln) x.pt_local.y += 0.02;
    for (auto& x : s.p.paired_pt2pl) x.pt_local.z += 0.03;
    if (kinds & 1) s.p.point_weights = {{n / 2, 0.25}, {1, 3.0}};
    return s.p;
}

/// Moving along `free` must leave all residuals unchanged, to second order in the step.
void expect_free(const Pairings& p, const CPose3D& pose, const FreeTwist& free)
{
    const double step = 1e-4;
    const Vector3d axis = as_eigen(free.axis), through = to_eigen(free.through);
    EXPECT_NEAR(axis.norm(), 1, 1e-9);
    CPose3D moved;
    if (free.kind == FreeTwist::Kind::Translation)
    {
        moved = make_pose(rotation_of(pose), translation_of(pose) + step * axis);
    }
    else
    {
        ASSERT_EQ(free.kind, FreeTwist::Kind::Rotation);
        const Matrix3d dR = rotation_about(axis, step);
        moved = make_pose(dR * rotation_of(pose), dR * (translation_of(pose) - through) + through);
    }
    EXPECT_LT((residuals(p, moved) - residuals(p, pose)).cwiseAbs().maxCoeff(), 1e-6)
        << to_string(free.kind) << " " << axis.transpose();
}

/// The free motions are independent: together they span 6 - rank directions.
void expect_independent(const std::vector<FreeTwist>& free)
{
    if (free.empty()) return;
    Eigen::MatrixXd T(6, static_cast<Eigen::Index>(free.size()));
    for (size_t i = 0; i < free.size(); i++)
    {
        const Vector3d axis = as_eigen(free[i].axis);
        Vector6 twist;
        if (free[i].kind == FreeTwist::Kind::Translation)
            twist << axis, 0, 0, 0;
        else
            twist << to_eigen(free[i].through).cross(axis), axis;
        T.col(static_cast<Eigen::Index>(i)) = twist.normalized();
    }
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(T);
    qr.setThreshold(1e-6);
    EXPECT_EQ(qr.rank(), static_cast<Eigen::Index>(free.size()));
}

void expect_rank(const Scene& s, int rank)
{
    for (const std::optional<double>& sigma : {std::optional<double>(0.01), std::optional<double>(1e-4)})
    {
        const Observability o = s.seen(sigma);
        EXPECT_EQ(o.rank, rank);
        ASSERT_EQ(o.free.size(), static_cast<size_t>(6 - rank));
        for (const auto& free : o.free) expect_free(s.p, s.pose, free);
        expect_independent(o.free);
    }
}

double distance_to_line(const Vector3d& p, const Vector3d& base, const Vector3d& u)
{
    return (p - base).cross(u).norm();
}

void expect_parallel(const mrpt::math::TVector3D& a, const Vector3d& b)
{
    EXPECT_LT(as_eigen(a).cross(b.normalized()).norm(), 1e-6);
}

/// Infinite variances exactly at `infinite` coordinates, zeros beside them, finite elsewhere.
void expect_infinite(const Observability& o, const std::vector<int>& infinite)
{
    for (int i = 0; i < 6; i++)
    {
        const bool inf_i = std::count(infinite.begin(), infinite.end(), i) > 0;
        EXPECT_EQ(std::isinf(o.covariance(i, i)), inf_i) << i;
        EXPECT_GT(o.covariance(i, i), 0) << i;
        for (int k = 0; k < 6; k++)
        {
            if (k == i) continue;
            EXPECT_TRUE(std::isfinite(o.covariance(i, k)));
            if (inf_i)
            {
                EXPECT_EQ(o.covariance(i, k), 0);
            }
        }
    }
}
}  // namespace

// ---- The numbers ------------------------------------------------------------------------------------------

TEST(Observability, TheInformationIsThatOfTheResidualsForEveryMixOfKinds)
{
    SeededRandom random(1);
    for (int kinds = 1; kinds < 32; kinds++)
        for (int k = 0; k < 3; k++)
        {
            const CPose3D pose = tame_pose(random);
            const Pairings p = random_pairings(kinds, pose, random);
            const Observability o = observability(p, pose, known_sigma(0.02));
            const Matrix6 expected = numeric_information(p, pose, 0.02);
            EXPECT_EQ(o.rank, 6);
            EXPECT_TRUE(o.free.empty());
            // Central differences with steps of 1e-5: 1e-8 or better.
            EXPECT_LT((as_eigen(o.information) - expected).norm(), 1e-7 * expected.norm())
                << "kinds " << kinds;
            EXPECT_EQ(o.sigma, 0.02);
        }
}

TEST(Observability, TheCovarianceIsTheInverseOfTheInformationAtFullRank)
{
    SeededRandom random(2);
    for (int kinds = 1; kinds < 32; kinds++)
    {
        const CPose3D pose = tame_pose(random);
        const Observability o =
            observability(random_pairings(kinds, pose, random, 20), pose, known_sigma(0.02));
        const Matrix6 inverse = as_eigen(o.information).inverse(), mine = as_eigen(o.covariance);
        EXPECT_LT((mine - inverse).norm(), 1e-9 * inverse.norm()) << kinds;
        EXPECT_EQ(mine, mine.transpose());
        EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(mine).eigenvalues().minCoeff(), 0);
    }
}

TEST(Observability, SigmaIsEstimatedFromTheResiduals)
{
    SeededRandom random(3);
    const CPose3D pose = tame_pose(random);
    Pairings p = random_pairings(1, pose, random, 2000);
    p.point_weights.clear();
    for (auto& x : p.paired_pt2pt)
        x.local.x += random.gaussian(0.05), x.local.y += random.gaussian(0.05),
            x.local.z += random.gaussian(0.05);
    const Observability o = observability(p, pose);
    const double squares = residuals(p, pose).squaredNorm();
    EXPECT_NEAR(o.sigma, std::sqrt(squares / (3 * 2000 - 6)), 1e-9);
    EXPECT_NEAR(o.residual_rms, std::sqrt(squares / 2000), 1e-9);
    EXPECT_DOUBLE_EQ(residual_rms(p, pose), o.residual_rms);
    const Matrix6 expected = numeric_information(p, pose, o.sigma);
    EXPECT_LT((as_eigen(o.information) - expected).norm(), 1e-7 * expected.norm());
}

TEST(Observability, SigmaIsAtLeastTheRoundingOfFloatAndInfiniteWithoutRedundancy)
{
    SeededRandom random(4);
    Scene many(CPose3D(1, 2, 3, 0, 0, 0));
    for (int i = 0; i < 20; i++) many.point(random_point(random, 100));
    const Observability exact = many.seen(std::nullopt);
    EXPECT_GT(exact.sigma, 1e-7);  // 100 m * 2^-23 / sqrt(12) = 3.4e-6 m
    EXPECT_LT(exact.sigma, 1e-5);
    EXPECT_LT(exact.residual_rms, 1e-12);

    Scene six{CPose3D()};  // three planes: as many rows as unknowns
    for (const Vector3d& g : {Vector3d(1, 0, 0), Vector3d(0, 2, 0), Vector3d(0, 0, 3), Vector3d(5, 1, 0),
                              Vector3d(2, -4, 1), Vector3d(3, 1, 7)})
        six.on_plane(g, random_direction(random));
    const Observability o = six.seen(std::nullopt);
    EXPECT_EQ(o.rank, 6);
    EXPECT_EQ(o.sigma, INF);
    EXPECT_EQ(as_eigen(o.information), Matrix6(Matrix6::Zero()));
    expect_infinite(o, {0, 1, 2, 3, 4, 5});
}

TEST(Observability, ThePredictionHoldsInRepeatedMeasurements)
{
    SeededRandom random(5);
    const CPose3D truth(3, -2, 1, 0.7, 0.4, -0.5);
    const double sigma = 0.02;
    const auto local = random_points(30, 5, 6);
    const int runs = 1000;
    double nees = 0;
    Matrix6 empirical = Matrix6::Zero(), predicted = Matrix6::Zero();
    for (int k = 0; k < runs; k++)
    {
        const Pairings p = moved_points(local, rotation_of(truth), translation_of(truth), sigma,
                                        1000 + static_cast<uint64_t>(k));
        OptimalTF_Result r;
        ASSERT_TRUE(optimal_tf_horn(p, {}, r));
        const Observability o = observability(p, r.optimalPose, known_sigma(sigma));
        const Vector6 e = coordinates(r.optimalPose) - coordinates(truth);
        nees += e.dot(as_eigen(o.information) * e);
        empirical += e * e.transpose() / runs, predicted += as_eigen(o.covariance) / runs;
    }
    // NEES is chi-square with 6 degrees of freedom: the mean of 1000 has a standard deviation of sqrt(12 /
    // 1000).
    EXPECT_NEAR(nees / runs, 6, 4 * std::sqrt(12.0 / runs));
    for (int i = 0; i < 6; i++)
        EXPECT_NEAR(empirical(i, i) / predicted(i, i), 1, 4 * std::sqrt(2.0 / runs)) << i;
}

TEST(Observability, TheEstimatedSigmaPredictsAsWell)
{
    const CPose3D truth(3, -2, 1, 0.7, 0.4, -0.5);
    const auto local = random_points(100, 5, 6);
    const int runs = 300;
    double nees = 0;
    for (int k = 0; k < runs; k++)
    {
        const Pairings p = moved_points(local, rotation_of(truth), translation_of(truth), 0.05,
                                        5000 + static_cast<uint64_t>(k));
        OptimalTF_Result r;
        ASSERT_TRUE(optimal_tf_horn(p, {}, r));
        const Vector6 e = coordinates(r.optimalPose) - coordinates(truth);
        nees += e.dot(as_eigen(observability(p, r.optimalPose).information) * e);
    }
    EXPECT_NEAR(nees / runs, 6, 4 * std::sqrt(12.0 / runs) + 0.1);  // 294 rows: the estimate adds about 1 %
}

TEST(Observability, AreTheSameBitsOnAnyNumberOfThreads)
{
    SeededRandom random(6);
    const CPose3D pose = tame_pose(random);
    const Pairings p = random_pairings(31, pose, random, 20000);
    Observability one;
    with_threads(1, [&]() { one = observability(p, pose); });
    for (const int threads : {2, 8})
        with_threads(threads,
                     [&]()
                     {
                         const Observability o = observability(p, pose);
                         EXPECT_EQ(as_eigen(o.information), as_eigen(one.information));
                         EXPECT_EQ(as_eigen(o.covariance), as_eigen(one.covariance));
                         EXPECT_EQ(as_eigen(covariance(p, pose)), as_eigen(one.covariance));
                     });
}

// ---- What pairings leave free -----------------------------------------------------------------------------

TEST(Observability, NothingPairedLeavesAllSixMotionsFree)
{
    const Observability o = observability(Pairings(), CPose3D(1, 2, 3, 0.4, 0.5, 0.6));
    EXPECT_EQ(o.rank, 0);
    ASSERT_EQ(o.free.size(), 6u);
    std::vector<std::string> names;
    for (const auto& f : o.free)
    {
        names.push_back(f.name);
        EXPECT_EQ(f.sigma, INF);
    }
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, (std::vector<std::string>{"pitch", "roll", "x", "y", "yaw", "z"}));
    EXPECT_EQ(o.residual_rms, 0);
    expect_infinite(o, {0, 1, 2, 3, 4, 5});
}

TEST(Observability, OnePointLeavesTheRotationsAboutIt)
{
    SeededRandom random(7);
    for (int k = 0; k < 20; k++)
    {
        Scene s(tame_pose(random));
        const Vector3d g = random_point(random, 30);
        s.point(g);
        expect_rank(s, 3);
        for (const auto& f : s.seen().free)
        {
            EXPECT_EQ(f.kind, FreeTwist::Kind::Rotation);
            EXPECT_LT(distance_to_line(g, to_eigen(f.through), as_eigen(f.axis)), 1e-6);
        }
    }
}

TEST(Observability, CoincidentPointsAreAsGoodAsOne)
{
    SeededRandom random(8);
    for (const size_t n : {size_t(2), size_t(3), size_t(7)})
    {
        Scene s(tame_pose(random));
        const Vector3d g = random_point(random, 30);
        for (size_t i = 0; i < n; i++) s.point(g);
        expect_rank(s, 3);
    }
}

TEST(Observability, PointsOnALineLeaveTheRotationAboutIt)
{
    SeededRandom random(9);
    for (const int n : {2, 10})
    {
        Scene along_x(CPose3D(1, 2, 3, 0.3, 0.2, 0.1));
        for (int i = 0; i < n; i++) along_x.point({i * 3.0 - 7, 5, -2});
        expect_rank(along_x, 5);
        const FreeTwist roll = along_x.seen().free.at(0);
        EXPECT_EQ(roll.kind, FreeTwist::Kind::Rotation);
        EXPECT_EQ(roll.name, "roll");
        expect_parallel(roll.axis, {1, 0, 0});
        EXPECT_NEAR(roll.through.y, 5, 1e-6);
        EXPECT_NEAR(roll.through.z, -2, 1e-6);

        Scene oblique(tame_pose(random));
        const Vector3d u = Vector3d(1, 2, 3).normalized(), base = random_point(random, 10);
        for (int i = 0; i < n; i++) oblique.point(base + random.uniform(-5, 5) * u);
        expect_rank(oblique, 5);
        EXPECT_EQ(oblique.seen().free.at(0).name, "");
        expect_parallel(oblique.seen().free.at(0).axis, u);
    }
}

TEST(Observability, OnePlaneLeavesTwoTranslationsAndTheRotationAboutItsNormal)
{
    SeededRandom random(10);
    for (int k = 0; k < 10; k++)
    {
        const Vector3d n = k == 0 ? Vector3d(0, 0, 1) : random_direction(random);
        const Matrix3d basis = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), n).toRotationMatrix();
        Scene pairs(tame_pose(random)), points(tame_pose(random));
        pairs.plane(random_point(random, 10), n);
        const Vector3d origin = random_point(random, 10);
        for (int i = 0; i < 10; i++)
            points.on_plane(origin + basis * Vector3d(random.uniform(-5, 5), random.uniform(-5, 5), 0), n);
        for (const Scene* s : {&pairs, &points})
        {
            expect_rank(*s, 3);
            int translations = 0;
            for (const auto& f : s->seen().free)
            {
                if (f.kind == FreeTwist::Kind::Translation)
                {
                    translations++;
                    EXPECT_NEAR(as_eigen(f.axis).dot(n), 0, 1e-6);
                }
                else
                {
                    expect_parallel(f.axis, n);
                    if (k == 0)
                    {
                        EXPECT_EQ(f.name, "yaw");
                    }
                }
            }
            EXPECT_EQ(translations, 2);
        }
    }
}

TEST(Observability, ParallelPlanesAreAsGoodAsOne)
{
    SeededRandom random(11);
    Scene s(tame_pose(random));
    for (const double z : {0.0, 3.0, -5.0}) s.plane({z * 2, 1, z}, {0, 0, z < 0 ? -1.0 : 1.0});
    expect_rank(s, 3);
}

TEST(Observability, APlaneAndALinePerpendicularToItLeaveTheSpin)
{
    SeededRandom random(12);
    Scene s(tame_pose(random));
    s.plane({10, -5, 0}, {0, 0, 1});
    s.lines({3, 4, 7}, {0, 0, 1});
    expect_rank(s, 5);
    const FreeTwist spin = s.seen().free.at(0);
    EXPECT_EQ(spin.kind, FreeTwist::Kind::Rotation);
    EXPECT_EQ(spin.name, "yaw");
    EXPECT_NEAR(spin.through.x, 3, 1e-6);
    EXPECT_NEAR(spin.through.y, 4, 1e-6);
}

TEST(Observability, APlaneAndALineParallelToItLeaveTheSlide)
{
    SeededRandom random(13);
    Scene s(tame_pose(random));
    s.plane({10, -5, 0}, {0, 0, 1});
    s.lines({3, 4, 7}, {0, 1, 0});
    expect_rank(s, 5);
    EXPECT_EQ(s.seen().free.at(0).name, "y");
    // An oblique line leaves nothing.
    Scene oblique(s.pose);
    oblique.plane({10, -5, 0}, {0, 0, 1});
    oblique.lines({3, 4, 7}, {0, 0.6, 0.8});
    expect_rank(oblique, 6);
}

TEST(Observability, TwoLinesThatAreNotParallelDetermineThePoseParallelOnesSlide)
{
    SeededRandom random(14);
    Scene skew(tame_pose(random)), crossing(tame_pose(random)), parallel(tame_pose(random));
    skew.lines({0, 0, 0}, {1, 0, 0}), skew.lines({1, 2, 3}, {0, 1, 0});
    crossing.lines({0, 0, 0}, {1, 0, 0}), crossing.lines({4, 0, 0}, Vector3d(1, 1, 0).normalized());
    parallel.lines({0, 0, 0}, {0, 0, 1}), parallel.lines({1, 2, 3}, {0, 0, 1});
    expect_rank(skew, 6);
    expect_rank(crossing, 6);
    expect_rank(parallel, 5);
    EXPECT_EQ(parallel.seen().free.at(0).name, "z");
    Scene one(tame_pose(random));
    one.lines({1, 2, 3}, {0, 0, 1});
    expect_rank(one, 4);
    Scene points_on_one(tame_pose(random));
    for (int i = 0; i < 5; i++) points_on_one.on_line({1, 2, 3.0 * i}, {0, 0, 1}, 2);
    expect_rank(points_on_one, 4);
}

TEST(Observability, ThreePlanesDetermineThePoseUnlessTheyFormAPrism)
{
    SeededRandom random(15);
    Scene corner(tame_pose(random)), prism(tame_pose(random)), oblique_prism(tame_pose(random));
    for (int i = 0; i < 3; i++) corner.plane(random_point(random, 5), Vector3d::Unit(i));
    expect_rank(corner, 6);
    const Matrix3d A = any_rotation(random);
    for (const double angle : {0.0, 2.0, 4.0})
    {
        const Vector3d n(0, std::cos(angle), std::sin(angle));
        prism.plane(5 * n + Vector3d(angle, 0, 0), n);
        oblique_prism.plane(A * (5 * n + Vector3d(angle, 0, 0)), A * n);
    }
    expect_rank(prism, 5);
    const FreeTwist slide = prism.seen().free.at(0);
    EXPECT_EQ(slide.kind, FreeTwist::Kind::Translation);
    EXPECT_EQ(slide.name, "x");
    EXPECT_EQ(to_eigen(slide.through), Vector3d(Vector3d::Zero()));
    expect_infinite(prism.seen(), {0});
    expect_rank(oblique_prism, 5);
    expect_parallel(oblique_prism.seen().free.at(0).axis, A.col(0));
    expect_infinite(oblique_prism.seen(), {0, 1, 2});
}

TEST(Observability, ASphereLeavesTheRotationsAboutItsCentre)
{
    SeededRandom random(16);
    for (const bool half : {false, true})
    {
        Scene s(tame_pose(random));
        const Vector3d centre(10, -20, 5);
        for (int i = 0; i < 200; i++)
        {
            Vector3d n = random_direction(random);
            if (half) n.z() = std::abs(n.z());
            s.on_plane(centre + 7 * n, n);
        }
        expect_rank(s, 3);
        for (const auto& f : s.seen().free)
        {
            EXPECT_EQ(f.kind, FreeTwist::Kind::Rotation);
            EXPECT_LT(distance_to_line(centre, to_eigen(f.through), as_eigen(f.axis)), 1e-5);
        }
    }
}

TEST(Observability, ACorridorLeavesX)
{
    SeededRandom random(17);
    Scene s(CPose3D(3, 0.2, 1, 0.1, 0, 0));
    for (int i = 0; i < 300; i++)
    {
        const double x = random.uniform(-20, 20), z = random.uniform(0, 2.5), y = random.uniform(-1, 1);
        if (i % 3 == 0) s.on_plane({x, 1, z}, {0, -1, 0});
        if (i % 3 == 1) s.on_plane({x, -1, z}, {0, 1, 0});
        if (i % 3 == 2) s.on_plane({x, y, 0}, {0, 0, 1});
    }
    expect_rank(s, 5);
    const FreeTwist f = s.seen().free.at(0);
    EXPECT_EQ(f.kind, FreeTwist::Kind::Translation);
    EXPECT_EQ(f.name, "x");
    EXPECT_EQ(f.sigma, INF);
    expect_infinite(s.seen(), {0});
    // What is determined has the variance that the other five alone would have.
    const Matrix6 I = as_eigen(s.seen().information);
    const Eigen::Matrix<double, 5, 5> expected = I.bottomRightCorner<5, 5>().inverse();
    const Eigen::Matrix<double, 5, 5> mine = as_eigen(s.seen().covariance).bottomRightCorner<5, 5>();
    EXPECT_LT((mine - expected).norm(), 1e-8 * expected.norm());
    EXPECT_LT((I - numeric_information(s.p, s.pose, 0.01)).norm(), 1e-7 * I.norm());
}

TEST(Observability, ATunnelLeavesTheSlideAndTheRollNamedApart)
{
    SeededRandom random(18);
    for (const bool oblique : {false, true})
        for (const bool half : {false, true})
        {
            const Matrix3d A = oblique ? any_rotation(random) : Matrix3d(Matrix3d::Identity());
            const Vector3d centre(5, 6, 7);
            Scene s(tame_pose(random));
            for (int i = 0; i < 200; i++)
            {
                const double angle = random.uniform(0, half ? M_PI : 2 * M_PI);
                const Vector3d n(0, std::cos(angle), std::sin(angle));
                s.on_plane(centre + A * (3 * n + Vector3d(random.uniform(-20, 20), 0, 0)), A * n);
            }
            expect_rank(s, 4);
            const auto free = s.seen().free;
            ASSERT_EQ(free.size(), 2u);
            const bool slide_first = free[0].kind == FreeTwist::Kind::Translation;
            const FreeTwist slide = free[slide_first ? 0 : 1], roll = free[slide_first ? 1 : 0];
            EXPECT_EQ(slide.kind, FreeTwist::Kind::Translation);
            EXPECT_EQ(roll.kind, FreeTwist::Kind::Rotation);
            expect_parallel(slide.axis, A.col(0));
            expect_parallel(roll.axis, A.col(0));
            EXPECT_LT(distance_to_line(centre, to_eigen(roll.through), A.col(0)), 1e-5);
            if (!oblique)
            {
                EXPECT_EQ(slide.name, "x");
                EXPECT_EQ(roll.name, "roll");
            }
        }
}

TEST(Observability, AScrewThreadLeavesTheScrew)
{
    SeededRandom random(19);
    Scene s{CPose3D()};
    const double advance = 0.5;  // m per rad
    for (int i = 0; i < 300; i++)
    {
        const double angle = random.uniform(0, 6), r = random.uniform(2, 3);
        const Vector3d radial(std::cos(angle), std::sin(angle), 0),
            tangent(-std::sin(angle), std::cos(angle), 0);
        // The surface z = advance * angle, and the shaft.
        s.on_plane(r * radial + Vector3d(0, 0, advance * angle),
                   (r * Vector3d::UnitZ() - advance * tangent).normalized());
        s.on_plane(2 * radial + Vector3d(0, 0, advance * angle), radial);
    }
    const Observability o = s.seen();
    EXPECT_EQ(o.rank, 5);
    ASSERT_EQ(o.free.size(), 1u);
    EXPECT_EQ(o.free[0].kind, FreeTwist::Kind::Screw);
    EXPECT_EQ(o.free[0].name, "");
    expect_parallel(o.free[0].axis, {0, 0, 1});
    EXPECT_LT(distance_to_line({0, 0, 0}, to_eigen(o.free[0].through), {0, 0, 1}), 1e-5);
    EXPECT_EQ(to_string(o.free[0].kind), "screw");
}

TEST(Observability, NamesAreGivenWithinFiveDegreesOfAnAxis)
{
    SeededRandom random(20);
    for (const double degrees : {0.0, 4.9, -4.9, 5.1, -5.1, 45.0})
    {
        const double a = degrees * M_PI / 180;
        Scene s(tame_pose(random));
        const Matrix3d A = rotation_about({0, 0, 1}, a);
        s.plane({0, 0, 0}, A.col(1)), s.plane({0, 0, 0}, A.col(2));
        const FreeTwist f = s.seen().free.at(0);
        EXPECT_EQ(f.name, std::abs(degrees) < 5 ? "x" : "") << degrees;
    }
}

TEST(Observability, ARotationThatNoiseLeavesUncertainIsFree)
{
    // A line of points, 10 m long and r across: the roll about it has a deviation of about sigma / (r
    // sqrt(n)).
    SeededRandom random(21);
    for (const double r : {1.0, 0.001})
    {
        Scene s{CPose3D()};
        for (int i = 0; i < 100; i++)
        {
            const double angle = random.uniform(0, 2 * M_PI);
            s.point({random.uniform(-5, 5), r * std::cos(angle), r * std::sin(angle)});
        }
        const Observability sharp = s.seen(1e-4), blurred = s.seen(0.05);
        EXPECT_EQ(sharp.rank, 6) << r;
        EXPECT_EQ(blurred.rank, r < 0.5 ? 5 : 6) << r;
        if (blurred.rank == 5)
        {
            EXPECT_EQ(blurred.free.at(0).name, "roll");
            EXPECT_NEAR(blurred.free[0].sigma, 0.05 / (r * 10), 0.2 * 0.05 / (r * 10));
            EXPECT_TRUE(std::isinf(blurred.covariance(5, 5)));
        }
    }
}

// ---- Hard places ------------------------------------------------------------------------------------------

TEST(Observability, CloudsAreJudgedAlikeAtAnySizeAndAnyPlaceThatFloatResolves)
{
    SeededRandom random(22);
    for (const double size : {0.01, 1.0, 1e4})
        for (const double far : {0.0, 100.0})
        {
            Scene s(CPose3D(far * size, 0, 0, 1, 0.5, 0.2));
            for (int i = 0; i < 50; i++)
                s.point(Vector3d(far * size, -far * size, 0) + random_point(random, size));
            EXPECT_EQ(s.seen(1e-3 * size).rank, 6) << size << " " << far;
        }
}

TEST(Observability, TheTranslationOfASmallDistantCloudIsStillDetermined)
{
    Scene s{CPose3D()};  // 0.1 mm across, 1 km away: float does not resolve its shape
    SeededRandom random(23);
    for (int i = 0; i < 50; i++) s.point(Vector3d(1000, 1000, 0) + random_point(random, 1e-4));
    const Observability o = s.seen(std::nullopt);
    EXPECT_EQ(o.rank, 3);
    for (const auto& f : o.free) EXPECT_EQ(f.kind, FreeTwist::Kind::Rotation);
}

TEST(Observability, PairingsWithNanAreLeftOut)
{
    SeededRandom random(24);
    const CPose3D pose = tame_pose(random);
    for (int kinds = 1; kinds < 32; kinds *= 2)
    {
        const Pairings good = random_pairings(kinds, pose, random);
        const Observability expected = observability(good, pose, known_sigma(0.01));
        for (int where = 0; where < 4; where++)
        {
            Pairings bad = good;
            const Vector3d nan(NaN, 1, 2), g(1, 2, 3), u(0, 0, 1);
            const auto base = where == 0 ? nan : g, dir = where == 1 ? nan : u, local = where == 2 ? nan : g,
                       local_dir = where == 3 ? nan : u;
            if (kinds == 1) add_pair(bad, base, where % 2 ? nan : local);
            if (kinds == 2) bad.paired_pt2ln.push_back({line(base, dir), to_mrpt(where == 3 ? nan : local)});
            if (kinds == 4) bad.paired_pt2pl.push_back({patch(base, dir), to_mrpt(where == 3 ? nan : local)});
            if (kinds == 8) bad.paired_ln2ln.push_back({line(base, dir), line(local, local_dir)});
            if (kinds == 16) bad.paired_pl2pl.push_back({patch(base, dir), patch(local, local_dir)});
            if (kinds == 1 && where == 1) bad.paired_pt2pt.back().local.x = NaN;
            const Observability o = observability(bad, pose, known_sigma(0.01));
            EXPECT_EQ(as_eigen(o.information), as_eigen(expected.information)) << kinds << " " << where;
            EXPECT_EQ(o.residual_rms, expected.residual_rms) << kinds << " " << where;
            EXPECT_DOUBLE_EQ(residual_rms(bad, pose), o.residual_rms) << kinds << " " << where;
        }
    }
}

TEST(Observability, GimbalLockIsAPropertyOfTheAnglesNotOfThePose)
{
    SeededRandom random(25);
    for (const double pitch : {M_PI / 2, -M_PI / 2, M_PI / 2 - 1e-9, M_PI / 2 - 1e-3})
    {
        const CPose3D pose(1, 2, 3, 0.4, pitch, 0.2);
        Scene s(pose);
        for (int i = 0; i < 30; i++) s.point(random_point(random, 10));
        const Observability o = s.seen(0.01);
        EXPECT_EQ(o.rank, 6);
        EXPECT_TRUE(o.free.empty());
        for (int r = 0; r < 6; r++)
            for (int c = 0; c < 6; c++)
            {
                EXPECT_FALSE(std::isnan(o.covariance(r, c)));
                EXPECT_TRUE(std::isfinite(o.information(r, c)));
            }
        if (std::abs(pitch) > M_PI / 2 - 1e-6) expect_infinite(o, {3, 5});
        // Position does not know of angles: the same cloud seen at a harmless pitch has the same covariance
        // of x y z.
        Scene harmless(CPose3D(1, 2, 3, 0.4, 0.3, 0.2));
        for (const auto& x : s.p.paired_pt2pt) harmless.point(to_eigen(mrpt::math::TPoint3D(x.global)));
        const Matrix3d expected = as_eigen(harmless.seen(0.01).covariance).topLeftCorner<3, 3>();
        const Matrix3d mine = as_eigen(o.covariance).topLeftCorner<3, 3>();
        EXPECT_LT((mine - expected).norm(), 1e-6 * expected.norm()) << pitch;
    }
}

TEST(Observability, SignsAreFreeWhereTheyAreSaidToBe)
{
    SeededRandom random(26);
    const CPose3D pose = tame_pose(random);
    const Pairings p = random_pairings(24, pose, random);
    Pairings flipped = p;
    for (auto& x : flipped.paired_ln2ln) x.ln_local.director *= -1.0;
    for (auto& x : flipped.paired_pl2pl)
        for (auto& c : x.p_local.plane.coefs) c = -c;
    ObservabilityParameters free = known_sigma(0.01), estimated;
    free.pair_weights.pl2pl_sign = estimated.pair_weights.pl2pl_sign = DirectionSign::Free;
    const Matrix6 a = as_eigen(observability(p, pose, free).information),
                  b = as_eigen(observability(flipped, pose, free).information);
    EXPECT_LT((a - b).norm(), 1e-12 * a.norm());
    EXPECT_NEAR(observability(flipped, pose, estimated).sigma, observability(p, pose, estimated).sigma,
                1e-12);
    // Oriented normals that are turned round do not fit.
    estimated.pair_weights.pl2pl_sign = DirectionSign::Oriented;
    EXPECT_GT(observability(flipped, pose, estimated).sigma, 0.5);
    EXPECT_LT(observability(p, pose, estimated).sigma, 0.1);
}

// ---- What errors of the primitives feign, and what a prior knows
// --------------------------------------------

namespace
{
/// Points on two walls (normals y) and a floor (normals z) of a corridor along x; each normal is off by a
/// random tilt.
struct NoisyCorridor
{
    Pairings pairings, feigned;

    NoisyCorridor(size_t points, double tilt_sigma, uint64_t seed)
    {
        SeededRandom random(seed);
        for (size_t i = 0; i < points; i++)
        {
            const size_t face = i % 3;
            Vector3d at(random.uniform(-5, 5),
                        face == 0   ? -2
                        : face == 1 ? 2
                                    : random.uniform(-2, 2),
                        face == 2 ? -1 : random.uniform(-1, 1));
            const Vector3d normal = face == 2 ? Vector3d::UnitZ() : Vector3d::UnitY();
            const Vector3d across = Vector3d::UnitX(), other = normal.cross(across);
            const Vector3d tilted =
                (normal + tilt_sigma * (random.gaussian() * across + random.gaussian() * other)).normalized();
            add(at, tilted, 1, pairings);
            add(at, across, tilt_sigma * tilt_sigma, feigned);
            add(at, other, tilt_sigma * tilt_sigma, feigned);
        }
    }
    static void add(const Vector3d& at, const Vector3d& normal, double weight, Pairings& to)
    {
        point_plane_pair_t pair;
        pair.pl_global = patch(at, normal), pair.pt_local = to_mrpt(at);
        to.paired_pt2pl.push_back(pair), to.pt2pl_weights.emplace_back(1, weight);
    }
};
}  // namespace

TEST(Observability, WhatErrorsOfNormalsFeignIsNotDetermined)
{
    for (uint64_t seed = 1; seed <= 50; seed++)
    {
        const NoisyCorridor corridor(300, 0.03, seed);
        EXPECT_EQ(observability(corridor.pairings, CPose3D()).rank, 6) << "the tilts look like information";
        ObservabilityParameters p;
        p.feigned = &corridor.feigned;
        const auto seen = observability(corridor.pairings, CPose3D(), p);
        ASSERT_EQ(seen.free.size(), 1u) << seed;
        EXPECT_EQ(seen.free[0].name, "x");
        EXPECT_EQ(seen.free[0].kind, FreeTwist::Kind::Translation);
    }
}

TEST(Observability, AFewRowsAlongTheCorridorAreMoreThanErrorsFeign)
{
    NoisyCorridor corridor(300, 0.03, 1);
    // What 300 tilts feign along x is 0.27 rows in the mean: four times that is 1.1.
    for (int i = 0; i < 5; i++)
        NoisyCorridor::add({4, 0.2 * i, 0.1 * i}, Vector3d::UnitX(), 1, corridor.pairings);
    ObservabilityParameters p;
    p.feigned = &corridor.feigned;
    EXPECT_EQ(observability(corridor.pairings, CPose3D(), p).rank, 6);
    p.feigned_factor = 40;
    EXPECT_EQ(observability(corridor.pairings, CPose3D(), p).rank, 5);
}

TEST(Observability, APriorDeterminesWhatItKnowsWellEnoughAndCounts)
{
    const NoisyCorridor corridor(300, 0, 1);  // exact: x is free
    ObservabilityParameters p;
    p.sigma = 0.01;
    p.prior.emplace();
    p.prior->mean = CPose3D(0.3, 0, 0, 0, 0, 0);
    p.prior->cov_inv.setZero();
    p.prior->cov_inv(0, 0) = 1 / (0.2 * 0.2);
    p.prior_deviation = 0.5;
    const auto known = observability(corridor.pairings, CPose3D(), p);
    EXPECT_EQ(known.rank, 6);
    EXPECT_NEAR(std::sqrt(known.covariance(0, 0)), 0.2, 1e-6);
    p.prior_deviation = 0.1;
    const auto too_vague = observability(corridor.pairings, CPose3D(), p);
    EXPECT_EQ(too_vague.rank, 5);
    EXPECT_TRUE(std::isinf(too_vague.covariance(0, 0)));
    p.prior->cov_inv.setZero();
    p.prior->cov_inv(1, 1) = 1e8;  // across, which the walls know: adds to it
    const auto across = observability(corridor.pairings, CPose3D(), p);
    EXPECT_EQ(across.rank, 5);
    p.prior.reset();
    EXPECT_NEAR(across.information(1, 1),
                observability(corridor.pairings, CPose3D(), p).information(1, 1) + 1e8, 1e-6 * 1e8);
}
