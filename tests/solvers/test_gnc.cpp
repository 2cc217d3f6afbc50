#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/Solver_OLAE.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>
#include <mp2p_icp/synthetic/report_worlds.h>
#include <mp2p_icp/yaml_tools.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>

#include "pose_minimiser.h"
#include "random_pairings.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp::synthetic;
using namespace mp2p_icp_test;
using Indices = std::vector<size_t>;

namespace
{
constexpr double SIGMA = 1e-3, THRESHOLD = 5 * SIGMA;
const double NaN = std::numeric_limits<double>::quiet_NaN();

WeightParameters with(OutlierRejection loss, double threshold = THRESHOLD)
{
    WeightParameters wp;
    wp.outlier_rejection = loss, wp.outlier_threshold = threshold;
    return wp;
}

using ClosedForm = std::function<bool(const Pairings&, const WeightParameters&, OptimalTF_Result&,
                                      const std::optional<CPose3D>&)>;
bool horn(const Pairings& p, const WeightParameters& wp, OptimalTF_Result& r,
          const std::optional<CPose3D>& guess)
{
    return optimal_tf_horn(p, wp, r, guess);
}
bool olae(const Pairings& p, const WeightParameters& wp, OptimalTF_Result& r,
          const std::optional<CPose3D>& guess)
{
    return optimal_tf_olae(p, wp, r, guess);
}

/// Runs a check with both losses around both solvers.
void for_each_gnc(const std::function<void(const ClosedForm&, OutlierRejection)>& check)
{
    for (const OutlierRejection loss : {OutlierRejection::GncGemanMcClure, OutlierRejection::GncTruncated})
        for (const bool is_horn : {true, false})
        {
            SCOPED_TRACE(std::string(is_horn ? "Horn" : "OLAE") +
                         (loss == OutlierRejection::GncTruncated ? ", truncated" : ", Geman-McClure"));
            check(is_horn ? horn : olae, loss);
        }
}

OptimalTF_Result solved(const ClosedForm& solve, const Pairings& p, const WeightParameters& wp,
                        const std::optional<CPose3D>& guess = std::nullopt)
{
    OptimalTF_Result r;
    EXPECT_TRUE(solve(p, wp, r, guess));
    return r;
}
double distance(const CPose3D& a, const CPose3D& b)
{
    return (translation_of(a) - translation_of(b)).norm();
}
double angle(const CPose3D& a, const CPose3D& b)
{
    return angle_between(rotation_of(a), rotation_of(b));
}
double residual(const Pairings& p, size_t i, const CPose3D& pose)
{
    return (rotation_of(pose) * local_of(p, i) + translation_of(pose) - global_of(p, i)).norm();
}
/// The points farther than the threshold from where they should be.
Indices beyond(double threshold, const Pairings& p, const CPose3D& pose)
{
    Indices out;
    for (size_t i = 0; i < p.paired_pt2pt.size(); i++)
        if (residual(p, i, pose) > threshold) out.push_back(i);
    return out;
}
Indices first(size_t n)
{
    Indices out(n);
    std::iota(out.begin(), out.end(), size_t(0));
    return out;
}

const CPose3D TRUTH(3, -2, 1, 0.7, 0.4, -0.5);
Pairings noisy_points(size_t n, double noise, uint64_t seed)
{
    return moved_points(random_points(n, 25, seed), rotation_of(TRUTH), translation_of(TRUTH), noise, seed);
}
}  // namespace

