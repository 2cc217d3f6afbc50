#include <limits>

#include "degenerate_sets.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN(),
                 INF = std::numeric_limits<double>::infinity();
const Vector3d X = Vector3d::UnitX(), Y = Vector3d::UnitY(), Z = Vector3d::UnitZ(), C(1, -2, 0.5);

Vector3d around_x(double angle)
{
    return std::cos(angle) * Y + std::sin(angle) * Z;
}

/// Flat sets: the cost grows as the square of any motion that is not free.
std::vector<KnownSet> flat_sets()
{
    return {{"one point", 3, turns_about(C), [](FittingSet& s) { s.point(C); }},
            {"copies of a point", 3, turns_about(C),
             [](FittingSet& s)
             {
                 for (int i = 0; i < 40; i++) s.point(C);
             }},
            {"points in line",
             5,
             {turn(X, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 40; i++) s.point(C + s.random.uniform(-3, 3) * X);
             }},
            {"points in line on the line",
             5,
             {turn(X, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 20; i++) s.point(C + s.random.uniform(-3, 3) * X);
                 for (int i = 0; i < 20; i++) s.point_on_line(C + s.random.uniform(-3, 3) * X, X);
                 s.line(C, X);
             }},
            {"points on one line",
             4,
             {slide(X), turn(X, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 40; i++) s.point_on_line(C + s.random.uniform(-3, 3) * X, X);
             }},
            {"copies of a line",
             4,
             {slide(X), turn(X, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 20; i++) s.line(C + s.random.uniform(-3, 3) * X, X);
             }},
            {"parallel lines",
             5,
             {slide(X)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 20; i++) s.line(s.anywhere(), X);
             }},
            {"parallel planes",
             3,
             {slide(X), slide(Y), turn(Z, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 20; i++) s.plane(s.anywhere(), i % 2 ? Z : -Z);
             }},
            {"points on one plane",
             3,
             {slide(X), slide(Y), turn(Z, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 40; i++) s.point_on_plane(C + s.within_plane(Z), Z);
             }},
            {"a plane and points on it",
             3,
             {slide(X), slide(Y), turn(Z, C)},
             [](FittingSet& s)
             {
                 s.plane(C, Z);
                 for (int i = 0; i < 40; i++) s.point_on_plane(C + s.within_plane(Z), Z);
             }},
            {"a plane and a point in it",
             5,
             {turn(Z, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 20; i++) s.plane(C + s.within_plane(Z), Z);
                 s.point(C);
             }},
            {"corridor",
             5,
             {slide(X)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 60; i++)
                 {
                     const Vector3d p = s.anywhere();
                     if (i % 4 < 2)
                         s.point_on_plane({p.x(), i % 4 ? -1. : 1., p.z()}, i % 4 ? Y : -Y);
                     else
                         s.point_on_plane({p.x(), p.y(), i % 4 == 2 ? -1. : 1.5}, i % 4 == 2 ? Z : -Z);
                 }
             }},
            {"prism",
             5,
             {slide(X)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 20; i++)
                     for (int k = 0; k < 3; k++)
                     {
                         const Vector3d n = around_x(2 * k);
                         s.point_on_plane(C + n + s.within_plane(n), n);
                     }
             }},
            {"prism of planes",
             5,
             {slide(X)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 12; i++) s.plane(C + around_x(2 * i) + s.anywhere(), around_x(2 * i));
             }}};
}

/** Surfaces that can be moved on themselves, their normals known: off the exact pose such a motion is not
 * quite free, and the cost grows as the fourth power of it where it is combined with others; so an exact pose
 * is found to the fourth root of rounding only.
 */
