#include <mp2p_icp/optimal_tf_certified.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>

#include <functional>
#include <map>

#include "exact_mixes.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
/// All without a guess.
struct NamedSolver
{
    std::string name;
    std::function<bool(const Pairings&, const PairWeights&, OptimalTF_Result&)> solve;
    double promise;  ///< rad, for well-conditioned sets
};

NamedSolver olae(const std::string& name, OlaeSystem system, bool normalize_points)
{
    return {"olae_" + name + (normalize_points ? "_unit" : "_length"),
            [=](const Pairings& p, const PairWeights& weights, OptimalTF_Result& result)
            {
                WeightParameters wp;
                wp.pair_weights = weights;
                return optimal_tf_olae(p, wp, result, std::nullopt, {system, normalize_points});
            },
            1e-12};
}

bool solve_horn(const Pairings& p, const PairWeights& weights, OptimalTF_Result& result)
{
    WeightParameters wp;
    wp.pair_weights = weights;
    return optimal_tf_horn(p, wp, result);
}
bool solve_gauss_newton(const Pairings& p, const PairWeights& weights, OptimalTF_Result& result)
{
    OptimalTF_GN_Parameters parameters;
    parameters.pairWeights = weights;
    return optimal_tf_gauss_newton(p, result, parameters);
}

bool solve_certified(const Pairings& p, const PairWeights& weights, OptimalTF_Result& result)
{
    CertifiedParameters parameters;
    parameters.weights.pair_weights = weights;
    CertifiedResult certified;
    const bool solved = optimal_tf_certified(p, certified, parameters);
    result = certified;
    return solved;
}

/** Each takes every mix. Closed forms see in a mix:
 *
 *      mixes                            rotation from                        translation from
 *      pp                               points                               their centroids
 *      nn nf ll, pp_nn pp_ll ll_nf      points and directions, where they    all position rows
 *      pl_ll_nf pn_nf all all_free      determine it; else as below
 *      pl pn pl_pn, pp_pn of 2 points   the search over rotations on sums, then Gauss-Newton steps on all
 * rows
 *
 * None is inexact without noise, but see ClosedFormsAreAsExactAsTheirVectorsAllow.
 */
const std::vector<NamedSolver>& solvers()
{
    static const std::vector<NamedSolver> all = {{"horn", solve_horn, 1e-12},
                                                 olae("report", OlaeSystem::Report, true),
                                                 olae("report", OlaeSystem::Report, false),
                                                 olae("least_squares", OlaeSystem::LeastSquares, true),
                                                 olae("least_squares", OlaeSystem::LeastSquares, false),
                                                 olae("newton", OlaeSystem::Newton, true),
                                                 olae("newton", OlaeSystem::Newton, false),
                                                 {"gauss_newton", solve_gauss_newton, 1e-9},
                                                 {"certified", solve_certified, 1e-9}};
    return all;
}

PairWeights weights_for(const ExactMix& mix)
{
    PairWeights w;
    w.pl2pl_sign = mix.normals;
    return w;
}

struct Problem
{
    ExactSet set;
    bool several_poses = false;
    double ratio = 0;  ///< of the information's eigenvalues
};

/// Another one for each mix and k.
SeededRandom random_of(const ExactMix& mix, size_t k)
{
    uint64_t seed = 0;
    for (const char c : std::string(mix.name)) seed = 31 * seed + static_cast<uint64_t>(c);
    return SeededRandom((seed << 32) + k);
}

enum class Size : uint8_t
{
    Minimal,
    OneMore,
    Ten,
    Hundred
};
Mix counts_of(const ExactMix& mix, Size size, SeededRandom& random)
{
    const auto any = [&](const std::vector<Mix>& counts) { return counts[random.index(counts.size())]; };
    if (size == Size::Minimal) return any(mix.minimal);
    if (size == Size::OneMore) return any(mix.one_more);
    return size == Size::Ten ? mix.ten : mix.hundred;
}

Problem problem_of(const ExactMix& mix, Size size, Place place, SeededRandom& random)
{
    const Mix counts = counts_of(mix, size, random);
    Problem out;
    out.set = exact_set(counts, mix.normals, rotation_of_kind(random.index(6), random), place, random);
    out.several_poses = size == Size::Minimal && mix.several_poses;
    out.ratio = information_ratio(out.set.pairings, mix.normals, out.set.R, out.set.t);
    return out;
}
/// Half of them in a room; sizes in turn.
Problem any_problem(const ExactMix& mix, size_t k, SeededRandom& random)
{
    constexpr Place places[] = {Place::Room, Place::Room, Place::Thing, Place::FarThing};
    return problem_of(mix, static_cast<Size>(k % 4), places[random.index(4)], random);
}
/// Of ten or a hundred pairings.
Problem large_problem(const ExactMix& mix, size_t k, SeededRandom& random)
{
    return problem_of(mix, k % 2 ? Size::Ten : Size::Hundred, Place::Room, random);
}

