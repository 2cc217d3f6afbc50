#include <mp2p_icp/observability.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>

#include <limits>
#include <set>

#include "pose_minimiser.h"
#include "random_pairings.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
constexpr double DEG = M_PI / 180, NaN = std::numeric_limits<double>::quiet_NaN();

/// Enough steps for full precision.
OptimalTF_GN_Parameters precise(const std::optional<CPose3D>& start = std::nullopt)
{
    OptimalTF_GN_Parameters p;
    p.linearizationPoint = start;
    p.maxInnerLoopIterations = 100;
    p.minDelta = 1e-12;
    return p;
}

CPose3D solved(const Pairings& in, const OptimalTF_GN_Parameters& p)
{
    OptimalTF_Result r;
    EXPECT_TRUE(optimal_tf_gauss_newton(in, r, p));
    return r.optimalPose;
}

/// The pose turned about the local point `about` by `angle`, which moves by `distance`.
CPose3D displaced(const CPose3D& pose, double angle, double distance, SeededRandom& random,
                  const Vector3d& about = Vector3d::Zero())
{
    const Vector3d at =
        rotation_of(pose) * about + translation_of(pose) + distance * random_direction(random);
    const Matrix3d R = rotation_about(random_direction(random), angle) * rotation_of(pose);
    return make_pose(R, at - R * about);
}

void expect_pose(const CPose3D& found, const CPose3D& expected, double limit)
{
    EXPECT_LT(angle_between(rotation_of(found), rotation_of(expected)), limit);
    EXPECT_LT((translation_of(found) - translation_of(expected)).norm(), limit);
}

/// The cost that the header states, written out in another way: sines, cross products, distances.
struct StatedCost
{
    Pairings in;
    PairWeights w;
    RobustKernel kernel = RobustKernel::None;
    double scale = 1;
    Vector6 mean = Vector6::Zero();
    Matrix6 information = Matrix6::Zero();

    double L() const
    {
        std::vector<std::pair<double, Vector3d>> all;
        const auto point_weights = in.expanded_point_weights();
        for (size_t i = 0; i < in.paired_pt2pt.size(); i++)
            all.emplace_back(point_weights[i] * w.pt2pt, local_of(in, i));
        for (const auto& p : in.paired_pt2ln) all.emplace_back(w.pt2ln, to_eigen(p.pt_local));
        for (const auto& p : in.paired_pt2pl) all.emplace_back(w.pt2pl, to_eigen(p.pt_local));
        double sum = 0, squares = 0;
        Vector3d centre = Vector3d::Zero();
        for (const auto& [weight, p] : all) sum += weight, centre += weight * p;
        for (const auto& [weight, p] : all) squares += weight * (p - centre / sum).squaredNorm();
        return squares > 1e-12 * sum ? std::sqrt(squares / sum) : 1.0;
    }

    double loss(double square) const { return robust_loss(kernel, square, scale); }

    double operator()(const Vector6& c) const
    {
        const CPose3D pose = pose_of(c);
        const Matrix3d R = rotation_of(pose);
        const double LL = L() * L();
        const auto moved = [&](const mrpt::math::TPoint3D& p) -> Vector3d
        { return R * to_eigen(p) + translation_of(pose); };
        const auto from_line = [&](const mrpt::math::TLine3D& l, const mrpt::math::TPoint3D& p)
        { return (moved(p) - to_eigen(l.pBase)).cross(to_eigen(l.director).normalized()).squaredNorm(); };
        const auto from_plane = [&](const plane_patch_t& g, const mrpt::math::TPoint3D& p)
        { return std::pow(g.plane.evaluatePoint(to_mrpt(moved(p))), 2); };
        const auto normal = [](const plane_patch_t& p)
        { return Vector3d(p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]); };