std::vector<KnownSet> curved_sets()
{
    return {{"tunnel",
             4,
             {slide(X), turn(X, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 60; i++)
                 {
                     const Vector3d n = around_x(s.random.uniform(0, 2 * M_PI));
                     s.point_on_plane(C + 2 * n + s.random.uniform(-3, 3) * X, n);
                 }
             }},
            {"sphere", 3, turns_about(C),
             [](FittingSet& s)
             {
                 for (int i = 0; i < 60; i++)
                 {
                     const Vector3d n = random_direction(s.random);
                     s.pairings.paired_pt2pl.push_back(
                         {patch(s.global(C + 2 * n), s.global_direction(n)), to_mrpt(s.local(C + 2 * n))});
                 }
             }},
            {"cone",
             5,
             {turn(X, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 60; i++)
                 {
                     const Vector3d radial = around_x(s.random.uniform(0, 2 * M_PI));
                     const double r = s.random.uniform(0.5, 2.5);
                     s.point_on_plane(C + r * radial + 2 * r * X, 2 * radial - X);
                 }
             }},
            {"screw thread",
             5,
             {screw(X, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 60; i++)
                 {
                     const double angle = s.random.uniform(0, 6), r = s.random.uniform(1, 2), pitch = 0.5;
                     const Vector3d radial = around_x(angle), along = around_x(angle + M_PI / 2);
                     s.point_on_plane(C + r * radial + pitch * angle * X, r * X - pitch * along);
                     s.point_on_plane(C + radial + pitch * angle * X, radial);
                 }
             }}};
}

FittingSet made(const KnownSet& known, uint64_t seed, double noise = 0)
{
    FittingSet s(seed);
    s.noise = noise * s.size;
    known.build(s);
    return s;
}

/// A turn by `angle` about the mean of the local positions, which moves by as many of the set's sizes.
CPose3D displaced(const FittingSet& s, double angle, SeededRandom& random)
{
    const Vector3d centre = transformed(s.truth, local_centroid(s.pairings)), u = random_direction(random);
    const CPose3D turned = moved_about(s.truth, u, centre, angle, 0);
    return make_pose(rotation_of(turned), translation_of(turned) + angle * s.size * random_direction(random));
}

/// How far the pose has turned from the guess about the axes that theory says are free.
double invented_turn(const FittingSet& s, const std::vector<Motion>& known, const CPose3D& guess,
                     const CPose3D& pose)
{
    const Vector3d turned = rotation_between(guess, pose);
    double largest = 0;
    for (const auto& m : known)
        if (m.kind != FreeTwist::Kind::Translation)
            largest = std::max(largest, std::abs(s.global_direction(m.axis).dot(turned)));
    return largest;
}

bool has_projections(const Pairings& p)
{
    return !p.paired_pt2ln.empty() || !p.paired_pt2pl.empty();
}

/// The closed forms and descents that differ in how they treat degenerate sets.
std::vector<NamedSolver> main_solvers()
{
    return {horn_solver(), olae_solver("OlaeReport", OlaeSystem::Report, true),
            olae_solver("OlaeLeastSquaresWithLengths", OlaeSystem::LeastSquares, false),
            gauss_newton_solver()};
}

std::string of(const NamedSolver& solver, uint64_t seed)
{
    return solver.name + ", seed " + std::to_string(seed);
}

class FlatSet : public testing::TestWithParam<KnownSet>
{
};
class CurvedSet : public testing::TestWithParam<KnownSet>
{
};
std::string name_of(const testing::TestParamInfo<KnownSet>& row)
{
    std::string name;
    for (const char c : row.param.name)
        if (std::isalnum(static_cast<unsigned char>(c))) name += c;
    return name;
}
}  // namespace

// ---- Exact data -----------------------------------------------------------------------------------------

TEST_P(FlatSet, ExactDataAreSolvedWithoutAGuessNearestToTheIdentity)
{
    for (uint64_t seed = 1; seed <= repetitions(1, 20); seed++)
        for (const auto& solver : main_solvers())
        {
            SCOPED_TRACE(of(solver, seed));
            const FittingSet s = made(GetParam(), seed);
            OptimalTF_Result r;
            ASSERT_TRUE(solver.solve(s, std::nullopt, r));
            EXPECT_LT(residual_rms(s, r.optimalPose), 1e-11 * s.size);
            expect_described(s, r, GetParam().rank);
            expect_kept_rotation(r, CPose3D(), 1e-6);
            expect_kept_centroid(s, r, CPose3D(), 1e-10 * s.size);
            expect_nothing_nearer(s, r, CPose3D());
        }
}