struct Solution
{
    Matrix3d R = Matrix3d::Zero();
    Vector3d t = Vector3d::Zero();
};
Solution solved(const NamedSolver& solver, const ExactMix& mix, const Pairings& p)
{
    OptimalTF_Result result;
    EXPECT_TRUE(solver.solve(p, weights_for(mix), result));
    EXPECT_EQ(to_string(result.status), to_string(SolveStatus::Determined));
    EXPECT_EQ(result.rank, 6);
    EXPECT_TRUE(result.free.empty());
    EXPECT_TRUE(result.outliers.empty());
    EXPECT_EQ(result.skipped, 0U);
    const Solution s{rotation_of(result.optimalPose), translation_of(result.optimalPose)};
    EXPECT_LT((s.R.transpose() * s.R - Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_GT(s.R.determinant(), 0);
    return s;
}

/// The largest error of the rotation, rad: the solver's promise, less where the data say less, and what the
/// coordinates lose to rounding.
double allowed_error(const Problem& p, double promise)
{
    return promise * std::max(1.0, std::sqrt(1e-4 / p.ratio)) +
           4 * p.set.coarse / (spread_of(p.set.pairings).L * std::sqrt(p.ratio));
}

/// How far from the data a pose puts the set, m, or the set's size if that is more.
double reach(const Pairings& p, const Solution& s)
{
    const Spread local = spread_of(p);
    return std::max(local.L, (s.R * local.centre + s.t - global_centre(p)).norm());
}

/** The root of the mean square of all residuals over the allowed one: 1e-12 of the size of the set, or of the
 * way to where the pose puts it (the half turn of a line and a nearly parallel plane is far away). 1e-12
 * being the promise.
 */
double relative_residual(const ExactMix& mix, const ExactSet& set, const Solution& s, double promise)
{
    const double allowed = promise * reach(set.pairings, s) + 4 * set.coarse;
    return root_mean_square(set.pairings, mix.normals, s.R, s.t) / allowed;
}

/// The error of rotation and translation over the allowed one.
double relative_error(const Problem& p, const Solution& s, double promise)
{
    const double allowed = allowed_error(p, promise);
    return std::max(angle_between(s.R, p.set.R) / allowed,
                    (s.t - p.set.t).norm() / (allowed * largest_distance(p.set.pairings)));
}

/// Between where two poses put the centre of the local positions.
double centre_error(const Pairings& p, const Solution& s, const Matrix3d& R, const Vector3d& t)
{
    const Vector3d centre = spread_of(p).centre;
    return ((s.R - R) * centre + (s.t - t)).norm();
}

class ExactData : public testing::TestWithParam<ExactMix>
{
};
std::string mix_name(const testing::TestParamInfo<ExactMix>& info)
{
    return info.param.name;
}
INSTANTIATE_TEST_SUITE_P(Mixes, ExactData, testing::ValuesIn(exact_mixes()), mix_name);
}  // namespace

TEST_P(ExactData, GiveAnExactPoseWithEverySolver)
{
    const ExactMix& mix = GetParam();
    const size_t count = repetitions(2000, 100000);
    size_t skipped = 0;
    std::map<std::string, double> worst;
    for (size_t k = 0; k < count; k++)
    {
        SeededRandom random = random_of(mix, k);
        const Problem p = any_problem(mix, k, random);
        const NamedSolver& solver = solvers()[k / 4 % solvers().size()];
        if (!(p.ratio > 1e-9))
        {
            skipped++;
            continue;
        }
        SCOPED_TRACE(testing::Message() << solver.name << ", k " << k << ", ratio " << p.ratio);
        const Solution s = solved(solver, mix, p.set.pairings);
        const double error = p.several_poses ? relative_residual(mix, p.set, s, solver.promise)
                                             : relative_error(p, s, solver.promise);
        EXPECT_LE(error, 1) << angle_between(s.R, p.set.R) << " rad, " << (s.t - p.set.t).norm() << " m";
        double& of_solver = worst[solver.name];
        if (!(error <= of_solver)) of_solver = error;
    }
    EXPECT_LT(100 * skipped, count);
    for (const auto& [name, error] : worst) RecordProperty("worst_" + name, std::to_string(error));
    RecordProperty("skipped", std::to_string(skipped));
}

TEST_P(ExactData, LoseNoMoreThanTheirCoordinatesTenThousandKilometresAway)
{
    const ExactMix& mix = GetParam();
    const Vector3d far(1e7, 1e7, 1e7);
    double worst = 0, worst_centre = 0;
    for (size_t k = 0; k < repetitions(16, 8000); k++)
    {
        SeededRandom random = random_of(mix, k);
        Problem p = large_problem(mix, k, random);
        const NamedSolver& solver = solvers()[k / 2 % solvers().size()];
        SCOPED_TRACE(testing::Message() << solver.name << ", k " << k << ", ratio " << p.ratio);
        shift(p.set, far, far);
        const Solution s = solved(solver, mix, p.set.pairings);
        // Rounding of coordinates is an error of the data: it grows where they say less.
        const double allowed = 10 * spacing_at(1e7) / spread_of(p.set.pairings).L,
                     less = std::max(1.0, std::sqrt(1e-3 / p.ratio));
        const double error = angle_between(s.R, p.set.R) / (allowed * less);
        const double off = centre_error(p.set.pairings, s, p.set.R, p.set.t);
        EXPECT_LE(error, 1);
        EXPECT_LE(off, 1e-7 * less);
        if (!(error <= worst)) worst = error;
        if (!(off <= worst_centre)) worst_centre = off;
    }
    RecordProperty("far_worst", std::to_string(worst));
    RecordProperty("far_worst_centre_nm", std::to_string(worst_centre * 1e9));
}

TEST_P(ExactData, OnAGridGiveTheSameRotationHereAndTenThousandKilometresAway)
{
    const ExactMix& mix = GetParam();
    const Vector3d far(1e7, 1e7, 1e7);
    double worst = 0, worst_centre = 0;
    for (size_t k = 0; k < repetitions(16, 8000); k++)
    {
        SeededRandom random = random_of(mix, k);
        Problem p = large_problem(mix, k, random);
        const NamedSolver& solver = solvers()[k / 2 % solvers().size()];
        SCOPED_TRACE(testing::Message() << solver.name << ", k " << k << ", ratio " << p.ratio);
        round_to_grid(p.set.pairings);
        ExactSet moved = p.set;
        shift(moved, far, far);
        const Solution here = solved(solver, mix, p.set.pairings),
                       there = solved(solver, mix, moved.pairings);
        // The grid is a noise of 0.3 mm per coordinate, so that neither is exact; but both are solutions.
        const double noise = std::ldexp(1, -10) / spread_of(p.set.pairings).L;
        EXPECT_LT(angle_between(here.R, p.set.R), 10 * noise * std::max(1.0, std::sqrt(1e-2 / p.ratio)));
        const double turn = angle_between(here.R, there.R),
                     off = centre_error(moved.pairings, there, here.R, here.t + far - here.R * far);
        EXPECT_LE(turn, 1e-13);
        EXPECT_LE(off, 10 * spacing_at(1e7));
        if (!(turn <= worst)) worst = turn;
        if (!(off <= worst_centre)) worst_centre = off;
    }
    RecordProperty("grid_worst_1e-15", std::to_string(worst * 1e15));
    RecordProperty("grid_worst_centre_nm", std::to_string(worst_centre * 1e9));
}

namespace
{
/** Two points on the z axis, and two points on planes. The first plane is met at two angles about the axis,
 * `exact` and `other`; the second at `exact`, and missed at `other` by `miss` m.
 */
Pairings almost_ambiguous(double exact, double other, double miss)
{
    const Vector3d z = Vector3d::UnitZ(), first(5, 0, 3), second(4, 1, -6);
    const auto at = [&z](double angle, const Vector3d& p) -> Vector3d
    { return rotation_about(z, angle) * p; };
    Pairings p;
    add_pair(p, {0, 0, 0}, {0, 0, 0}), add_pair(p, {0, 0, 10}, {0, 0, 10});
    const auto plane = [&](const Vector3d& local, double distance)
    {
        const Vector3d chord = at(other, local) - at(exact, local);
        const Vector3d across = chord.cross(z + 0.3 * Vector3d::UnitX()).normalized();
        const Vector3d normal = (across + distance / chord.squaredNorm() * chord).normalized();
        p.paired_pt2pl.push_back({patch(at(exact, local), normal), to_mrpt(local)});
    };
    plane(first, 0), plane(second, miss);
    return p;
}
}  // namespace

TEST(Exactness, APoseThatAlmostFitsIsNotTakenForTheOneThatFits)
{
    // The pose that almost fits is nearer to the identity, where searches without a guess begin.
    for (const double miss : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6})
        for (const auto& solver : solvers())
        {
            SCOPED_TRACE(testing::Message() << solver.name << ", missed by " << miss << " m");
            const Solution s = solved(solver, {}, almost_ambiguous(2.5, 0.5, miss));
            EXPECT_LT(angle_between(s.R, rotation_about(Vector3d::UnitZ(), 2.5)), 1e-11);
            EXPECT_LT(s.t.norm(), 1e-10);
        }
}