        double sum = 0;
        const auto point_weights = in.expanded_point_weights();
        for (size_t i = 0; i < in.paired_pt2pt.size(); i++)
            sum += w.pt2pt * point_weights[i] *
                   loss((moved(to_mrpt(local_of(in, i))) - global_of(in, i)).squaredNorm());
        for (const auto& p : in.paired_pt2ln) sum += w.pt2ln * loss(from_line(p.ln_global, p.pt_local));
        for (const auto& p : in.paired_pt2pl) sum += w.pt2pl * loss(from_plane(p.pl_global, p.pt_local));
        for (const auto& p : in.paired_ln2ln)
        {
            const Vector3d u = R * to_eigen(p.ln_local.director).normalized();
            const double sine_sq = u.cross(to_eigen(p.ln_global.director).normalized()).squaredNorm();
            sum += w.ln2ln * loss(from_line(p.ln_global, p.ln_local.pBase) + LL * sine_sq);
        }
        for (const auto& p : in.paired_pl2pl)
        {
            const double direction_sq = (R * normal(p.p_local) - normal(p.p_global)).squaredNorm();
            sum += w.pl2pl * loss(from_plane(p.p_global, p.p_local.centroid) + LL * direction_sq);
        }
        Vector6 e = c - mean;
        for (int i = 3; i < 6; i++) e(i) = std::remainder(e(i), 2 * M_PI);
        return sum + e.dot(information * e);
    }
};

const std::vector<Mix> MINIMAL = {{3, 0, 0, 0, 0}, {0, 3, 0, 0, 0}, {0, 0, 6, 0, 0}, {0, 0, 0, 2, 0},
                                  {0, 0, 0, 0, 3}, {2, 0, 1, 0, 0}, {1, 0, 0, 1, 0}, {1, 0, 0, 0, 2},
                                  {0, 0, 0, 1, 1}, {0, 1, 4, 0, 0}, {1, 1, 1, 0, 0}, {0, 2, 0, 0, 1}};
const std::vector<Mix> AMPLE = {{20, 0, 0, 0, 0}, {0, 20, 0, 0, 0},  {0, 0, 40, 0, 0}, {0, 0, 0, 10, 0},
                                {0, 0, 0, 0, 10}, {5, 5, 5, 5, 5},   {1, 0, 0, 0, 8},  {0, 10, 10, 0, 0},
                                {0, 0, 0, 8, 8},  {1, 10, 0, 10, 0}, {3, 0, 20, 0, 5}};
}  // namespace

TEST(GaussNewton, ExactMinimalSetsAreRecoveredFromNearby)
{
    for (size_t m = 0; m < MINIMAL.size(); m++)
    {
        SeededRandom random(m + 1);
        int used = 0;
        for (int k = 0; k < 4000 && used < 30; k++)
        {
            const CPose3D truth = any_pose(random);
            const Pairings p = random_pairings(MINIMAL[m], rotation_of(truth), translation_of(truth), random);
            // Only sets that determine the pose well; in others, another exact pose may be as near.
            // Directions weigh as the points do, also where there are none.
            ObservabilityParameters weighed = known_sigma(1.0);
            weighed.pair_weights.ln2ln_direction = weighed.pair_weights.pl2pl_direction = 25;
            const auto o = observability(p, truth, weighed);
            if (o.rank < 6 || Eigen::Matrix3d(o.covariance.asEigen().topLeftCorner<3, 3>()).trace() > 1e4 ||
                (o.covariance.asEigen().bottomRightCorner<3, 3>()).trace() > 1)
                continue;
            used++;
            const CPose3D start = displaced(truth, 0.1 * DEG, 0.005, random);
            expect_pose(solved(p, precise(start)), truth, 1e-9);
            if (HasFailure()) FAIL() << "mix " << m << ", set " << k;
        }
        EXPECT_EQ(used, 30) << "mix " << m;
    }
}

TEST(GaussNewton, ExactSetsAreRecoveredAtAllAnglesFromThirtyDegrees)
{
    for (size_t m = 0; m < AMPLE.size(); m++)
    {
        SeededRandom random(m + 1);
        for (const double angle : {0.0, 1e-9, 1.0, 3.0, M_PI - 1e-7, M_PI})
            for (int k = 0; k < 10; k++)
            {
                const CPose3D truth =
                    make_pose(rotation_about(random_direction(random), angle), random_point(random, 20));
                const Pairings p =
                    random_pairings(AMPLE[m], rotation_of(truth), translation_of(truth), random);
                const CPose3D start = displaced(truth, 30 * DEG * random.uniform(0, 1), 0.5, random);
                expect_pose(solved(p, precise(start)), truth, 1e-9);
                if (HasFailure()) FAIL() << "mix " << m << ", angle " << angle << ", set " << k;
            }
    }
}