/// The residuals of a curved surface grow with the square of a turn along it, so that exact data determine
/// even that turn, to the root of what residuals resolve; to first order it is free.
TEST_P(CurvedSet, ExactDataAreSolvedWithoutAGuess)
{
    for (uint64_t seed = 1; seed <= repetitions(1, 20); seed++)
        for (const auto& solver : main_solvers())
        {
            SCOPED_TRACE(of(solver, seed));
            const FittingSet s = made(GetParam(), seed);
            OptimalTF_Result r;
            ASSERT_TRUE(solver.solve(s, std::nullopt, r));
            EXPECT_LT(residual_rms(s, r.optimalPose), 1e-9 * s.size);
            EXPECT_EQ(r.rank, GetParam().rank);
        }
}

static void expect_truth_stays(const KnownSet& known, const std::vector<NamedSolver>& solvers)
{
    for (uint64_t seed = 11; seed <= 10 + repetitions(1, 20); seed++)
        for (const auto& solver : solvers)
        {
            SCOPED_TRACE(of(solver, seed));
            const FittingSet s = made(known, seed);
            OptimalTF_Result r;
            ASSERT_TRUE(solver.solve(s, s.truth, r));
            EXPECT_LT(rotation_between(s.truth, r.optimalPose).norm(), 1e-9);
            EXPECT_LT((translation_of(r.optimalPose) - translation_of(s.truth)).norm(), 1e-9 * s.size);
            expect_described(s, r, known.rank);
            expect_known_motions(s, r, known.free, 1e-4);
        }
}
TEST_P(FlatSet, AnExactGuessStaysAndTheFreeMotionsAreThoseOfTheory)
{
    expect_truth_stays(GetParam(), all_solvers());
}
TEST_P(CurvedSet, AnExactGuessStaysAndTheFreeMotionsAreThoseOfTheory)
{
    expect_truth_stays(GetParam(), all_solvers());
}

// ---- From a guess ---------------------------------------------------------------------------------------

TEST_P(FlatSet, ClosedFormsKeepTheGuessWhereItIsFree)
{
    for (uint64_t seed = 21; seed <= 20 + repetitions(1, 20); seed++)
        for (const auto& solver : closed_forms())
        {
            const FittingSet s = made(GetParam(), seed);
            if (has_projections(s.pairings)) continue;
            SCOPED_TRACE(of(solver, seed));
            SeededRandom random(seed);
            const CPose3D guess = displaced(s, 0.8, random);
            OptimalTF_Result r;
            ASSERT_TRUE(solver.solve(s, guess, r));
            EXPECT_LT(residual_rms(s, r.optimalPose), 1e-11 * s.size);
            expect_described(s, r, GetParam().rank);
            expect_kept_rotation(r, guess, 1e-6);
            expect_kept_centroid(s, r, guess, 1e-10 * s.size);
            expect_nothing_nearer(s, r, guess);
        }
}

TEST_P(FlatSet, ProjectionsAtAGuessInventNoTurn)
{
    const double off = 0.1;
    for (uint64_t seed = 31; seed <= 30 + repetitions(1, 20); seed++)
        for (const auto& solver : closed_forms())
        {
            const FittingSet s = made(GetParam(), seed);
            if (!has_projections(s.pairings)) continue;
            SCOPED_TRACE(of(solver, seed));
            SeededRandom random(seed);
            const CPose3D guess = displaced(s, off, random);
            OptimalTF_Result r;
            ASSERT_TRUE(solver.solve(s, guess, r));
            // Of second order in what the guess is off by.
            EXPECT_LT(invented_turn(s, GetParam().free, guess, r.optimalPose), off * off);
            expect_kept_centroid(s, r, guess, 1e-10 * s.size);
        }
}

