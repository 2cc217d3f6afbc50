#include <mp2p_icp/optimal_tf_certified.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>

#include <cstdio>
#include <functional>
#include <map>

#include "certified_test_tools.h"
#include "degenerate_sets.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
const Vector3d X = Vector3d::UnitX(), Y = Vector3d::UnitY(), Z = Vector3d::UnitZ();

CertifiedResult solved(const Pairings& in, const CertifiedParameters& p)
{
    CertifiedResult r;
    EXPECT_TRUE(optimal_tf_certified(in, r, p));
    return r;
}

/// Brute force, with sums of its own, finds no pose that costs less than the gap allows; nor does the cost
/// say anything else than residuals do.
void expect_nothing_lower(const Pairings& pairings, const PairWeights& w, const CertifiedResult& r,
                          size_t starts, SeededRandom& random)
{
    const RowSet rows = rows_of(pairings, w);
    const double rounding = sums_rounding(pose_quadratic(pairings, w)), here = rows.cost(r.optimalPose),
                 lowest = rows.cost_with_best_translation(best_of_descents(rows.form(), starts, random));
    EXPECT_NEAR(r.cost, here, rounding);
    EXPECT_LE(here, lowest + r.gap + rounding) << "another pose costs less";
    EXPECT_LE(r.cost - r.gap, lowest + rounding) << "another pose costs less than is said to be proven";
}

void expect_brute_force_to_fail(size_t rounds, size_t starts, uint64_t seed)
{
    SCOPED_TRACE("seed " + std::to_string(seed));
    SeededRandom random(seed);
    size_t sets = 0, proven = 0;
    std::map<GlobalVerdict, size_t> verdicts;
    for (size_t round = 0; round < rounds; round++)
        for_each_instance({0, 0.01, 0.03, 0.1, 0.3}, random,
                          [&](const Pairings& pairings, const CertifiedParameters& p, const ExactMix&, double)
                          {
                              const CertifiedResult r = solved(pairings, p);
                              sets++, proven += r.gap <= p.tolerance * r.scale, verdicts[r.verdict]++;
                              expect_nothing_lower(pairings, p.weights.pair_weights, r, starts, random);
                          });
    // 99.9 %; of few sets one may be missing: where the translation is known very badly, the gap's allowance
    // for rounding is above the tolerance.
    EXPECT_LE(sets - proven, std::max<size_t>(1, sets / 1000)) << proven << " of " << sets;
    EXPECT_EQ(verdicts[GlobalVerdict::Unobservable], 0u) << "these sets determine the pose";
    EXPECT_GT(verdicts[GlobalVerdict::Global], sets / 2);
}
}  // namespace

// ---- Against brute force ----------------------------------------------------------------------------------

TEST(CertifiedReferee, DescentsFromRandomRotationsFindNothingLower)
{
    expect_brute_force_to_fail(repetitions(1, 34), repetitions(20, 200), 1);
}

TEST(CertifiedReferee, VeryManyDescentsFindNothingLower)
{
    expect_brute_force_to_fail(1, repetitions(5, 100000), 2);
}

TEST(CertifiedReferee, WeightsOfSinglePairingsOverEighteenDecadesAreSolvedOrTheGapTells)
{
    SeededRandom random(4);
    size_t sets = 0, proven = 0;
    for (size_t round = 0; round < repetitions(1, 15); round++)
        for_each_instance({0, 0.03, 0.3}, random,
                          [&](Pairings pairings, const CertifiedParameters& p, const ExactMix&, double)
                          {
                              weigh_at_random(pairings, [&] { return std::pow(10, random.uniform(-9, 9)); });
                              const CertifiedResult r = solved(pairings, p);
                              const RowSet rows = rows_of(pairings, p.weights.pair_weights);
                              const double here = rows.cost(r.optimalPose),
                                           lowest = rows.cost_with_best_translation(
                                               best_of_descents(rows.form(), repetitions(20, 200), random));
                              sets++, proven += r.gap <= p.tolerance * r.scale;
                              EXPECT_LE(here, lowest + r.gap) << "another pose costs less";
                          });
    EXPECT_GT(proven, sets / 2) << proven << " of " << sets;
    if (repetitions(0, 1)) std::printf("proven: %zu of %zu\n", proven, sets);
}

// ---- Against other solvers --------------------------------------------------------------------------------