TEST(GaussNewton, AgreesWithHornOnPoints)
{
    SeededRandom random(1);
    for (int k = 0; k < 50; k++)
    {
        const CPose3D truth = any_pose(random);
        Pairings p = moved_points(random_points(30, 5, static_cast<uint64_t>(k)), rotation_of(truth),
                                  translation_of(truth), 0.3, static_cast<uint64_t>(k));
        std::vector<double> weights(30);
        for (auto& w : weights) w = random.uniform(0, 3);
        p.point_weights = as_runs(weights);
        OptimalTF_Result horn;
        ASSERT_TRUE(optimal_tf_horn(p, {}, horn));
        expect_pose(solved(p, precise(displaced(truth, 30 * DEG, 1, random))), horn.optimalPose, 1e-9);
        expect_pose(solved(p, precise()), horn.optimalPose, 1e-9);
    }
}

TEST(GaussNewton, WithoutAStartItFindsOneOverAllRotations)
{
    SeededRandom random(2);
    for (int k = 0; k < 20; k++)
    {
        // Half a turn away from the identity: lines without sign and planes could not find that alone.
        const CPose3D truth = make_pose(rotation_about(random_direction(random), M_PI), {50, 60, 70});
        Pairings p =
            random_pairings({4, 3, 3, 3, 3}, rotation_of(truth), translation_of(truth), random, 0.001);
        expect_pose(solved(p, precise()), solved(p, precise(truth)), 1e-9);
        add_pair(p, {NaN, 0, 0}, {0, 0, 0});  // is no obstacle
        expect_pose(solved(p, precise()), solved(p, precise(truth)), 1e-9);
    }
}

TEST(GaussNewton, IsTheMinimumOfTheStatedCost)
{
    SeededRandom random(3);
    for (const auto kernel : {RobustKernel::None, RobustKernel::Huber, RobustKernel::Cauchy})
        for (int k = 0; k < 3; k++)
        {
            const CPose3D truth = synthetic::random_pose({5, 5, 5, 2.5, 1.2, 2.5}, random);
            StatedCost cost;
            cost.kernel = kernel, cost.scale = 0.2;
            cost.in =
                random_pairings({4, 5, 6, 4, 4}, rotation_of(truth), translation_of(truth), random, 0.1);
            cost.w.pt2pt = 1.5, cost.w.pt2ln = 0.7, cost.w.pt2pl = 2, cost.w.ln2ln = 1.2, cost.w.pl2pl = 0.4;
            cost.in.point_weights = {{2, 0.5}, {1, 3.0}};
            auto parameters = precise(truth);
            parameters.kernel = kernel, parameters.kernelParam = cost.scale, parameters.pairWeights = cost.w;
            if (k == 0)
            {
                cost.mean =
                    coordinates(truth) + 0.2 * Vector6::NullaryExpr([&]() { return random.gaussian(); });
                cost.information = random_information(random, 10);
                parameters.prior = prior_of(pose_of(cost.mean), cost.information);
            }
            OptimalTF_Result r;
            GaussNewtonReport report;
            ASSERT_TRUE(optimal_tf_gauss_newton(cost.in, r, parameters, &report));
            const Vector6 mine = coordinates(r.optimalPose), best = brute_force(cost, {truth});
            EXPECT_NEAR(report.cost, cost(mine), 1e-12 * cost(mine));
            // At a minimum, costs equal to 1e-12 mean coordinates equal to 1e-6.
            EXPECT_LE(cost(mine), cost(best) * (1 + 1e-9));
            expect_pose(r.optimalPose, pose_of(best), 2e-5);
            EXPECT_LT(cost(mine), 0.99 * cost(coordinates(truth)));
            for (int i = 0; i < 6; i++)  // a gradient of zero, by central differences
            {
                Vector6 step = Vector6::Zero();
                step(i) = 1e-5;
                EXPECT_LT(std::abs(cost(mine + step) - cost(mine - step)) / 2e-5, 1e-5 * 30 * 100)
                    << int(kernel) << " " << k << " " << i;
            }
        }
}