namespace
{
/// Points about a line of 50 m through the local origin, the spread being the ratio of the two sizes.
void add_points_near_a_line(double spread, size_t count, ExactSet& set, SeededRandom& random)
{
    const Vector3d axis = random_direction(random);
    for (size_t i = 0; i < count; i++)
    {
        const Vector3d along = random.uniform(-25, 25) * axis, b = along + spread * random_point(random, 25);
        add_pair(set.pairings, set.R * b + set.t, b);
    }
}
}  // namespace

TEST(Exactness, PointsNearALineGiveWhatTheirSpreadAllows)
{
    for (const double spread : {1e-1, 3e-2, 2e-2, 1.5e-2, 1e-2, 5e-3, 1e-3, 1e-4})
        for (uint64_t seed = 0; seed < 200; seed++)
        {
            SeededRandom random(seed);
            Problem p;
            p.set.R = any_rotation(random), p.set.t = random_point(random, 40);
            add_points_near_a_line(spread, 5, p.set, random);
            p.ratio = information_ratio(p.set.pairings, DirectionSign::Oriented, p.set.R, p.set.t);
            for (const auto& solver : solvers())
            {
                SCOPED_TRACE(testing::Message() << solver.name << ", seed " << seed << ", spread " << spread);
                EXPECT_LE(relative_error(p, solved(solver, {}, p.set.pairings), solver.promise), 1)
                    << p.ratio;
            }
        }
}