namespace
{
struct Rival
{
    const char* name;
    std::function<bool(const Pairings&, const PairWeights&, OptimalTF_Result&)> solve;
    /// Does it promise least squares of this mix?
    std::function<bool(const ExactMix&)> is_least_squares;
};
bool only_points(const ExactMix& mix)
{
    return mix.ten.pt2pt == 10;
}
WeightParameters weighted(const PairWeights& w)
{
    WeightParameters out;
    out.pair_weights = w;
    return out;
}
Rival olae(const char* name, OlaeSystem system, bool is_exact_on_points)
{
    return {name,
            [system](const Pairings& in, const PairWeights& w, OptimalTF_Result& out)
            {
                OlaeParameters p;
                p.system = system, p.normalize_points = false;
                return optimal_tf_olae(in, weighted(w), out, {}, p);
            },
            [is_exact_on_points](const ExactMix& mix) { return is_exact_on_points && only_points(mix); }};
}
std::vector<Rival> rivals()
{
    return {{"Horn",
             [](const Pairings& in, const PairWeights& w, OptimalTF_Result& out)
             { return optimal_tf_horn(in, weighted(w), out); },
             only_points},
            olae("OLAE", OlaeSystem::Report, false),
            olae("OLAE + Newton", OlaeSystem::Newton, true),
            {"Gauss-Newton",
             [](const Pairings& in, const PairWeights& w, OptimalTF_Result& out)
             {
                 OptimalTF_GN_Parameters p;
                 p.pairWeights = w, p.maxInnerLoopIterations = 100;
                 return optimal_tf_gauss_newton(in, out, p);
             },
             [](const ExactMix&) { return true; }}};
}
}  // namespace

TEST(CertifiedReferee, NoSolverCostsLessAndLeastSquaresCostTheSame)
{
    SeededRandom random(3);
    std::map<std::string, double> excess;  // by mix and solver: the largest
    const auto all = rivals();
    for (size_t round = 0; round < repetitions(1, 20); round++)
        for_each_instance(
            {0, 0.01, 0.1}, random,
            [&](const Pairings& pairings, const CertifiedParameters& p, const ExactMix& mix, double noise)
            {
                const PairWeights& w = p.weights.pair_weights;
                const CertifiedResult r = solved(pairings, p);
                const RowSet rows = rows_of(pairings, w);
                const double rounding = sums_rounding(pose_quadratic(pairings, w));
                for (const auto& rival : all)
                {
                    SCOPED_TRACE(rival.name);
                    OptimalTF_Result other;
                    ASSERT_TRUE(rival.solve(pairings, w, other));
                    const double above = rows.cost(other.optimalPose) - rows.cost(r.optimalPose);
                    EXPECT_GE(above, -r.gap - rounding);
                    // Exact data have an exact pose, which all of them promise.
                    if (noise == 0 || rival.is_least_squares(mix))
                    {
                        EXPECT_LE(above, 1e-9 * r.scale + rounding);
                    }
                    double& largest =
                        excess[std::string(mix.name) + "\t" + std::to_string(noise) + "\t" + rival.name];
                    largest = std::max(largest, above / r.scale);
                }
            });
    double of_horn = 0;
    for (const auto& [name, value] : excess)
    {
        if (name.find("Horn") != std::string::npos) of_horn = std::max(of_horn, value);
        if (repetitions(0, 1)) std::printf("%s\t%.1e\n", name.c_str(), value);
    }
    EXPECT_GT(of_horn, 1e-4) << "on mixes it is no least squares, and that is seen";
}

TEST(CertifiedReferee, ExactDataAreSolvedByAllWhateverTheWeightOfASinglePoint)
{
    const auto all = rivals();
    for (uint64_t seed = 1; seed <= repetitions(40, 1000); seed++)
        for (const Mix& mix : {Mix{1, 0, 4, 0, 0}, Mix{1, 3, 0, 0, 0}, Mix{1, 0, 3, 0, 2}})
        {
            SeededRandom random(seed);
            Pairings p = random_pairings(mix, any_rotation(random), random_point(random, 20), random);
            p.point_weights = {{1, random.uniform(0.1, 3)}};
            const RowSet rows = rows_of(p, {});
            EXPECT_LT(rows.cost(solved(p, {}).optimalPose), 1e-20) << "certified, seed " << seed;
            for (const auto& rival : all)
            {
                OptimalTF_Result r;
                ASSERT_TRUE(rival.solve(p, {}, r));
                EXPECT_LT(rows.cost(r.optimalPose), 1e-20) << rival.name << ", seed " << seed;
            }
        }
}