TEST_P(FlatSet, GaussNewtonKeepsTheGuessWhereItIsFree)
{
    for (uint64_t seed = 41; seed <= 40 + repetitions(2, 20); seed++)
    {
        SCOPED_TRACE(seed);
        const FittingSet s = made(GetParam(), seed);
        SeededRandom random(seed);
        const CPose3D guess = displaced(s, 0.1, random);
        OptimalTF_Result r;
        ASSERT_TRUE(gauss_newton_solver().solve(s, guess, r));
        EXPECT_LT(residual_rms(s, r.optimalPose), 1e-11 * s.size);
        expect_described(s, r, GetParam().rank);
        expect_kept_centroid(s, r, guess, 1e-10 * s.size);
        expect_kept_rotation(r, guess, 1e-6);
    }
}

/// Projections of a displaced guess drag a body along its surface, but by less than the guess is off.
TEST_P(CurvedSet, ProjectionsAtAGuessTurnByLessThanTheGuessIsOff)
{
    const double off = 0.01;
    for (uint64_t seed = 51; seed <= 50 + repetitions(2, 20); seed++)
        for (const auto& solver : closed_forms())
        {
            SCOPED_TRACE(of(solver, seed));
            const FittingSet s = made(GetParam(), seed);
            SeededRandom random(seed);
            const CPose3D guess = displaced(s, off, random);
            OptimalTF_Result r;
            ASSERT_TRUE(solver.solve(s, guess, r));
            EXPECT_LT(residual_rms(s, r.optimalPose), 0.8 * residual_rms(s, guess));
            EXPECT_LT(invented_turn(s, GetParam().free, guess, r.optimalPose), off);
        }
}

// ---- Noise ----------------------------------------------------------------------------------------------

/** With noise on the local side, of `noise` times the size: what noise makes of a motion that is free is no
 * information. (The pose is still that of least squares: small noise turns nothing along it, large noise
 * may.)
 */
static void expect_no_information_from_noise(const KnownSet& known, double noise)
{
    for (uint64_t seed = 61; seed <= 60 + repetitions(1, 20); seed++)
        for (const auto& solver : main_solvers())
            for (const bool guessed : {false, true})
            {
                SCOPED_TRACE(of(solver, seed) + (guessed ? ", from the truth" : ", without a guess"));
                const FittingSet s = made(known, seed, noise);
                const Guess guess = guessed ? Guess(s.truth) : std::nullopt;
                OptimalTF_Result r;
                ASSERT_TRUE(solver.solve(s, guess, r));
                expect_finite(r.optimalPose);
                // Normalised to unit length, a point next to the centroid has noise for its direction.
                const double unit_vectors = solver.name == "OlaeReport" ? 100 : 1;
                EXPECT_LT(residual_rms(s, r.optimalPose), 3 * noise * s.size * unit_vectors);
                EXPECT_EQ(r.rank, known.rank);
                if (noise < 1e-3)
                {
                    EXPECT_LT(invented_turn(s, known.free, guess.value_or(CPose3D()), r.optimalPose),
                              10 * noise);
                }
            }
}
TEST_P(FlatSet, NoiseOfAMillionthIsNoInformation)
{
    expect_no_information_from_noise(GetParam(), 1e-6);
}
TEST_P(FlatSet, NoiseOfAHundredthIsNoInformation)
{
    expect_no_information_from_noise(GetParam(), 1e-2);
}
INSTANTIATE_TEST_SUITE_P(Table, FlatSet, testing::ValuesIn(flat_sets()), name_of);
INSTANTIATE_TEST_SUITE_P(Table, CurvedSet, testing::ValuesIn(curved_sets()), name_of);

// ---- Vectors that contradict each other and still leave a turn free -------------------------------------