TEST(Gnc, WithoutOutliersIsThePlainSolution)
{
    const Pairings p = noisy_points(100, SIGMA, 1);
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            // All residuals are far below it.
            const double threshold = 1;
            const CPose3D plain = solved(solve, p, {}).optimalPose;
            const OptimalTF_Result r = solved(solve, p, with(loss, threshold));
            EXPECT_TRUE(r.outliers.empty());
            EXPECT_EQ(r.status, SolveStatus::Determined);
            // The plain solution is not exact, so that this compares more than two truths.
            EXPECT_GT(distance(plain, TRUTH), 0.01 * SIGMA);
            // Geman-McClure's weights are 1 - 2 (r/c)^2, and so move the pose by some 2 (4 sigma)^2 of its
            // error. Rounding of coordinates of 50 m: 1e-14.
            const double tolerance =
                loss == OutlierRejection::GncTruncated ? 1e-13 : 100 * SIGMA * SIGMA * SIGMA;
            EXPECT_LT(distance(r.optimalPose, plain), tolerance);
            EXPECT_LT(angle(r.optimalPose, plain), tolerance);
        });
}

TEST(Gnc, WithAThresholdAboveEverythingIsThePlainSolutionEvenWithOutliers)
{
    Pairings p = noisy_points(50, SIGMA, 2);
    add_pair(p, {40, 0, 0}, {-30, 20, 10});
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            const double threshold = 1e6;
            const CPose3D plain = solved(solve, p, {}).optimalPose;
            const OptimalTF_Result r = solved(solve, p, with(loss, threshold));
            EXPECT_TRUE(r.outliers.empty());
            EXPECT_GT(distance(plain, TRUTH), 0.1);
            // Geman-McClure: 2 (100 m / 1e6 m)^2 = 2e-8 of the outlier's influence of some m.
            const double tolerance = loss == OutlierRejection::GncTruncated ? 1e-12 : 1e-7;
            EXPECT_LT(distance(r.optimalPose, plain), tolerance);
            EXPECT_LT(angle(r.optimalPose, plain), tolerance);
        });
}

TEST(Gnc, OfExactDataIsTheExactPose)
{
    const Pairings p = noisy_points(30, 0, 3);
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            const OptimalTF_Result r = solved(solve, p, with(loss));
            EXPECT_TRUE(r.outliers.empty());
            EXPECT_LT(distance(r.optimalPose, TRUTH), 1e-12);
            EXPECT_LT(angle(r.optimalPose, TRUTH), 1e-13);
        });
}

TEST(Gnc, OfResidualsThatAreZeroToTheBitIsTheIdentityThatFits)
{
    Pairings p;
    for (const Vector3d& b : {Vector3d(1, 0, 0), Vector3d(-1, 0, 0), Vector3d(0, 2, 0), Vector3d(0, -2, 0),
                              Vector3d(0, 0, 4), Vector3d(0, 0, -4)})
        add_pair(p, b + Vector3d(8, 16, 32), b);
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            const OptimalTF_Result r = solved(solve, p, with(loss));
            EXPECT_TRUE(r.outliers.empty());
            EXPECT_EQ(translation_of(r.optimalPose), Vector3d(8, 16, 32));
            EXPECT_EQ(rotation_of(r.optimalPose), Matrix3d(Matrix3d::Identity()));
            EXPECT_EQ(r.status, SolveStatus::Determined);
        });
}

TEST(Gnc, OfOnePairingFitsItAndKeepsTheRotationOfTheGuess)
{
    Pairings p;
    add_pair(p, {10, 20, 30}, {1, 2, 3});
    const CPose3D guess(1, 2, 3, 0.5, 0.2, -0.1);
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            const OptimalTF_Result r = solved(solve, p, with(loss), guess);
            EXPECT_TRUE(r.outliers.empty());
            EXPECT_EQ(r.status, SolveStatus::UnderConstrained);
            EXPECT_EQ(r.rank, 3);
            EXPECT_LT(angle(r.optimalPose, guess), 1e-14);
            EXPECT_LT(residual(p, 0, r.optimalPose), 1e-13);
        });
}

TEST(Gnc, OfNothingFailsAndLeavesThePose)
{
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            OptimalTF_Result r;
            r.optimalPose = TRUTH, r.outliers.point2point = {3};
            EXPECT_FALSE(solve({}, with(loss), r, std::nullopt));
            EXPECT_EQ(r.status, SolveStatus::NoPairings);
            EXPECT_TRUE(r.outliers.empty());
            expect_same_bits(r.optimalPose, TRUTH);
        });
}