// ---- Degenerate and ambiguous sets, with noise ------------------------------------------------------------

namespace
{
struct HardSet
{
    const char* name;
    std::optional<GlobalVerdict> verdict;  ///< whatever the noise; empty: depends on it
    size_t lowest;                         ///< how many minima cost least, 0: not asked
    std::function<void(FittingSet&)> build;
    bool free_normals = false;
};
void PrintTo(const HardSet& set, std::ostream* out)
{
    *out << set.name;
}
template <class Add>
std::function<void(FittingSet&)> times(int count, const Add& add)
{
    return [count, add](FittingSet& s)
    {
        for (int i = 0; i < count; i++) add(s, i);
    };
}
Vector3d around_x(double angle)
{
    return {0, std::cos(angle), std::sin(angle)};
}
void parallel_line(FittingSet& s, int i)
{
    s.line({0, std::cos(i), std::sin(2. * i)}, X);
}
void wrong_plane(FittingSet& s, int)
{
    s.plane(s.anywhere(), random_direction(s.random));
    s.pairings.paired_pl2pl.back().p_local = patch(s.anywhere(), random_direction(s.random));
}
void wrong_point_on_plane(FittingSet& s, int)
{
    s.point_on_plane(s.anywhere(), random_direction(s.random));
    s.pairings.paired_pt2pl.back().pt_local = to_mrpt(s.anywhere());
}
void three_walls(FittingSet& s)
{
    for (const auto& n : {X, Y, Z})
        for (int i = 0; i < 10; i++) s.point_on_plane(s.within_plane(n), n);
}
void corridor_of_points(FittingSet& s, int i)
{
    const Vector3d n = around_x(0.5 * M_PI * i), d = s.within_plane(n);
    s.point_on_plane(n + Vector3d(d.x(), 0.3 * d.y(), 0.3 * d.z()), n);
}
void point_of_helicoid(FittingSet& s, int)
{
    const double z = s.random.uniform(-3, 3), r = s.random.uniform(-3, 3);
    const Vector3d along(std::cos(z), std::sin(z), 0), across(-std::sin(z), std::cos(z), 0);
    s.point_on_plane(r * along + z * Z, across - r * Z);
}
void planes(FittingSet& s, const std::vector<Vector3d>& normals)
{
    for (const auto& n : normals) s.plane({0, 0, 0}, n);
}

const std::vector<HardSet>& hard_sets()
{
    constexpr auto Free = GlobalVerdict::Unobservable, Several = GlobalVerdict::GlobalAmbiguous,
                   One = GlobalVerdict::Global;
    static const std::vector<HardSet> sets = {
        {"one point", Free, 1, [](FittingSet& s) { s.point({1, 2, 3}); }},
        {"two points", Free, 1, [](FittingSet& s) { s.point(X), s.point(-Y); }},
        {"collinear points", Free, 1, times(10, [](FittingSet& s, int i) { s.point(0.3 * i * X + Y); })},
        {"nearly collinear points", One, 1,
         times(10, [](FittingSet& s, int i) { s.point(0.3 * i * X + 1e-3 * s.anywhere()); })},
        {"points in a plane", One, 1, times(10, [](FittingSet& s, int) { s.point(s.within_plane(Z)); })},
        // Half turns about the three axes.
        {"points on three orthogonal walls", Several, 4, three_walls},
        {"three orthogonal planes without sign", Several, 4, [](FittingSet& s) { planes(s, {X, Y, Z}); },
         true},
        {"three orthogonal planes", One, 1, [](FittingSet& s) { planes(s, {X, Y, Z}); }},
        {"two planes", Free, 1, [](FittingSet& s) { planes(s, {X, X + Y}); }},
        // A half turn about the line where they meet.
        {"two planes without sign", Free, 2, [](FittingSet& s) { planes(s, {X, X + Y}); }, true},
        {"parallel planes", Free, 1, times(5, [](FittingSet& s, int i) { s.plane(i * Z, Z); })},
        {"parallel planes without sign", Free, 1, times(5, [](FittingSet& s, int i) { s.plane(i * Z, Z); }),
         true},
        {"one plane", Free, 1, [](FittingSet& s) { s.plane(Z, Z); }},
        {"two skew lines", Several, 2, [](FittingSet& s) { s.line(Z, X), s.line(-Z, X + 2 * Y); }},
        {"two lines that cross at right angles", Several, 4,
         [](FittingSet& s) { s.line({0, 0, 0}, X), s.line({0, 0, 0}, Y); }},
        {"parallel lines", Free, 1, times(5, parallel_line)},
        {"two parallel lines", Free, 2, times(2, parallel_line)},
        {"one line many times", Free, 0, times(5, [](FittingSet& s, int i) { s.line(i * X, X); })},
        {"one line", Free, 0, [](FittingSet& s) { s.line(Z, X); }},
        {"a point and a line", Several, 2, [](FittingSet& s) { s.point(Y), s.line({0, 0, 0}, X); }},
        {"a line and a point on it", Free, 0, [](FittingSet& s) { s.point(X), s.line({0, 0, 0}, X); }},
        {"a corridor", Free, 1, [](FittingSet& s) { planes(s, {Y, -Y, Z, -Z}); }},
        {"points of a corridor", Free, 1, times(32, corridor_of_points)},
        {"a cylinder", Free, 0, times(20, [](FittingSet& s, int i) {
             s.point_on_plane(around_x(0.1 * M_PI * i) + 3 * std::sin(3. * i) * X, around_x(0.1 * M_PI * i));
         })},
        {"a sphere", {}, 0, times(30, [](FittingSet& s, int) {
             const Vector3d n = random_direction(s.random);
             s.point_on_plane(2 * n, n);
         })},
        {"a helicoid", {}, 0, times(30, point_of_helicoid)},
        {"centres of the faces of a cube", {}, 0, [](FittingSet& s) {
             for (const auto& n : {X, Y, Z}) s.point_on_plane(n, n), s.point_on_plane(-n, -n);
         }},
        {"a point and a plane", Free, 1, [](FittingSet& s) { s.point(Z), s.plane({0, 0, 0}, Z); }},
        {"a line in a plane", Free, 2, [](FittingSet& s) { s.line({0, 0, 0}, X), s.plane({0, 0, 0}, Z); }},
        {"a line through a plane", Free, 0, [](FittingSet& s) { s.line({0, 0, 0}, Z), s.plane({0, 0, 0}, Z); }},
        {"one point on a plane", Free, 1, [](FittingSet& s) { s.point_on_plane(Z, Z); }},
        {"one point on a line", Free, 1, [](FittingSet& s) { s.point_on_line(Z, Z); }},
        {"12 wrong points on planes", One, 1, times(12, wrong_point_on_plane)},
        {"10 wrong planes without sign", One, 1, times(10, wrong_plane), true},
        {"100 wrong planes without sign", One, 1, times(100, wrong_plane), true}};
    return sets;
}

class HardSets : public ::testing::TestWithParam<HardSet>
{
};
}  // namespace