TEST(GaussNewton, NeverEndsHigherThanItStarted)
{
    SeededRandom random(4);
    for (int k = 0; k < 300; k++)
    {
        const CPose3D truth = any_pose(random), start = any_pose(random);  // anywhere
        StatedCost cost;
        cost.in = random_pairings(AMPLE[static_cast<size_t>(k) % AMPLE.size()], rotation_of(truth),
                                  translation_of(truth), random, 0.3);
        cost.kernel = static_cast<RobustKernel>(k % 6), cost.scale = 3;
        auto parameters = precise(start);
        parameters.kernel = cost.kernel, parameters.kernelParam = cost.scale;
        OptimalTF_Result r;
        if (!optimal_tf_gauss_newton(cost.in, r, parameters)) continue;  // a kernel may refuse all
        EXPECT_LE(cost(coordinates(r.optimalPose)), cost(coordinates(start)) * (1 + 1e-9)) << k;
    }
}

namespace
{
Pairings noisy_mix(const CPose3D& truth, uint64_t seed, double noise = 0.1)
{
    SeededRandom random(seed);
    return random_pairings({6, 6, 6, 6, 6}, rotation_of(truth), translation_of(truth), random, noise);
}
double& weight_of(PairWeights& w, int kind)
{
    double* const all[] = {&w.pt2pt, &w.pt2ln, &w.pt2pl, &w.ln2ln, &w.pl2pl};
    return *all[kind];
}
template <class Action>
void on_list(Pairings& p, int kind, const Action& action)
{
    if (kind == 0) action(p.paired_pt2pt);
    if (kind == 1) action(p.paired_pt2ln);
    if (kind == 2) action(p.paired_pt2pl);
    if (kind == 3) action(p.paired_ln2ln);
    if (kind == 4) action(p.paired_pl2pl);
}
const CPose3D TRUTH(1, 2, 3, 0.4, -0.5, 2);
}  // namespace

TEST(GaussNewton, AKindOfWeightZeroHasNoInfluence)
{
    const Pairings all = noisy_mix(TRUTH, 5);
    for (int kind = 0; kind < 5; kind++)
    {
        Pairings without = all;
        on_list(without, kind, [](auto& list) { list.clear(); });
        auto parameters = precise(TRUTH);
        const CPose3D expected = solved(without, parameters);
        EXPECT_GT(angle_between(rotation_of(solved(all, parameters)), rotation_of(expected)), 1e-4) << kind;
        weight_of(parameters.pairWeights, kind) = 0;
        expect_pose(solved(all, parameters), expected, 1e-11);
    }
    Pairings points = moved_points(random_points(9, 2, 1), rotation_of(TRUTH), {1, 2, 3}, 0.1);
    const CPose3D expected = solved(points, precise(TRUTH));
    add_pair(points, {100, 0, 0}, {0, 0, 0});
    points.point_weights = {{9, 1.0}, {1, 0.0}};
    expect_pose(solved(points, precise(TRUTH)), expected, 1e-11);
}

TEST(GaussNewton, TwiceTheWeightIsThePairingTwice)
{
    const Pairings once = noisy_mix(TRUTH, 6);
    for (int kind = 0; kind < 5; kind++)
    {
        Pairings twice = once;
        on_list(twice, kind,
                [](auto& list)
                {
                    const auto copy = list;
                    list.insert(list.end(), copy.begin(), copy.end());
                });
        auto parameters = precise(TRUTH);
        const CPose3D single = solved(once, parameters), expected = solved(twice, parameters);
        EXPECT_GT(angle_between(rotation_of(single), rotation_of(expected)), 1e-4) << kind;
        weight_of(parameters.pairWeights, kind) = 2;
        expect_pose(solved(once, parameters), expected, 1e-9);
    }
}

TEST(GaussNewton, KernelsResistOutliersNearTheSolution)
{
    Pairings p = noisy_mix(TRUTH, 7, 0.005);
    const CPose3D clean = solved(p, precise(TRUTH));
    SeededRandom random(8);
    const CPose3D wrong = displaced(TRUTH, 1, 5, random);
    p.push_back(random_pairings({2, 2, 2, 2, 2}, rotation_of(wrong), translation_of(wrong), random));
    auto parameters = precise(displaced(TRUTH, 1 * DEG, 0.05, random));
    const double without = angle_between(rotation_of(solved(p, parameters)), rotation_of(clean));
    EXPECT_GT(without, 3 * DEG);
    for (const auto kernel : {RobustKernel::GemanMcClure, RobustKernel::Cauchy, RobustKernel::Huber,
                              RobustKernel::Tukey, RobustKernel::Truncated})
    {
        parameters.kernel = kernel;
        // Of the start's residuals' size; those that cut off must see all inliers at first.
        parameters.kernelParam =
            kernel == RobustKernel::Tukey || kernel == RobustKernel::Truncated ? 0.5 : 0.02;
        const CPose3D found = solved(p, parameters);
        const double limit = kernel == RobustKernel::Huber ? 0.15 * without : 0.005;
        EXPECT_LT(angle_between(rotation_of(found), rotation_of(clean)), limit) << int(kernel);
    }
}