namespace
{
/// All vectors of the global side are along X.
std::vector<KnownSet> contradicting_sets()
{
    const auto scaled = [](FittingSet& s, const std::vector<double>& global, const std::vector<double>& local)
    {
        for (size_t i = 0; i < global.size(); i++)
            add_pair(s.pairings, s.global(C + global[i] * X), s.local(C + local[i] * X));
    };
    return {{"two points of unequal distances",
             5,
             {turn(X, C)},
             [=](FittingSet& s) {
                 scaled(s, {0, 1.2}, {0, 1});
             }},
            {"points in line with two of them swapped",
             5,
             {turn(X, C)},
             [=](FittingSet& s) {
                 scaled(s, {1, 2, 3, 5, 7}, {1, 3, 2, 5, 0});
             }},
            {"points in line on two scales",
             5,
             {turn(X, C)},
             [=](FittingSet& s) {
                 scaled(s, {-2, 0, 1, 4}, {-1, 0, 0.5, 2});
             }},
            {"parallel planes with one normal reversed",
             3,
             {slide(Y), slide(Z), turn(X, C)},
             [](FittingSet& s)
             {
                 for (int i = 0; i < 3; i++) s.plane(C + s.within_plane(X), X);
                 auto& n = s.pairings.paired_pl2pl[2].p_local.plane.coefs;
                 for (double& c : n) c = -c;
             }}};
}
}  // namespace

class ContradictingSet : public testing::TestWithParam<KnownSet>
{
};
TEST_P(ContradictingSet, LeavesTheTurnFreeAndTheGuessThere)
{
    for (uint64_t seed = 71; seed <= 70 + repetitions(3, 50); seed++)
        for (const auto& solver : all_solvers())
        {
            SCOPED_TRACE(of(solver, seed));
            FittingSet s(seed);
            if (seed == 71) s.in_global = s.truth = CPose3D();  // no rounding blurs what is singular
            GetParam().build(s);
            SeededRandom random(seed);
            const CPose3D guess = displaced(s, 0.3, random);
            OptimalTF_Result r;
            ASSERT_TRUE(solver.solve(s, guess, r));
            expect_finite(r.optimalPose);
            // Contradictions as large as the scene put more in doubt than what is free.
            EXPECT_LE(r.rank, GetParam().rank);
            EXPECT_GE(r.rank, 1);
            if (solver.descends) continue;
            EXPECT_LT(invented_turn(s, GetParam().free, guess, r.optimalPose), 1e-6);
        }
}
INSTANTIATE_TEST_SUITE_P(Table, ContradictingSet, testing::ValuesIn(contradicting_sets()), name_of);

// ---- Nothing to solve with ------------------------------------------------------------------------------

namespace
{
void expect_untouched(const NamedSolver& solver, const FittingSet& s, size_t skipped)
{
    SCOPED_TRACE(solver.name);
    for (const Guess& guess : {Guess(), Guess(CPose3D(4, 5, 6, 0.4, 0.5, 0.6))})
    {
        const CPose3D before(1, 2, 3, 0.1, 0.2, 0.3);
        OptimalTF_Result r;
        r.optimalPose = before, r.status = SolveStatus::Determined, r.rank = 6;
        r.free.resize(2);
        bool solved = true;
        EXPECT_NO_THROW(solved = solver.solve(s, guess, r));
        EXPECT_FALSE(solved);
        EXPECT_EQ(r.status, SolveStatus::NoPairings);
        EXPECT_EQ(r.rank, 0);
        EXPECT_EQ(r.skipped, skipped);
        EXPECT_TRUE(r.free.empty());
        expect_same_bits(r.optimalPose, before);
    }
}

/// Three pairings of each kind.
FittingSet one_of_each(uint64_t seed)
{
    FittingSet s(seed);
    s.noise = 0.01;
    for (int i = 0; i < 3; i++)
    {
        s.point(s.anywhere());
        s.point_on_line(s.anywhere(), random_direction(s.random));
        s.point_on_plane(s.anywhere(), random_direction(s.random));
        s.line(s.anywhere(), random_direction(s.random));
        s.plane(s.anywhere(), random_direction(s.random));
    }
    return s;
}
}  // namespace

TEST(NothingToSolveWith, NoPairingsGiveFalseAndLeaveThePose)
{
    const FittingSet empty(1);
    for (const auto& solver : all_solvers()) expect_untouched(solver, empty, 0);
}