// Closed forms take the rotation from vectors alone where those determine it, although points on planes would
// give it better: that is how they are defined. What it costs is bounded by the vectors' spread, and
// Gauss-Newton does not pay it. Below a spread of 3 % all rows are used.
TEST(Exactness, ClosedFormsAreAsExactAsTheirVectorsAllowUnlessThoseAreNearlyParallel)
{
    SeededRandom random(2);
    for (const double spread : {1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7})
        for (int k = 0; k < 5; k++)
        {
            Problem p;
            p.set.R = any_rotation(random), p.set.t = random_point(random, 40);
            p.set.pairings = random_pairings({0, 0, 6, 0, 0}, p.set.R, p.set.t, random, 0, 25);
            add_points_near_a_line(spread, 5, p.set, random);
            p.ratio = information_ratio(p.set.pairings, DirectionSign::Oriented, p.set.R, p.set.t);
            ASSERT_GT(p.ratio, 1e-4);
            for (const auto& solver : solvers())
            {
                SCOPED_TRACE(testing::Message() << solver.name << ", k " << k << ", spread " << spread);
                const bool closed_form = solver.name != "gauss_newton";
                const double less = closed_form && spread > 0.03 ? std::max(1.0, 0.1 / spread) : 1.0;
                EXPECT_LE(relative_error(p, solved(solver, {}, p.set.pairings), 1e-12 * less), 1);
            }
        }
}

TEST(Exactness, TheRowsOfTheseTestsHaveTheRightDerivatives)
{
    SeededRandom random(1);
    for (const auto sign : {DirectionSign::Free, DirectionSign::Oriented})
    {
        const ExactSet set = exact_set({1, 1, 1, 1, 1}, sign, any_rotation(random), Place::Room, random);
        // Not at the solution, where rows of wrong values would be zero too.
        const Matrix3d R = rotation_about(random_direction(random), 0.1) * set.R;
        const Vector3d t = set.t + random_direction(random);
        const RowMaker made(set.pairings, sign, R, t);
        const Vector3d pivot = R * made.spread().centre + t;
        for (int i = 0; i < 6; i++)
        {
            const auto moved = [&](double step)
            {
                Eigen::Matrix<double, 6, 1> x = step * Eigen::Matrix<double, 6, 1>::Unit(i);
                const Vector3d omega = x.tail<3>() / made.spread().L;
                const Matrix3d turn =
                    omega.norm() > 0 ? rotation_about(omega, omega.norm()) : Matrix3d::Identity();
                return RowMaker(set.pairings, sign, turn * R, turn * (t - pivot) + pivot + x.head<3>())
                    .rows();
            };
            const auto plus = moved(1e-3), minus = moved(-1e-3);
            ASSERT_EQ(plus.size(), 7U);
            for (size_t k = 0; k < plus.size(); k++)
                EXPECT_LT(((plus[k].r - minus[k].r) / 2e-3 - made.rows()[k].J.col(i)).norm(), 1e-8)
                    << i << " " << k;
        }
    }
}