TEST(GaussNewtonPrior, AStrongOneOnSomeCoordinatesLeavesTheOthersToThePoints)
{
    // z held by 1e12 while the points weigh some 10: none of them may drown.
    const CPose3D truth(1, 2, 3, 0.3, 0, 0);
    const Pairings p = moved_points(random_points(20, 2, 3), rotation_of(truth), translation_of(truth));
    Matrix6 flat = Matrix6::Zero();
    flat(2, 2) = flat(4, 4) = flat(5, 5) = 1e12;
    auto parameters = precise();
    parameters.prior = prior_of(CPose3D(-50, 70, 0, 3, 0, 0), flat);
    const CPose3D planar = solved(p, parameters);
    EXPECT_NEAR(planar.z(), 0, 1e-9);
    EXPECT_NEAR(planar.pitch(), 0, 1e-9);
    EXPECT_NEAR(planar.roll(), 0, 1e-9);
    EXPECT_NEAR(planar.yaw(), 0.3, 1e-7);
    EXPECT_NEAR(planar.x(), 1, 1e-7);
    EXPECT_NEAR(planar.y(), 2, 1e-7);
}

TEST(GaussNewtonPrior, AStrongOneGivesItsOwnPoseAWeakOneThePairings)
{
    SeededRandom random(9);
    for (int k = 0; k < 20; k++)
    {
        const CPose3D truth = any_pose(random);
        const Pairings p = noisy_mix(truth, 10 + static_cast<uint64_t>(k));
        const CPose3D mean = displaced(truth, 0.2, 1, random);
        if (std::abs(mean.pitch()) > 1.4) continue;
        auto parameters = precise(truth);
        const CPose3D alone = solved(p, parameters);
        parameters.prior = prior_of(mean, Matrix6::Identity() * 1e14);
        expect_pose(solved(p, parameters), mean, 1e-8);
        parameters.prior = prior_of(mean, Matrix6::Identity() * 1e-12);
        expect_pose(solved(p, parameters), alone, 1e-8);
    }
}

TEST(GaussNewtonPrior, DecidesWhatThePairingsLeaveFree)
{
    Pairings one;
    add_pair(one, {1, 2, 3}, {4, 5, 6});
    Matrix6 rotation = Matrix6::Zero();
    rotation.bottomRightCorner<3, 3>().setIdentity();
    const CPose3D mean(0, 0, 0, 0.5, -0.4, 0.3);
    auto parameters = precise(CPose3D());
    parameters.prior = prior_of(mean, rotation);
    const CPose3D pose = solved(one, parameters);
    EXPECT_LT(angle_between(rotation_of(pose), rotation_of(mean)), 1e-9);
    EXPECT_LT((rotation_of(pose) * Vector3d(4, 5, 6) + translation_of(pose) - Vector3d(1, 2, 3)).norm(),
              1e-9);
}

TEST(GaussNewtonPrior, SurvivesGimbalLock)
{
    for (const double pitch : {M_PI / 2, -M_PI / 2, M_PI / 2 - 1e-9})
    {
        const CPose3D truth(1, 2, 3, 0.3, pitch, 0.2);
        auto parameters = precise(truth);
        parameters.prior = prior_of(truth, Matrix6::Identity() * 1e-3);
        const CPose3D found = solved(noisy_mix(truth, 11, 0.01), parameters);
        EXPECT_LT(angle_between(rotation_of(found), rotation_of(truth)), 0.02);
    }
}