namespace
{
/** Whatever is found in pairings of which no few fit each other: a success lists what does not fit its pose,
 * and a failure leaves the pose, as the headers of the solvers say.
 */
void expect_sound_answer(const Pairings& p, const ClosedForm& solve, OutlierRejection loss)
{
    OptimalTF_Result r;
    r.optimalPose = TRUTH;
    if (solve(p, with(loss), r, std::nullopt))
    {
        EXPECT_NE(r.status, SolveStatus::NoPairings);
        EXPECT_EQ(r.outliers.point2point, beyond(THRESHOLD, p, r.optimalPose));
        EXPECT_GE(r.outliers.size() + 4, p.size()) << "chance makes a few agree, not more";
    }
    else
    {
        EXPECT_EQ(r.status, SolveStatus::NoPairings);
        EXPECT_EQ(r.rank, 0);
        EXPECT_EQ(r.outliers.point2point, first(p.size()));
        expect_same_bits(r.optimalPose, TRUTH);
    }
}
}  // namespace

TEST(Gnc, OfOutliersOnlySaysWhichDoNotFitOrFails)
{
    for (uint64_t seed = 1; seed <= 20; seed++)
    {
        SeededRandom random(seed);
        Pairings p;
        for (int i = 0; i < 50; i++)
        {
            const Vector3d global = random_point(random, 25);
            add_pair(p, global, random_point(random, 25));
        }
        for_each_gnc(
            [&](const ClosedForm& solve, OutlierRejection loss)
            {
                SCOPED_TRACE("seed " + std::to_string(seed));
                expect_sound_answer(p, solve, loss);
            });
    }
}

TEST(Gnc, OfTwoPairingsThatContradictEachOtherSaysSoOrFails)
{
    // Any pose is wrong by as much for the one as for the other.
    Pairings p;
    add_pair(p, {1, 0, 0}, {3, 0, 0});
    add_pair(p, {-1, 0, 0}, {-3, 0, 0});
    for_each_gnc([&](const ClosedForm& solve, OutlierRejection loss)
                 { expect_sound_answer(p, solve, loss); });
}

