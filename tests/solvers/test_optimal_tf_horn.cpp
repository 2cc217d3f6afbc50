#include <mp2p_icp/optimal_tf_horn.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "solver_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

struct Solution
{
    Matrix3d R;
    Vector3d t;
};

/** The slow, other way: S. Umeyama, "Least-squares estimation of transformation parameters between two point
 * patterns", PAMI 13(4), 1991, through the singular values of the weighted covariance.
 */
Solution umeyama(const Pairings& p, const std::vector<double>& w)
{
    double sum = 0;
    Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();
    for (size_t i = 0; i < w.size(); i++)
        sum += w[i], a += w[i] * global_of(p, i), b += w[i] * local_of(p, i);
    a /= sum, b /= sum;
    Matrix3d S = Matrix3d::Zero();
    for (size_t i = 0; i < w.size(); i++)
        S += w[i] * (global_of(p, i) - a) * (local_of(p, i) - b).transpose();
    const Eigen::JacobiSVD<Matrix3d> svd(S, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vector3d d(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
    const Matrix3d R = svd.matrixU() * d.asDiagonal() * svd.matrixV().transpose();
    return {R, a - R * b};
}

Solution solved(const Pairings& p, const WeightParameters& wp = {}, const CPose3D& guess = {})
{
    OptimalTF_Result result;
    EXPECT_TRUE(optimal_tf_horn(p, wp, result, guess));
    EXPECT_EQ(result.optimalScale, 1.0);
    EXPECT_NEAR(rotation_of(result.optimalPose).determinant(), 1, 1e-12);
    return {rotation_of(result.optimalPose), translation_of(result.optimalPose)};
}

/// A value that no solution has, to see that nothing was written.
OptimalTF_Result marked()
{
    OptimalTF_Result r;
    r.optimalPose = CPose3D(1, 2, 3, 0.1, 0.2, 0.3);
    r.optimalScale = 7;
    r.outliers.point2point = {1, 2};
    return r;
}
void expect_refused_quietly(const Pairings& p, const WeightParameters& wp = {})
{
    OptimalTF_Result r = marked();
    EXPECT_FALSE(optimal_tf_horn(p, wp, r));
    expect_same_bits(r.optimalPose, marked().optimalPose);
    EXPECT_EQ(r.status, SolveStatus::NoPairings);
    EXPECT_EQ(r.rank, 0);
}

/// The rotation nearest to `guess` among A Rot(axis, angle), by trying angles ever more finely.
Matrix3d nearest_by_brute_force(const Matrix3d& A, const Vector3d& axis, const Matrix3d& guess)
{
    double centre = 0, width = M_PI;
    for (int level = 0; level < 12; level++, width /= 20)
    {
        double best = 1e9, best_angle = centre;
        for (int k = -100; k <= 100; k++)
        {
            const double angle = centre + width * k / 100.0;
            // -trace grows with the distance, and is smooth.
            const double distance = -(guess.transpose() * A * rotation_about(axis, angle)).trace();
            if (distance < best) best = distance, best_angle = angle;
        }
        centre = best_angle;
    }
    return A * rotation_about(axis, centre);
}
}  // namespace

// ---- The optimum ------------------------------------------------------------------------------------------

TEST(OptimalTfHorn, AgreesWithTheSingularValueSolutionOnNoisyWeightedProblems)
{
    SeededRandom random(1);
    for (int k = 0; k < 300; k++)
    {
        const size_t n = 3 + random.index(60);
        const double noise = std::pow(10.0, random.uniform(-4, 0.5));
        Pairings p = moved_points(random_points(n, 10, 100 + static_cast<uint64_t>(k)), any_rotation(random),
                                  random_point(random, 50), noise, static_cast<uint64_t>(k));
        std::vector<double> w(n);
        for (auto& x : w) x = random.uniform() < 0.2 ? 0 : random.uniform(0.01, 10);
        w[0] = w[1] = w[2] = 1;
        p.point_weights = as_runs(w);
        const Solution mine = solved(p), other = umeyama(p, w);
        // Both are exact up to rounding times the condition of the problem.
        EXPECT_LT(angle_between(mine.R, other.R), 1e-9) << k;
        EXPECT_LT((mine.t - other.t).norm(), 1e-8) << k;
        // Residuals down to 1e-4 m of coordinates of 50 m: 1e-10 of rounding.
        EXPECT_LE(point_cost(p, w, mine.R, mine.t), point_cost(p, w, other.R, other.t) * (1 + 1e-9));
    }
}

TEST(OptimalTfHorn, NoSmallMotionLowersTheCost)
{
    SeededRandom random(2);
    for (int k = 0; k < 20; k++)
    {
        const Pairings p = moved_points(random_points(10, 5, 7), any_rotation(random),
                                        random_point(random, 5), 1.0, static_cast<uint64_t>(k));
        const std::vector<double> w(10, 1.0);
        const Solution s = solved(p);
        for (int m = 0; m < 100; m++)
        {
            const Matrix3d R = rotation_about(random_direction(random), 1e-3) * s.R;
            EXPECT_GT(point_cost(p, w, R, s.t + 1e-3 * random_direction(random)), point_cost(p, w, s.R, s.t));
        }
    }
}

TEST(OptimalTfHorn, ExactDataGiveTheExactPoseAlsoAtHalfTurns)
{
    SeededRandom random(3);
    for (int k = 0; k < 200; k++)
    {
        const Vector3d axis = k < 3 ? Vector3d(Vector3d::Unit(k)) : random_direction(random);
        for (const double angle : {0.0, 1e-9, 0.5, M_PI / 2, M_PI - 1e-3, M_PI - 1e-9, M_PI})
        {
            const Matrix3d R = rotation_about(axis, angle);
            const Vector3d t = random_point(random, 10);
            const Solution s = solved(moved_points(random_points(20, 5, static_cast<uint64_t>(k)), R, t));
            EXPECT_LT(angle_between(s.R, R), 1e-12) << angle;
            EXPECT_LT((s.t - t).norm(), 1e-12 * 20) << angle;
        }
    }
}

TEST(OptimalTfHorn, TheGuessHasNoInfluenceWhereThePoseIsDetermined)
{
    SeededRandom random(4);
    const Pairings p = moved_points(random_points(10, 5, 1), any_rotation(random), {1, 2, 3}, 0.1);
    const Solution s = solved(p);
    for (int k = 0; k < 10; k++)
    {
        const Solution other = solved(p, {}, any_pose(random));
        EXPECT_LT(angle_between(s.R, other.R), 1e-14);
        EXPECT_LT((s.t - other.t).norm(), 1e-13);
    }
}

TEST(OptimalTfHorn, CloudsFarFromTheOriginLoseOnlyWhatTheirCoordinatesLose)
{
    SeededRandom random(5);
    const Vector3d far(1e7, -2e7, 1e7);
    for (int k = 0; k < 20; k++)
    {
        const Matrix3d R = any_rotation(random);
        const auto near = random_points(50, 20, static_cast<uint64_t>(k));
        std::vector<Vector3d> local;
        for (const auto& b : near) local.push_back(b + far);
        const Vector3d t = random_point(random, 1e7);
        const Solution s = solved(moved_points(local, R, t));
        EXPECT_LT(angle_between(s.R, R), 1e-9);  // coordinates are rounded to 4e-9 m, over 20 m
        EXPECT_LT((s.R * far + s.t - R * far - t).norm(), 2e-8);
    }
}

TEST(OptimalTfHorn, PlanarPointsDetermineThePose)
{
    SeededRandom random(6);
    for (int k = 0; k < 100; k++)
    {
        const Matrix3d plane = any_rotation(random),
                       R = k % 2 ? any_rotation(random) : rotation_about(random_direction(random), M_PI);
        std::vector<Vector3d> local = random_points(10, 5, static_cast<uint64_t>(k));
        for (auto& b : local) b.z() = 0, b = plane * b;
        const Vector3d t = random_point(random, 5);
        const Solution s = solved(moved_points(local, R, t), {}, any_pose(random));
        EXPECT_LT(angle_between(s.R, R), 1e-12);
        EXPECT_LT((s.t - t).norm(), 1e-11);
    }
}

TEST(OptimalTfHorn, MirroredPointsGiveARotationAndNotAReflection)
{
    SeededRandom random(7);
    for (int k = 0; k < 50; k++)
    {
        Pairings p;
        for (const auto& b : random_points(12, 5, static_cast<uint64_t>(k)))
            add_pair(p, {-b.x(), b.y(), b.z()}, b);
        const std::vector<double> w(12, 1.0);
        const Solution s = solved(p), other = umeyama(p, w);
        EXPECT_NEAR(s.R.determinant(), 1, 1e-12);
        EXPECT_LE(point_cost(p, w, s.R, s.t), point_cost(p, w, other.R, other.t) * (1 + 1e-12));
    }
}

// ---- Free directions --------------------------------------------------------------------------------------

TEST(OptimalTfHorn, CollinearPointsGiveTheOptimumNearestToTheGuess)
{
    SeededRandom random(8);
    for (int k = 0; k < 60; k++)
    {
        const Vector3d u = random_direction(random), start = random_point(random, 10);
        const Matrix3d R = any_rotation(random), guess = any_rotation(random);
        const Vector3d t = random_point(random, 10);
        std::vector<Vector3d> local;
        const size_t n = k % 2 ? 2 : 7;
        for (size_t i = 0; i < n; i++) local.push_back(start + random.uniform(-5, 5) * u);
        Pairings p = moved_points(local, R, t);
        std::vector<double> w(n);
        for (auto& x : w) x = random.uniform(0.1, 3);
        p.point_weights = as_runs(w);
        const Solution s = solved(p, {}, make_pose(guess, {9, 9, 9}));
        EXPECT_LT(point_cost(p, w, s.R, s.t), 1e-20);
        const Matrix3d nearest = nearest_by_brute_force(R, u, guess);
        EXPECT_LT(angle_between(s.R, guess), angle_between(nearest, guess) + 1e-9) << k;
        EXPECT_LT(angle_between(s.R, nearest), 1e-6) << k;  // the brute force is flat at its optimum
    }
}

TEST(OptimalTfHorn, OnePointKeepsTheRotationOfTheGuess)
{
    SeededRandom random(9);
    for (int k = 0; k < 500; k++)
    {
        const Vector3d a = random_point(random, 100), b = random_point(random, 100);
        const CPose3D guess = any_pose(random);
        Pairings p;
        add_pair(p, a, b);
        // w a / w is not always a, to the bit: that is no direction.
        p.point_weights = {{1, random.uniform(0.01, 10)}};
        const Solution s = solved(p, {}, guess);
        ASSERT_LT(angle_between(s.R, rotation_of(guess)), 1e-12) << k;
        ASSERT_LT((s.R * b + s.t - a).norm(), 1e-12 * 200) << k;
    }
}

TEST(OptimalTfHorn, EqualPointsKeepTheRotationOfTheGuess)
{
    SeededRandom random(10);
    for (const size_t n : {size_t(2), size_t(3), size_t(7), size_t(5000)})
        for (const double size : {1.0, 1e6})
        {
            const Vector3d a = random_point(random, size), b = random_point(random, size);
            const CPose3D guess = any_pose(random);
            Pairings p;
            std::vector<double> w(n);
            for (auto& x : w) add_pair(p, a, b), x = random.uniform(0.1, 1);
            p.point_weights = as_runs(w);
            const Solution s = solved(p, {}, guess);
            EXPECT_LT(angle_between(s.R, rotation_of(guess)), 1e-12) << n;
            EXPECT_LT((s.R * b + s.t - a).norm(), 1e-11 * size) << n;
        }
}

TEST(OptimalTfHorn, PointsThatAreEqualOnOneSideOnlyKeepTheRotationOfTheGuess)
{
    // Every rotation has the same cost.
    SeededRandom random(11);
    for (const bool equal_global : {true, false})
    {
        Pairings p;
        const Vector3d fixed(0.1, 0.2, 0.3);
        for (const auto& b : random_points(7, 5, 3))
        {
            if (equal_global)
                add_pair(p, fixed, b);
            else
                add_pair(p, b, fixed);
        }
        const CPose3D guess = any_pose(random);
        EXPECT_LT(angle_between(solved(p, {}, guess).R, rotation_of(guess)), 1e-9);
    }
}

TEST(OptimalTfHorn, SmallCloudsAreAsGoodAsLargeOnes)
{
    SeededRandom random(12);
    for (const double size : {1e-6, 1e-3, 1e3, 1e9})
    {
        const Matrix3d R = any_rotation(random);
        const Solution s = solved(moved_points(random_points(10, size, 5), R, random_point(random, size)), {},
                                  any_pose(random));
        EXPECT_LT(angle_between(s.R, R), 1e-12) << size;
    }
}

// ---- What cannot be solved --------------------------------------------------------------------------------

TEST(OptimalTfHorn, NothingToSolveWithLeavesTheResultUntouched)
{
    expect_refused_quietly(Pairings());
    Pairings zero = moved_points(random_points(5, 5, 1), Matrix3d::Identity(), {1, 2, 3});
    zero.point_weights = {{5, 0.0}};
    expect_refused_quietly(zero);
    WeightParameters no_weight;
    no_weight.pair_weights.pt2pt = 0;
    zero.point_weights.clear();
    expect_refused_quietly(zero, no_weight);
}

TEST(OptimalTfHorn, APairingThatIsNotFiniteIsSkippedAndCounted)
{
    const double inf = std::numeric_limits<double>::infinity();
    const Matrix3d R = rotation_about({1, -2, 3}, 2);
    WeightParameters kernel, scale;
    kernel.robust_kernel = RobustKernel::Cauchy, kernel.currentEstimateForRobust = make_pose(R, {1, 2, 3});
    scale.use_scale_outlier_detector = true;
    for (const auto& wp : {WeightParameters(), kernel, scale})
        for (const double bad : {NaN, inf, -inf, 1e200})
            for (int coordinate = 0; coordinate < 6; coordinate++)
            {
                const Pairings good = moved_points(random_points(5, 5, 1), R, {1, 2, 3}, 0.01);
                Pairings p;
                Vector3d a(1, 2, 3), b(4, 5, 6);
                (coordinate < 3 ? a(coordinate) : b(coordinate - 3)) = bad;
                add_pair(p, a, b);
                p.push_back(good);
                OptimalTF_Result with, without;
                ASSERT_TRUE(optimal_tf_horn(p, wp, with));
                ASSERT_TRUE(optimal_tf_horn(good, wp, without));
                expect_same_bits(with.optimalPose, without.optimalPose);
                EXPECT_EQ(with.skipped, 1u);
                EXPECT_EQ(without.skipped, 0u);
            }
}

TEST(OptimalTfHorn, APairOfWeightZeroHasNoInfluenceNotEvenWithNan)
{
    const auto local = random_points(5, 5, 1);
    const Matrix3d R = rotation_about({1, 2, 3}, 1);
    Pairings with = moved_points(local, R, {1, 2, 3});
    const Solution without = solved(with);
    add_pair(with, {NaN, 1, 2}, {3, 4, 5});
    with.point_weights = {{5, 1.0}, {1, 0.0}};
    const Solution s = solved(with);
    EXPECT_EQ(s.R, without.R);
    EXPECT_EQ(s.t, without.t);
}

TEST(OptimalTfHorn, BadWeightsAreTheCallersMistake)
{
    Pairings p = moved_points(random_points(5, 5, 1), Matrix3d::Identity(), {1, 2, 3});
    OptimalTF_Result r;
    for (const double bad : {-1e-9, 1e21, NaN, std::numeric_limits<double>::infinity()})
    {
        p.point_weights = {{2, 1.0}, {1, bad}};
        EXPECT_THROW(optimal_tf_horn(p, {}, r), std::invalid_argument) << bad;
    }
    p.point_weights.clear();
    WeightParameters wp;
    wp.pair_weights.pt2pt = -1;
    EXPECT_THROW(optimal_tf_horn(p, wp, r), std::invalid_argument);
    wp = {};
    wp.robust_kernel = RobustKernel::Cauchy, wp.robust_kernel_param = 0;
    EXPECT_THROW(optimal_tf_horn(p, wp, r), std::invalid_argument);
}

TEST(OptimalTfHorn, PrimitivesWithoutADirectionAreSkippedAndCounted)
{
    const Pairings points = moved_points(random_points(5, 5, 1), Matrix3d::Identity(), {1, 2, 3});
    OptimalTF_Result without;
    ASSERT_TRUE(optimal_tf_horn(points, {}, without));
    for (int kind = 0; kind < 4; kind++)
    {
        Pairings p = points;
        if (kind == 0) p.paired_pt2ln.emplace_back();
        if (kind == 1) p.paired_pt2pl.emplace_back();
        if (kind == 2) p.paired_ln2ln.emplace_back();
        if (kind == 3) p.paired_pl2pl.emplace_back();
        OptimalTF_Result r;
        ASSERT_TRUE(optimal_tf_horn(p, {}, r));
        EXPECT_EQ(r.skipped, 1u) << kind;
        expect_same_bits(r.optimalPose, without.optimalPose);
    }
}

// ---- The scale test ---------------------------------------------------------------------------------------

namespace
{
/// 40 pairs on a sphere of radius 10 whose outliers come in opposite pairs, so that the centroids do not
/// move.
Pairings sphere_with_outliers(double ratio, const std::vector<size_t>& outlier_pairs, const Matrix3d& R,
                              const Vector3d& t)
{
    SeededRandom random(5);
    Pairings p;
    for (size_t k = 0; k < 20; k++)
    {
        const Vector3d b = 10 * random_direction(random);
        const bool outlier = std::find(outlier_pairs.begin(), outlier_pairs.end(), k) != outlier_pairs.end();
        for (const double side : {1.0, -1.0})
            add_pair(p, R * (side * (outlier ? ratio : 1.0) * b) + t, side * b);
    }
    return p;
}
}  // namespace

TEST(ScaleTest, RejectsExactlyThePairsBeyondTheRatio)
{
    const Matrix3d R = rotation_about({1, 2, 3}, 2.5);
    const Vector3d t(3, 2, 1);
    WeightParameters wp;
    wp.use_scale_outlier_detector = true, wp.scale_outlier_threshold = 1.2;
    for (const double ratio : {1.21, 5.0, 1 / 1.21, 0.01})
    {
        OptimalTF_Result r;
        ASSERT_TRUE(optimal_tf_horn(sphere_with_outliers(ratio, {3, 7, 19}, R, t), wp, r));
        EXPECT_EQ(r.outliers.point2point, (std::vector<size_t>{6, 7, 14, 15, 38, 39})) << ratio;
        EXPECT_EQ(r.outliers.size(), 6u);
        EXPECT_LT(angle_between(rotation_of(r.optimalPose), R), 1e-12);
        EXPECT_LT((translation_of(r.optimalPose) - t).norm(), 1e-11);
    }
    for (const double ratio : {1.19, 1 / 1.19})
    {
        OptimalTF_Result r;
        ASSERT_TRUE(optimal_tf_horn(sphere_with_outliers(ratio, {3, 7, 19}, R, t), wp, r));
        EXPECT_TRUE(r.outliers.empty()) << ratio;
    }
}

TEST(ScaleTest, IsOffUnlessAskedFor)
{
    OptimalTF_Result r;
    r.outliers.point2point = {5};
    ASSERT_TRUE(optimal_tf_horn(sphere_with_outliers(5, {3}, Matrix3d::Identity(), {0, 0, 0}), {}, r));
    EXPECT_TRUE(r.outliers.empty());
}

TEST(ScaleTest, MeasuresFromTheWeightedCentroidAndSolvesWithTheRestOnly)
{
    // The expected set, by the formula, from centroids written out here.
    SeededRandom random(6);
    Pairings p = moved_points(random_points(60, 10, 6), rotation_about({0, 1, 1}, 1), {1, 2, 3}, 0.5);
    std::vector<double> w(60);
    for (auto& x : w) x = random.uniform(0, 2);
    p.point_weights = as_runs(w);
    Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();
    double sum = 0;
    for (size_t i = 0; i < 60; i++) sum += w[i], a += w[i] * global_of(p, i), b += w[i] * local_of(p, i);
    a /= sum, b /= sum;
    std::vector<size_t> expected;
    std::vector<double> rest = w;
    for (size_t i = 0; i < 60; i++)
    {
        const double da = (global_of(p, i) - a).norm(), db = (local_of(p, i) - b).norm();
        if (std::max(da, db) / std::min(da, db) >= 1.1) expected.push_back(i), rest[i] = 0;
    }
    ASSERT_GT(expected.size(), 3u);
    ASSERT_LT(expected.size(), 40u);
    WeightParameters wp;
    wp.use_scale_outlier_detector = true, wp.scale_outlier_threshold = 1.1;
    OptimalTF_Result r;
    ASSERT_TRUE(optimal_tf_horn(p, wp, r));
    EXPECT_EQ(r.outliers.point2point, expected);
    const Solution other = umeyama(p, rest);
    EXPECT_LT(angle_between(rotation_of(r.optimalPose), other.R), 1e-10);
    EXPECT_LT((translation_of(r.optimalPose) - other.t).norm(), 1e-9);
}

TEST(ScaleTest, RejectingAllLeavesNothingToSolveWith)
{
    Pairings p;
    for (const auto& b : random_points(10, 5, 1)) add_pair(p, 3 * b, b);
    WeightParameters wp;
    wp.use_scale_outlier_detector = true;
    expect_refused_quietly(p, wp);
}

// ---- Robust kernels ---------------------------------------------------------------------------------------

TEST(RobustWeights, AreThoseOfTheKernelAtTheEstimate)
{
    SeededRandom random(8);
    for (const auto kernel : {RobustKernel::GemanMcClure, RobustKernel::Cauchy})
        for (const bool estimate_by_guess : {true, false})
        {
            Pairings p =
                moved_points(random_points(30, 10, 9), rotation_about({1, 0, 1}, 0.3), {1, 2, 3}, 0.3);
            for (int k = 0; k < 8; k++) add_pair(p, random_point(random, 20), random_point(random, 20));
            p.point_weights = {{10, 2.0}};
            const CPose3D estimate = make_pose(rotation_about({1, 0, 1}, 0.31), {1, 2, 3.1});
            const double c = 0.5;
            std::vector<double> w = p.expanded_point_weights();
            for (size_t i = 0; i < w.size(); i++)
            {
                const double e2 =
                    (rotation_of(estimate) * local_of(p, i) + translation_of(estimate) - global_of(p, i))
                        .squaredNorm();
                const double factor = c * c / (e2 + c * c);
                w[i] *= 0.7 * (kernel == RobustKernel::Cauchy ? factor : factor * factor);
            }
            WeightParameters wp;
            wp.robust_kernel = kernel, wp.robust_kernel_param = c, wp.pair_weights.pt2pt = 0.7;
            if (!estimate_by_guess) wp.currentEstimateForRobust = estimate;
            const Solution s = solved(p, wp, estimate_by_guess ? estimate : CPose3D());
            const Solution other = umeyama(p, w);
            EXPECT_LT(angle_between(s.R, other.R), 1e-10);
            EXPECT_LT((s.t - other.t).norm(), 1e-9);
            // ... which differ from those without a kernel.
            EXPECT_GT(angle_between(solved(p).R, other.R), 1e-3);
        }
}

// ---- Threads ----------------------------------------------------------------------------------------------

TEST(OptimalTfHorn, HasTheSameBitsOnAnyNumberOfThreads)
{
    SeededRandom random(9);
    Pairings p = moved_points(random_points(100000, 50, 10), any_rotation(random), {1, 2, 3}, 0.3);
    std::vector<double> w(100000);
    for (auto& x : w) x = random.uniform(0, 3);
    p.point_weights = as_runs(w);
    WeightParameters wp;
    wp.robust_kernel = RobustKernel::Cauchy, wp.use_scale_outlier_detector = true;
    wp.currentEstimateForRobust = CPose3D();
    OptimalTF_Result one;
    with_threads(1, [&]() { ASSERT_TRUE(optimal_tf_horn(p, wp, one)); });
    for (const int threads : {2, 3, 8})
        with_threads(threads,
                     [&]()
                     {
                         OptimalTF_Result r;
                         ASSERT_TRUE(optimal_tf_horn(p, wp, r));
                         expect_same_bits(r.optimalPose, one.optimalPose);
                         EXPECT_EQ(r.outliers.point2point, one.outliers.point2point);
                     });
}