TEST(GaussNewtonFree, OnePointKeepsTheRotation)
{
    Pairings one;
    add_pair(one, {1, 2, 3}, {4, 5, 6});
    const CPose3D start(7, 8, 9, 2, 1, -3);
    OptimalTF_Result r;
    GaussNewtonReport report;
    ASSERT_TRUE(optimal_tf_gauss_newton(one, r, precise(start), &report));
    EXPECT_EQ(report.rank, 3);
    EXPECT_LT(angle_between(rotation_of(r.optimalPose), rotation_of(start)), 1e-12);
    const Vector3d at = rotation_of(r.optimalPose) * Vector3d(4, 5, 6) + translation_of(r.optimalPose);
    EXPECT_LT((at - Vector3d(1, 2, 3)).norm(), 1e-12);
}

TEST(GaussNewtonFree, CollinearPointsKeepTheRollNearestToTheStarts)
{
    SeededRandom random(12);
    for (int k = 0; k < 20; k++)
    {
        const CPose3D truth = any_pose(random);
        const Vector3d u = random_direction(random), b = random_point(random, 5);
        const Pairings p = moved_points({b, b + u, b + 3 * u}, rotation_of(truth), translation_of(truth));
        const CPose3D start = displaced(truth, 30 * DEG, 1, random, b);
        OptimalTF_Result horn, mine;
        GaussNewtonReport report;
        ASSERT_TRUE(optimal_tf_horn(p, {}, horn, start));
        ASSERT_TRUE(optimal_tf_gauss_newton(p, mine, precise(start), &report));
        EXPECT_EQ(report.rank, 5);
        expect_pose(mine.optimalPose, horn.optimalPose, 1e-9);
    }
}

TEST(GaussNewtonFree, OnePlaneKeepsWhereItSlidesAndHowItTurns)
{
    SeededRandom random(13);
    for (int k = 0; k < 20; k++)
    {
        const CPose3D truth = any_pose(random);
        const Pairings p =
            random_pairings({0, 0, 0, 0, 1}, rotation_of(truth), translation_of(truth), random);
        const auto& [global, local] = p.paired_pl2pl[0];
        const Vector3d n(global.plane.coefs[0], global.plane.coefs[1], global.plane.coefs[2]),
            m(local.plane.coefs[0], local.plane.coefs[1], local.plane.coefs[2]);
        const CPose3D start = displaced(truth, 30 * DEG, 1, random, to_eigen(local.centroid));
        OptimalTF_Result r;
        GaussNewtonReport report;
        ASSERT_TRUE(optimal_tf_gauss_newton(p, r, precise(start), &report));
        EXPECT_EQ(report.rank, 3);
        const Matrix3d R = rotation_of(r.optimalPose);
        EXPECT_LT((R * m - n).norm(), 1e-9);
        // No more turned than it takes.
        const double needed = std::asin((rotation_of(start) * m).cross(n).norm());
        EXPECT_NEAR(angle_between(R, rotation_of(start)), needed, 1e-9);
        const auto centroid = [&](const CPose3D& pose) -> Vector3d
        { return rotation_of(pose) * to_eigen(local.centroid) + translation_of(pose); };
        const Vector3d motion = centroid(r.optimalPose) - centroid(start);
        EXPECT_LT((motion - n * n.dot(motion)).norm(), 1e-9);
        EXPECT_LT(std::abs(n.dot(centroid(r.optimalPose) - to_eigen(global.centroid))), 1e-9);
    }
}