TEST(NothingToSolveWith, WeightsOfZeroGiveFalseAndLeaveThePose)
{
    FittingSet by_kind = one_of_each(2), by_pairing = one_of_each(3);
    PairWeights& w = by_kind.signs;
    w.pt2pt = w.pt2ln = w.pt2pl = w.ln2ln = w.pl2pl = 0;
    Pairings& p = by_pairing.pairings;
    p.point_weights = p.pt2ln_weights = p.pt2pl_weights = p.ln2ln_weights = p.pl2pl_weights = {{3, 0.0}};
    for (const auto& solver : all_solvers())
    {
        expect_untouched(solver, by_kind, 0);
        expect_untouched(solver, by_pairing, 0);
    }
}

// ---- Numbers that are not finite ------------------------------------------------------------------------

namespace
{
/// Every number of the middle pairing of each kind that says something: the fourth coefficient of a plane
/// does not, planes are through their centroids.
std::vector<std::pair<std::string, double*>> numbers_of(Pairings& p)
{
    std::vector<std::pair<std::string, double*>> all;
    const auto add = [&](const std::string& name, auto& v)
    {
        all.emplace_back(name + ".x", &v.x), all.emplace_back(name + ".y", &v.y);
        all.emplace_back(name + ".z", &v.z);
    };
    const auto add_line = [&](const std::string& name, mrpt::math::TLine3D& l)
    { add(name + " base", l.pBase), add(name + " director", l.director); };
    const auto add_patch = [&](const std::string& name, plane_patch_t& patch)
    {
        add(name + " centroid", patch.centroid);
        for (size_t i = 0; i < 3; i++) all.emplace_back(name + " normal", &patch.plane.coefs[i]);
    };
    add("pt2pt global", p.paired_pt2pt[1].global), add("pt2pt local", p.paired_pt2pt[1].local);
    add_line("pt2ln", p.paired_pt2ln[1].ln_global), add("pt2ln local", p.paired_pt2ln[1].pt_local);
    add_patch("pt2pl", p.paired_pt2pl[1].pl_global), add("pt2pl local", p.paired_pt2pl[1].pt_local);
    add_line("ln2ln global", p.paired_ln2ln[1].ln_global),
        add_line("ln2ln local", p.paired_ln2ln[1].ln_local);
    add_patch("pl2pl global", p.paired_pl2pl[1].p_global),
        add_patch("pl2pl local", p.paired_pl2pl[1].p_local);
    return all;
}

/// Weights differ, so that a pairing that gets the weight of another shows.
void set_weights(Pairings& p)
{
    p.point_weights = {{1, 1.0}, {1, 2.0}, {1, 3.0}};
    p.pt2ln_weights = p.pt2pl_weights = p.ln2ln_weights = p.pl2pl_weights = p.point_weights;
}

/// The set without the middle pairing of the list that holds the number.
Pairings without(Pairings p, const std::string& number)
{
    const WeightRuns left = {{1, 1.0}, {1, 3.0}};
    const auto drop = [&](auto& list, WeightRuns& weights) { list.erase(list.begin() + 1), weights = left; };
    const std::string kind = number.substr(0, 5);
    if (kind == "pt2pt") drop(p.paired_pt2pt, p.point_weights);
    if (kind == "pt2ln") drop(p.paired_pt2ln, p.pt2ln_weights);
    if (kind == "pt2pl") drop(p.paired_pt2pl, p.pt2pl_weights);
    if (kind == "ln2ln") drop(p.paired_ln2ln, p.ln2ln_weights);
    if (kind == "pl2pl") drop(p.paired_pl2pl, p.pl2pl_weights);
    return p;
}
}  // namespace