TEST_P(HardSets, AreProvenWhateverTheNoise)
{
    const HardSet& set = GetParam();
    for (const double noise : {0.0, 1e-6, 1e-2, 0.1})
        for (uint64_t seed = 1; seed <= repetitions(4, 30); seed++)
        {
            SCOPED_TRACE("noise " + std::to_string(noise) + " m, seed " + std::to_string(seed));
            FittingSet s(seed);
            s.noise = noise;
            if (set.free_normals) s.signs.pl2pl_sign = DirectionSign::Free;
            set.build(s);
            CertifiedParameters p;
            p.weights.pair_weights = s.signs;
            if (seed % 2) p.guess = s.truth;
            const CertifiedResult r = solved(s.pairings, p);
            EXPECT_NE(r.verdict, GlobalVerdict::Gap) << "gap " << r.gap << ", scale " << r.scale;
            if (set.verdict)
            {
                EXPECT_EQ(to_string(r.verdict), to_string(*set.verdict));
            }
            expect_nothing_lower(s.pairings, s.signs, r, repetitions(10, 300), s.random);
            if (set.lowest == 0) continue;
            p.all_minima = true;
            const CertifiedResult all = solved(s.pairings, p);
            EXPECT_EQ(to_string(all.verdict), to_string(r.verdict));
            size_t lowest = 0;
            for (const auto& m : all.minima) lowest += m.cost <= all.cost + 1e-9 * all.scale;
            EXPECT_EQ(lowest, set.lowest);
        }
}
INSTANTIATE_TEST_SUITE_P(Table, HardSets, ::testing::ValuesIn(hard_sets()),
                         [](const auto& set)
                         {
                             std::string name = set.param.name;
                             std::replace(name.begin(), name.end(), ' ', '_');
                             return name;
                         });