namespace
{
/// 20 right ones of each kind, of which some are wrong (the indices in `planted`), in this order.
Pairings all_kinds_with_outliers(OutlierIndices& planted)
{
    SeededRandom random(5);
    const Matrix3d R = rotation_of(TRUTH);
    Pairings p = random_pairings({20, 20, 20, 20, 20}, R, translation_of(TRUTH), random, SIGMA);
    planted = {{2, 11}, {0, 7}, {5, 19}, {3, 4}, {8}};
    for (const size_t i : planted.point2point) p.paired_pt2pt[i].global.x += 2;
    const auto moved_across = [&](mrpt::math::TLine3D& l)
    {
        const Vector3d u = to_eigen(l.director);
        l.pBase = to_mrpt(to_eigen(l.pBase) + 2 * u.cross(random_direction(random)).normalized());
    };
    for (const size_t i : planted.point2line) moved_across(p.paired_pt2ln[i].ln_global);
    for (const size_t i : planted.line2line) moved_across(p.paired_ln2ln[i].ln_global);
    const auto moved_along_normal = [](plane_patch_t& f)
    {
        const Vector3d n(f.plane.coefs[0], f.plane.coefs[1], f.plane.coefs[2]);
        f = patch(to_eigen(f.centroid) + 2 * n, n);
    };
    for (const size_t i : planted.point2plane) moved_along_normal(p.paired_pt2pl[i].pl_global);
    for (const size_t i : planted.plane2plane) moved_along_normal(p.paired_pl2pl[i].p_global);
    return p;
}

template <class List>
void insert_at(List& list, size_t index, const typename List::value_type& value)
{
    list.insert(list.begin() + static_cast<std::ptrdiff_t>(index), value);
}
/// One pairing with NaN at index 1 of each list; then the indices after it are one higher.
void insert_nan(Pairings& p, OutlierIndices& planted)
{
    auto pt2pt = p.paired_pt2pt[1];
    pt2pt.local.y = NaN;
    insert_at(p.paired_pt2pt, 1, pt2pt);
    auto pt2ln = p.paired_pt2ln[1];
    pt2ln.pt_local.x = NaN;
    insert_at(p.paired_pt2ln, 1, pt2ln);
    auto pt2pl = p.paired_pt2pl[1];
    pt2pl.pl_global.centroid.z = NaN;
    insert_at(p.paired_pt2pl, 1, pt2pl);
    auto ln2ln = p.paired_ln2ln[1];
    ln2ln.ln_local.director = {0, 0, 0};
    insert_at(p.paired_ln2ln, 1, ln2ln);
    auto pl2pl = p.paired_pl2pl[1];
    pl2pl.p_local.plane.coefs[2] = NaN;
    insert_at(p.paired_pl2pl, 1, pl2pl);
    for (auto* list : {&planted.point2point, &planted.point2line, &planted.point2plane, &planted.line2line,
                       &planted.plane2plane})
        for (size_t& i : *list) i += i >= 1;
}
void expect_equal(const OutlierIndices& found, const OutlierIndices& expected)
{
    EXPECT_EQ(found.point2point, expected.point2point);
    EXPECT_EQ(found.point2line, expected.point2line);
    EXPECT_EQ(found.point2plane, expected.point2plane);
    EXPECT_EQ(found.line2line, expected.line2line);
    EXPECT_EQ(found.plane2plane, expected.plane2plane);
}
}  // namespace

TEST(Gnc, CountsItsOutliersInTheOriginalListsAlsoBehindPairingsThatAreNotFinite)
{
    OutlierIndices planted;
    Pairings p = all_kinds_with_outliers(planted);
    insert_nan(p, planted);
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            const OptimalTF_Result r = solved(solve, p, with(loss, 10 * SIGMA));
            EXPECT_EQ(r.skipped, 5u);
            expect_equal(r.outliers, planted);  // what is not finite is skipped, not an outlier
            EXPECT_LT(distance(r.optimalPose, TRUTH), 5 * SIGMA);
        });
}

TEST(Gnc, LeavesOutThePairingsThatItLists)
{
    OutlierIndices planted;
    const Pairings p = all_kinds_with_outliers(planted);
    Pairings inliers;
    const auto keep = [](const auto& from, const Indices& without, auto& to)
    {
        for (size_t i = 0; i < from.size(); i++)
            if (std::find(without.begin(), without.end(), i) == without.end()) to.push_back(from[i]);
    };
    keep(p.paired_pt2pt, planted.point2point, inliers.paired_pt2pt);
    keep(p.paired_pt2ln, planted.point2line, inliers.paired_pt2ln);
    keep(p.paired_pt2pl, planted.point2plane, inliers.paired_pt2pl);
    keep(p.paired_ln2ln, planted.line2line, inliers.paired_ln2ln);
    keep(p.paired_pl2pl, planted.plane2plane, inliers.paired_pl2pl);
    for (const ClosedForm& solve : {ClosedForm(horn), ClosedForm(olae)})
    {
        const OptimalTF_Result r = solved(solve, p, with(OutlierRejection::GncTruncated, 10 * SIGMA));
        expect_equal(r.outliers, planted);
        // The closed forms project points on lines and planes at the guess: at the result, they stay there.
        const CPose3D again = solved(solve, inliers, {}, r.optimalPose).optimalPose;
        EXPECT_LT(distance(again, r.optimalPose), 0.1 * SIGMA);
        EXPECT_LT(angle(again, r.optimalPose), 0.1 * SIGMA);
    }
}