TEST(NotFinite, AnySingleNumberSkipsItsPairingAndChangesNotABitOfTheRest)
{
    FittingSet s = one_of_each(4);
    set_weights(s.pairings);
    const Pairings all = s.pairings;
    for (const auto& solver : main_solvers())
        for (const bool guessed : {false, true})
            for (const auto& [name, number] : numbers_of(s.pairings))
                for (const double bad : {NaN, INF, -INF})
                {
                    SCOPED_TRACE(solver.name + ", " + name + " = " + std::to_string(bad));
                    const Guess guess = guessed ? Guess(s.truth) : std::nullopt;
                    FittingSet clean = s;
                    clean.pairings = without(all, name);
                    const double good = *number;
                    *number = bad;
                    OptimalTF_Result r, expected;
                    EXPECT_TRUE(solver.solve(s, guess, r));
                    *number = good;
                    ASSERT_TRUE(solver.solve(clean, guess, expected));
                    EXPECT_EQ(r.skipped, 1u);
                    EXPECT_EQ(expected.skipped, 0u);
                    EXPECT_EQ(r.rank, 6);
                    expect_same_bits(r.optimalPose, expected.optimalPose);
                }
}

TEST(NotFinite, TheFourthCoefficientOfAPlaneIsNotAsked)
{
    FittingSet s = one_of_each(9);
    const FittingSet clean = s;
    s.pairings.paired_pt2pl[0].pl_global.plane.coefs[3] = NaN;
    s.pairings.paired_pl2pl[1].p_local.plane.coefs[3] = INF;
    s.pairings.paired_pl2pl[2].p_global.plane.coefs[3] = NaN;
    for (const auto& solver : main_solvers())
    {
        SCOPED_TRACE(solver.name);
        OptimalTF_Result r, expected;
        ASSERT_TRUE(solver.solve(s, std::nullopt, r));
        ASSERT_TRUE(solver.solve(clean, std::nullopt, expected));
        EXPECT_EQ(r.skipped, 0u);
        expect_same_bits(r.optimalPose, expected.optimalPose);
    }
}

TEST(NotFinite, DirectionsOfNoLengthAreSkippedToo)
{
    FittingSet s = one_of_each(5);
    Pairings& p = s.pairings;
    p.paired_pt2ln[0].ln_global.director = p.paired_ln2ln[0].ln_local.director = {0, 0, 0};
    p.paired_ln2ln[1].ln_global.director = {0, 0, 0};
    for (auto* patch :
         {&p.paired_pt2pl[2].pl_global, &p.paired_pl2pl[0].p_local, &p.paired_pl2pl[2].p_global})
        for (size_t i = 0; i < 3; i++) patch->plane.coefs[i] = 0;
    FittingSet clean = s;
    const auto drop = [](auto& list, size_t index)
    { list.erase(list.begin() + static_cast<std::ptrdiff_t>(index)); };
    drop(clean.pairings.paired_pt2ln, 0), drop(clean.pairings.paired_pt2pl, 2);
    drop(clean.pairings.paired_ln2ln, 1), drop(clean.pairings.paired_ln2ln, 0);
    drop(clean.pairings.paired_pl2pl, 2), drop(clean.pairings.paired_pl2pl, 0);
    for (const auto& solver : all_solvers())
    {
        SCOPED_TRACE(solver.name);
        OptimalTF_Result r, expected;
        ASSERT_TRUE(solver.solve(s, std::nullopt, r));
        ASSERT_TRUE(solver.solve(clean, std::nullopt, expected));
        EXPECT_EQ(r.skipped, 6u);
        expect_same_bits(r.optimalPose, expected.optimalPose);
    }
}

TEST(NotFinite, WithNothingLeftTheResultIsThatOfNoPairings)
{
    FittingSet s = one_of_each(6);
    for (auto& p : s.pairings.paired_pt2pt) p.global.x = NaN;
    for (auto& p : s.pairings.paired_pt2ln) p.pt_local.y = INF;
    for (auto& p : s.pairings.paired_pt2pl) p.pl_global.plane.coefs[2] = NaN;
    for (auto& p : s.pairings.paired_ln2ln) p.ln_local.director.z = -INF;
    for (auto& p : s.pairings.paired_pl2pl) p.p_local.centroid.x = NaN;
    for (const auto& solver : all_solvers()) expect_untouched(solver, s, 15);
}