TEST(GaussNewtonFree, ParallelLinesAndCorridorsKeepTheAdvance)
{
    SeededRandom random(14);
    Pairings lines, corridor;
    const CPose3D truth = any_pose(random);
    const Matrix3d R = rotation_of(truth);
    const Vector3d t = translation_of(truth), z = Vector3d::UnitZ();
    Vector3d mean_of_corridor = Vector3d::Zero();
    for (int k = 0; k < 3; k++)
    {
        const Vector3d q = random_point(random, 5);
        lines.paired_ln2ln.push_back(
            {line(q, z), line(R.transpose() * (q - t), R.transpose() * Vector3d(0, 0, -1))});
    }
    for (int k = 0; k < 40; k++)
    {
        Vector3d q = random_point(random, 5), n = k % 2 ? Vector3d::UnitX() : Vector3d::UnitY();
        const Vector3d b = R.transpose() * (q - t);
        corridor.paired_pt2pl.push_back({patch(q + 2 * z, n), to_mrpt(b)});
        mean_of_corridor += b / 40;
    }
    Vector3d mean_of_lines = Vector3d::Zero();
    for (const auto& p : lines.paired_ln2ln) mean_of_lines += to_eigen(p.ln_local.pBase) / 3;
    for (const auto& [p, mean] :
         {std::make_pair(lines, mean_of_lines), std::make_pair(corridor, mean_of_corridor)})
    {
        const CPose3D start = displaced(truth, 20 * DEG, 1, random, mean);
        OptimalTF_Result r;
        GaussNewtonReport report;
        ASSERT_TRUE(optimal_tf_gauss_newton(p, r, precise(start), &report));
        EXPECT_EQ(report.rank, 5);
        EXPECT_LT(angle_between(rotation_of(r.optimalPose), R), 1e-9);
        const auto at = [&, m = mean](const CPose3D& pose) -> Vector3d
        { return rotation_of(pose) * m + translation_of(pose); };
        EXPECT_NEAR(at(r.optimalPose).z(), at(start).z(), 1e-9);
        EXPECT_LT((at(r.optimalPose) - at(truth)).head<2>().norm(), 1e-9);
        EXPECT_GT(std::abs(at(start).z() - at(truth).z()), 1e-3);  // or the test says nothing
    }
}

TEST(GaussNewton, PairingsThatAreNotFiniteAreSkippedAndCounted)
{
    const Pairings clean = noisy_mix(TRUTH, 15);
    Pairings dirty = clean;
    add_pair(dirty, {1, 2, 3}, {NaN, 0, 0});
    dirty.paired_pt2ln.push_back({line({0, 0, 0}, {0, 0, 0}), {1, 2, 3}});
    dirty.paired_pt2pl.push_back({patch({0, 0, INFINITY}, {0, 0, 1}), {1, 2, 3}});
    dirty.paired_ln2ln.push_back({line({0, 0, 0}, {0, 0, 1}), line({0, 0, 0}, {0, NaN, 1})});
    dirty.paired_pl2pl.push_back({patch({0, 0, 0}, {0, 0, 1}), patch({0, 0, 0}, {0, 0, 0})});
    OptimalTF_Result r;
    GaussNewtonReport report;
    ASSERT_TRUE(optimal_tf_gauss_newton(dirty, r, precise(TRUTH), &report));
    EXPECT_EQ(report.skipped, 5);
    expect_same_bits(r.optimalPose, solved(clean, precise(TRUTH)));
}

TEST(GaussNewton, WithNothingUsableItFailsAndLeavesTheResult)
{
    const auto expect_failure = [](const Pairings& p, const OptimalTF_GN_Parameters& parameters)
    {
        OptimalTF_Result r;
        r.optimalPose = CPose3D(1, 2, 3, 0, 0, 0);
        GaussNewtonReport report;
        EXPECT_FALSE(optimal_tf_gauss_newton(p, r, parameters, &report));
        EXPECT_EQ(report.end, GaussNewtonEnd::NoUsablePairing);
        EXPECT_EQ(r.optimalPose.x(), 1);
    };
    auto with_prior = precise();
    with_prior.prior = prior_of(TRUTH, Matrix6::Identity());
    expect_failure({}, precise());
    expect_failure({}, with_prior);
    Pairings nan;
    add_pair(nan, {1, 2, 3}, {NaN, 0, 0});
    expect_failure(nan, with_prior);
    Pairings weightless = moved_points(random_points(9, 2, 1), rotation_of(TRUTH), {1, 2, 3});
    weightless.point_weights = {{9, 0.0}};
    expect_failure(weightless, precise());
    auto truncated = precise(CPose3D(1000, 0, 0, 0, 0, 0));  // sees no pairing from there
    truncated.kernel = RobustKernel::Truncated, truncated.kernelParam = 0.1;
    expect_failure(noisy_mix(TRUTH, 16), truncated);
}