TEST(Gnc, AfterTheScaleTestListsTheOutliersOfBothOnceAndInOrder)
{
    SeededRandom random(7);
    ReportWorld world = report_world(200, 0, {SIGMA, 0}, random);
    add_outliers(world, 0.3, random, 4 * THRESHOLD);
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            WeightParameters wp = with(loss);
            wp.use_scale_outlier_detector = true, wp.scale_outlier_threshold = 1.2;
            const OptimalTF_Result r = solved(solve, world.pairings, wp);
            // The scale test misses some of the outliers, and throws away right pairings near the centroid.
            const Indices &found = r.outliers.point2point, &planted = world.outliers;
            EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
            EXPECT_EQ(std::set<size_t>(found.begin(), found.end()).size(), found.size());
            for (const size_t i : planted) EXPECT_EQ(std::count(found.begin(), found.end(), i), 1) << i;
            EXPECT_LT(error_of(r.optimalPose, world).translation, SIGMA);
        });
}

TEST(Gnc, AnInfiniteThresholdIsRefusedOrKeepsEverything)
{
    const Pairings p = noisy_points(20, SIGMA, 8);
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            for (const double threshold : {std::numeric_limits<double>::infinity(), 1e200})
            {
                SCOPED_TRACE(std::isinf(threshold) ? "infinite" : "its square is");
                OptimalTF_Result r;
                try
                {
                    EXPECT_TRUE(solve(p, with(loss, threshold), r, std::nullopt));
                    EXPECT_TRUE(r.outliers.empty());
                    EXPECT_LT(distance(r.optimalPose, TRUTH), SIGMA);
                }
                catch (const std::invalid_argument&)
                {
                }
            }
        });
}

TEST(Gnc, APriorDoesNotBringTheOutliersBack)
{
    OutlierIndices planted;
    const Pairings p = all_kinds_with_outliers(planted);
    SolverContext context;
    context.guessRelativePose = TRUTH;
    context.prior = prior_of(TRUTH, Matrix6::Identity());  // 1 m, 1 rad: says nothing beside 1 mm
    for (const OutlierRejection loss : {OutlierRejection::GncGemanMcClure, OutlierRejection::GncTruncated})
    {
        Solver_Horn solver_horn;
        Solver_OLAE solver_olae;
        solver_horn.pairingsWeightParameters = solver_olae.pairingsWeightParameters = with(loss, 10 * SIGMA);
        for (const Solver* solver : {static_cast<Solver*>(&solver_horn), static_cast<Solver*>(&solver_olae)})
        {
            OptimalTF_Result r;
            ASSERT_TRUE(solver->optimal_pose(p, r, context));
            expect_equal(r.outliers, planted);
            EXPECT_LT(distance(r.optimalPose, TRUTH), SIGMA);
            EXPECT_LT(angle(r.optimalPose, TRUTH), SIGMA);
        }
    }
}

TEST(Gnc, HasTheSameBitsOnAnyNumberOfThreads)
{
    SeededRandom random(6);
    Pairings p =
        random_pairings({1200, 400, 400, 300, 300}, rotation_of(TRUTH), translation_of(TRUTH), random, SIGMA);
    for (size_t i = 0; i < p.paired_pt2pt.size(); i += 3) p.paired_pt2pt[i].global.y += 3;
    for_each_gnc(
        [&](const ClosedForm& solve, OutlierRejection loss)
        {
            OptimalTF_Result one;
            with_threads(1, [&]() { one = solved(solve, p, with(loss, 10 * SIGMA)); });
            EXPECT_EQ(one.outliers.size(), 400u);
            for (const int threads : {2, 8})
                with_threads(threads,
                             [&]()
                             {
                                 const auto r = solved(solve, p, with(loss, 10 * SIGMA));
                                 expect_same_bits(r.optimalPose, one.optimalPose);
                                 expect_equal(r.outliers, one.outliers);
                             });
        });
}

// ---- Robust kernels in a pipeline -------------------------------------------------------------------------