TEST(NotFinite, OutliersKeepTheirIndicesInTheListsThatWereGiven)
{
    for (const auto rejection : {OutlierRejection::GncGemanMcClure, OutlierRejection::GncTruncated})
        for (const bool olae : {false, true})
        {
            SCOPED_TRACE(olae ? "OLAE" : "Horn");
            FittingSet s(7);
            s.noise = 0.001;
            for (int i = 0; i < 12; i++)
            {
                s.point(s.anywhere());
                s.point_on_line(s.anywhere(), random_direction(s.random));
                s.point_on_plane(s.anywhere(), random_direction(s.random));
                s.line(s.anywhere(), random_direction(s.random));
                s.plane(s.anywhere(), random_direction(s.random));
            }
            Pairings& p = s.pairings;
            p.paired_pt2pt[0].local.x = p.paired_pt2pt[4].global.y = NaN;
            p.paired_pt2ln[1].pt_local.x = NaN;
            p.paired_pt2pl[0].pl_global.centroid.z = p.paired_pt2pl[2].pt_local.z = INF;
            p.paired_ln2ln[3].ln_global.director.x = NaN;
            p.paired_pl2pl[0].p_local.plane.coefs[0] = p.paired_pl2pl[1].p_local.centroid.x = NaN;
            const auto move_by = [](mrpt::math::TPoint3D& at, double x)
            { at.x += x, at.y -= x, at.z += 2 * x; };
            p.paired_pt2pt[6].local.x += 9, p.paired_pt2pt[3].local.y -= 9;
            move_by(p.paired_pt2ln[5].pt_local, 8);
            move_by(p.paired_pt2pl[7].pt_local, -8);
            move_by(p.paired_ln2ln[8].ln_local.pBase, 8);
            move_by(p.paired_pl2pl[9].p_local.centroid, 8);
            WeightParameters wp;
            wp.outlier_rejection = rejection, wp.outlier_threshold = 0.05;
            OptimalTF_Result r;
            ASSERT_TRUE(olae ? optimal_tf_olae(p, wp, r, s.truth) : optimal_tf_horn(p, wp, r, s.truth));
            EXPECT_EQ(r.skipped, 8u);
            EXPECT_EQ(r.outliers.point2point, (std::vector<size_t>{3, 6}));
            EXPECT_EQ(r.outliers.point2line, (std::vector<size_t>{5}));
            EXPECT_EQ(r.outliers.point2plane, (std::vector<size_t>{7}));
            EXPECT_EQ(r.outliers.line2line, (std::vector<size_t>{8}));
            EXPECT_EQ(r.outliers.plane2plane, (std::vector<size_t>{9}));
            EXPECT_LT(rotation_between(s.truth, r.optimalPose).norm(), 0.01);
        }
}

TEST(NotFinite, OutliersFoundAmongThePointsKeepTheirIndicesToo)
{
    std::vector<WeightParameters> ways(3);
    ways[0].outlier_rejection = OutlierRejection::NoiseScale;
    ways[1].outlier_rejection = OutlierRejection::ConsistencyGraph;
    ways[2].use_scale_outlier_detector = true, ways[2].scale_outlier_threshold = 3;
    for (auto& wp : ways)
    {
        SCOPED_TRACE(static_cast<int>(wp.outlier_rejection));
        FittingSet s(8);
        for (int i = 0; i < 20; i++) s.point(3 * random_direction(s.random));
        s.pairings.paired_pt2pt[0].local.x = s.pairings.paired_pt2pt[5].global.z = NaN;
        s.pairings.paired_pt2pt[9].local.x += 40, s.pairings.paired_pt2pt[3].local.y -= 40;
        OptimalTF_Result r;
        ASSERT_TRUE(optimal_tf_horn(s.pairings, wp, r));
        EXPECT_EQ(r.skipped, 2u);
        EXPECT_EQ(r.outliers.point2point, (std::vector<size_t>{3, 9}));
        EXPECT_TRUE(optimal_tf_olae(s.pairings, wp, r));
        EXPECT_EQ(r.outliers.point2point, (std::vector<size_t>{3, 9}));
    }
}