// ---- Equal minima -----------------------------------------------------------------------------------------

TEST(EqualMinima, OfThreeOrthogonalPlanesAreHalfTurnsApart)
{
    FittingSet s(1);
    s.signs.pl2pl_sign = DirectionSign::Free;
    planes(s, {X, Y, Z});
    CertifiedParameters p;
    p.weights.pair_weights = s.signs, p.all_minima = true;
    const CertifiedResult r = solved(s.pairings, p);
    const RowSet rows = rows_of(s.pairings, s.signs);
    ASSERT_EQ(r.minima.size(), 4u);
    for (size_t i = 0; i < 4; i++)
    {
        EXPECT_LT(rows.cost(r.minima[i].pose), 1e-24) << "exact data fit each of them";
        for (size_t j = 0; j < i; j++)
        {
            const Vector3d turn =
                rotation_of(s.in_global).transpose() * rotation_between(r.minima[i].pose, r.minima[j].pose);
            EXPECT_NEAR(turn.norm(), M_PI, 1e-7);
            EXPECT_NEAR(turn.cwiseAbs().maxCoeff(), M_PI, 1e-7) << "about one of the normals";
        }
    }
}

namespace
{
void random_points_on_planes(FittingSet& s, int)
{
    s.point_on_plane(s.anywhere(), random_direction(s.random));
}
void random_points_on_lines(FittingSet& s, int)
{
    s.point_on_line(s.anywhere(), random_direction(s.random));
}
}  // namespace

TEST(EqualMinima, TheNearestToTheGuessOfThoseMetIsChosen)
{
    const std::vector<HardSet> sets = {{"planes",
                                        {},
                                        4,
                                        [](FittingSet& s) {
                                            planes(s, {X, Y, Z});
                                        },
                                        true},
                                       {"lines",
                                        {},
                                        4,
                                        [](FittingSet& s) {
                                            s.line({0, 0, 0}, X), s.line({0, 0, 0}, Y);
                                        }},
                                       {"three points on lines", {}, 0, times(3, random_points_on_lines)},
                                       {"six points on planes", {}, 0, times(6, random_points_on_planes)}};
    for (const auto& set : sets)
        for (uint64_t seed = 1; seed <= repetitions(40, 1000); seed++)
            for (const bool guessed : {false, true})
            {
                SCOPED_TRACE(std::string(set.name) + (guessed ? ", guess" : ", none") + ", seed " +
                             std::to_string(seed));
                FittingSet s(seed);
                if (set.free_normals) s.signs.pl2pl_sign = DirectionSign::Free;
                set.build(s);
                CertifiedParameters p;
                p.weights.pair_weights = s.signs;
                const CPose3D guess = guessed ? make_pose(any_rotation(s.random), X) : CPose3D();
                if (guessed) p.guess = guess;
                size_t met = 0;
                for (const bool all : {false, true})
                {
                    p.all_minima = all;
                    const CertifiedResult r = solved(s.pairings, p);
                    double nearest = M_PI;
                    size_t fit = 0;
                    for (const auto& m : r.minima)
                    {
                        if (!(residual_rms(s, m.pose) < 1e-9)) continue;
                        fit++, nearest = std::min(nearest, rotation_between(guess, m.pose).norm());
                    }
                    EXPECT_LT(rotation_between(guess, r.optimalPose).norm(), nearest + 1e-6);
                    EXPECT_GE(fit, std::max<size_t>(met, all ? set.lowest : 1));
                    met = fit;
                }
            }
}

TEST(EqualMinima, TheVerdictDoesNotDependOnWhetherAllAreAskedFor)
{
    for (uint64_t seed = 1; seed <= repetitions(30, 500); seed++)
    {
        SCOPED_TRACE(seed);
        FittingSet s(seed);  // a sphere, on which noise makes shallow minima
        s.noise = 1e-3;
        for (int i = 0; i < 30; i++)
        {
            const Vector3d n = random_direction(s.random);
            s.point_on_plane(2 * n, n);
        }
        CertifiedParameters p;
        const CertifiedResult some = solved(s.pairings, p);
        p.all_minima = true;
        EXPECT_EQ(to_string(solved(s.pairings, p).verdict), to_string(some.verdict));
    }
}