namespace
{
/// 100 points, 20 % of them wrong, and what a run of ICP knows: a guess near the truth.
struct IcpRun
{
    Pairings pairings;
    SolverContext context;
};
IcpRun run_with_outliers(uint64_t seed)
{
    SeededRandom random(seed);
    IcpRun run{noisy_points(100, SIGMA, seed), {}};
    for (const size_t i : random_subset(100, 20, random()))
        run.pairings.paired_pt2pt[i].global = to_mrpt(random_point(random, 25));
    // As far as the kernel's scale reaches: some 0.1 m at the points.
    run.context.guessRelativePose =
        make_pose(rotation_about(random_direction(random), 0.002) * rotation_of(TRUTH),
                  translation_of(TRUTH) + 0.05 * random_direction(random));
    return run;
}

template <class SomeSolver>
SomeSolver from_yaml(const std::string& text)
{
    SomeSolver solver;
    solver.initialize(yaml_from_text(text));
    return solver;
}
const std::string ROBUST =
    "{pairingsWeightParameters: {robust_kernel: RobustKernel::GemanMcClure, robust_kernel_param: 0.1}}";

CPose3D one_step(const Solver& solver, IcpRun run)
{
    OptimalTF_Result r;
    EXPECT_TRUE(solver.optimal_pose(run.pairings, r, run.context));
    return r.optimalPose;
}
/// As an ICP run on pairings that stay: each step at the pose of the one before.
CPose3D iterated(const Solver& solver, IcpRun run, int steps)
{
    for (int k = 0; k < steps; k++) run.context.guessRelativePose = one_step(solver, run);
    return *run.context.guessRelativePose;
}

template <class SomeSolver>
void expect_kernel_helps()
{
    const auto plain = from_yaml<SomeSolver>("{}"), robust = from_yaml<SomeSolver>(ROBUST);
    for (uint64_t seed = 1; seed <= 10; seed++)
    {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const IcpRun run = run_with_outliers(seed);
        const CPose3D with_kernel = one_step(robust, run), without = one_step(plain, run);
        EXPECT_LT(distance(with_kernel, TRUTH), 0.01 * distance(without, TRUTH));
        EXPECT_LT(angle(with_kernel, TRUTH), 0.01 * angle(without, TRUTH));
        const CPose3D end = iterated(robust, run, 5);
        EXPECT_LT(distance(end, TRUTH), SIGMA);
        EXPECT_LT(angle(end, TRUTH), SIGMA / 25);
    }
}
}  // namespace

TEST(RobustKernelInPipelines, SolverHornMeasuresItAtTheRunsGuess)
{
    expect_kernel_helps<Solver_Horn>();
}

TEST(RobustKernelInPipelines, SolverOlaeMeasuresItAtTheRunsGuess)
{
    expect_kernel_helps<Solver_OLAE>();
}

TEST(RobustKernelInPipelines, NothingOfAnEarlierGuessIsRemembered)
{
    const auto solver_horn = from_yaml<Solver_Horn>(ROBUST);
    const auto solver_olae = from_yaml<Solver_OLAE>(ROBUST);
    IcpRun run = run_with_outliers(1);
    for (const CPose3D& guess : {*run.context.guessRelativePose, CPose3D(5, 5, 5, 1, 1, 1), TRUTH})
    {
        run.context.guessRelativePose = guess;
        WeightParameters wp = solver_horn.pairingsWeightParameters;
        wp.currentEstimateForRobust = guess;
        expect_same_bits(one_step(solver_horn, run), solved(horn, run.pairings, wp, guess).optimalPose);
        expect_same_bits(one_step(solver_olae, run), solved(olae, run.pairings, wp, guess).optimalPose);
    }
    EXPECT_FALSE(solver_horn.pairingsWeightParameters.currentEstimateForRobust);
    EXPECT_FALSE(solver_olae.pairingsWeightParameters.currentEstimateForRobust);
}