TEST(GaussNewton, WrongArgumentsAreRefused)
{
    const Pairings p = noisy_mix(TRUTH, 17);
    OptimalTF_Result r;
    auto negative = precise();
    negative.pairWeights.ln2ln = -1;
    EXPECT_THROW(optimal_tf_gauss_newton(p, r, negative), std::invalid_argument);
    auto scale = precise();
    scale.kernel = RobustKernel::Huber, scale.kernelParam = 0;
    EXPECT_THROW(optimal_tf_gauss_newton(p, r, scale), std::invalid_argument);
    EXPECT_THROW(optimal_tf_gauss_newton(p, r, precise(CPose3D(NaN, 0, 0, 0, 0, 0))), std::invalid_argument);
    Pairings weighted = p;
    weighted.point_weights = {{1, -1.0}};
    EXPECT_THROW(optimal_tf_gauss_newton(weighted, r, precise()), std::invalid_argument);
}

TEST(GaussNewton, SaysWhyItEnded)
{
    const Pairings p = noisy_mix(TRUTH, 18);
    SeededRandom random(19);
    const CPose3D start = displaced(TRUTH, 0.3, 1, random);
    OptimalTF_Result r;
    GaussNewtonReport report;
    ASSERT_TRUE(optimal_tf_gauss_newton(p, r, precise(start), &report));
    EXPECT_EQ(report.end, GaussNewtonEnd::SmallStep);
    EXPECT_EQ(report.rank, 6);
    EXPECT_GT(report.iterations, 2);
    EXPECT_LT(report.iterations, 50);
    const double least = report.cost;

    auto one_step = precise(start);
    one_step.maxInnerLoopIterations = 1;
    ASSERT_TRUE(optimal_tf_gauss_newton(p, r, one_step, &report));
    EXPECT_EQ(report.end, GaussNewtonEnd::MaxIterations);
    EXPECT_EQ(report.iterations, 1);
    EXPECT_GT(report.cost, least);
    EXPECT_GT(angle_between(rotation_of(r.optimalPose), rotation_of(start)), 0.1);

    auto satisfied = precise(start);
    satisfied.maxCost = std::sqrt(2 * least);
    ASSERT_TRUE(optimal_tf_gauss_newton(p, r, satisfied, &report));
    EXPECT_EQ(report.end, GaussNewtonEnd::CostReached);
    EXPECT_LE(report.cost, 2 * least * (1 + 1e-12));
    EXPECT_GT(report.cost, least);

    std::set<std::string> names;
    for (int i = 0; i < 5; i++) names.insert(to_string(static_cast<GaussNewtonEnd>(i)));
    EXPECT_EQ(names.size(), 5);
}

TEST(GaussNewton, CoordinatesFarAwayLoseNothing)
{
    // Multiples of 2^-10 m, which a shift by 1e7 m leaves exact.
    SeededRandom random(20);
    const auto grid = [](const Vector3d& v) -> Vector3d { return (v * 1024).array().round() / 1024; };
    Pairings here, there;
    const Vector3d shift(1e7, -1e7, 1e7);
    const Matrix3d R = rotation_about({1, 2, 3}, 1);
    for (int k = 0; k < 30; k++)
    {
        const Vector3d b = grid(random_point(random, 5)), q = grid(R * b), n = random_direction(random);
        here.paired_pt2pl.push_back({patch(q, n), to_mrpt(b)});
        there.paired_pt2pl.push_back({patch(q + shift, n), to_mrpt(b - shift)});
        here.paired_ln2ln.push_back({line(q, n), line(b, R.transpose() * n)});
        there.paired_ln2ln.push_back({line(q + shift, n), line(b - shift, R.transpose() * n)});
    }
    const CPose3D near_here = make_pose(R, Vector3d::Zero()), near_there = make_pose(R, shift + R * shift);
    EXPECT_LT(angle_between(rotation_of(solved(here, precise(near_here))),
                            rotation_of(solved(there, precise(near_there)))),
              1e-12);
}

TEST(GaussNewton, HasTheSameBitsOnAnyNumberOfThreads)
{
    SeededRandom random(21);
    const Pairings p =
        random_pairings({9000, 9000, 9000, 9000, 9000}, rotation_of(TRUTH), {1, 2, 3}, random, 0.3);
    auto parameters = precise();
    parameters.kernel = RobustKernel::Cauchy;
    parameters.maxInnerLoopIterations = 4;
    CPose3D one;
    with_threads(1, [&]() { one = solved(p, parameters); });
    for (const int threads : {2, 8})
        with_threads(threads, [&]() { expect_same_bits(solved(p, parameters), one); });
}
