#include "degenerate_sets.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
/// rad. The angle to the guess is flat at its least: a turn of g about a free axis makes it longer by about
/// g^2 only, which is 1e-10 here.
constexpr double KEPT = 1e-5;

const Vector3d X = Vector3d::UnitX(), Y = Vector3d::UnitY(), Z = Vector3d::UnitZ();

std::vector<KnownSet> points()
{
    const Vector3d a(1, 2, -1), b(-2, 1, 1), c(2, -2, 0.5);
    return {{"1 point", 3, turns_about(a), [=](FittingSet& s) { s.point(a); }},
            {"2 points", 5, {turn(b - a, a)}, [=](FittingSet& s) { s.point(a), s.point(b); }},
            {"3 points", 6, {}, [=](FittingSet& s) { s.point(a), s.point(b), s.point(c); }},
            {"3 points in line", 5, {turn(b - a, a)}, [=](FittingSet& s) {
                 s.point(a), s.point(b), s.point(a + 0.3 * (b - a));
             }}};
}

std::vector<KnownSet> planes()
{
    const Vector3d q(1, -1, 2), r(-2, 1, 0), m(1, 2, 3), n(-1, 2, 0.5), p(2, 0, 1);
    return {{"1 plane", 3, {slide(X), slide(Y), turn(Z, q)}, [=](FittingSet& s) { s.plane(q, Z); }},
            {"2 planes", 5, {slide(m.cross(n))}, [=](FittingSet& s) { s.plane(q, m), s.plane(r, n); }},
            {"2 parallel planes",
             3,
             {slide(X), slide(Y), turn(Z, q)},
             [=](FittingSet& s) { s.plane(q, Z), s.plane(r, -Z); }},
            {"3 planes", 6, {}, [=](FittingSet& s) { s.plane(q, m), s.plane(r, n), s.plane(p, X); }},
            {"3 planes, a prism",
             5,
             {slide(Z)},
             [=](FittingSet& s) { s.plane(q, X), s.plane(r, X + Y), s.plane(p, Y - 2 * X); }},
            {"3 planes, two parallel", 5, {slide(m.cross(n))}, [=](FittingSet& s) {
                 s.plane(q, m), s.plane(r, m), s.plane(p, n);
             }}};
}

std::vector<KnownSet> lines()
{
    const Vector3d q(1, -1, 2), r(-2, 1, 0), u(1, 2, 3), v(-1, 2, 0.5);
    return {
        {"1 line", 4, {slide(u), turn(u, q)}, [=](FittingSet& s) { s.line(q, u); }},
        {"1 line twice", 4, {slide(u), turn(u, q)}, [=](FittingSet& s) { s.line(q, u), s.line(q + u, -u); }},
        {"2 skew lines", 6, {}, [=](FittingSet& s) { s.line(q, u), s.line(r, v); }},
        {"2 crossing lines", 6, {}, [=](FittingSet& s) { s.line(q, u), s.line(q + u, v); }},
        {"2 perpendicular skew lines", 6, {}, [=](FittingSet& s) { s.line(q, X), s.line(r, Z); }},
        {"2 parallel lines", 5, {slide(u)}, [=](FittingSet& s) { s.line(q, u), s.line(r, u); }},
        {"line and plane", 6, {}, [=](FittingSet& s) { s.line(q, u), s.plane(r, v); }},
        {"line and perpendicular plane",
         5,
         {turn(u, q)},
         [=](FittingSet& s) { s.line(q, u), s.plane(r, u); }},
        {"line and parallel plane", 5, {slide(X)}, [=](FittingSet& s) { s.line(q, X), s.plane(r, Z); }},
        {"line in its plane", 5, {slide(X)}, [=](FittingSet& s) { s.line(q, X), s.plane(q, Z); }}};
}

std::vector<KnownSet> points_and_primitives()
{
    const Vector3d a(1, 2, -1), b(-2, 1, 1), q(1, -1, 2), r(-2, 1, 0), u(1, 2, 3), n(-1, 2, 0.5);
    return {{"point and line", 6, {}, [=](FittingSet& s) { s.point(a), s.line(q, u); }},
            {"point on the line", 5, {turn(u, q)}, [=](FittingSet& s) { s.point(q + 2 * u), s.line(q, u); }},
            {"2 points and the line through them",
             5,
             {turn(b - a, a)},
             [=](FittingSet& s) { s.point(a), s.point(b), s.line(0.5 * (a + b), b - a); }},
            {"2 points and a parallel line",
             6,
             {},
             [=](FittingSet& s) { s.point(a), s.point(b), s.line(q, b - a); }},
            {"point and plane", 5, {turn(n, a)}, [=](FittingSet& s) { s.point(a), s.plane(q, n); }},
            {"point in the plane", 5, {turn(n, q)}, [=](FittingSet& s) { s.point(q), s.plane(q, n); }},
            {"point and 2 parallel planes",
             5,
             {turn(n, a)},
             [=](FittingSet& s) { s.point(a), s.plane(q, n), s.plane(r, n); }},
            {"point and 2 planes", 6, {}, [=](FittingSet& s) { s.point(a), s.plane(q, n), s.plane(r, u); }},
            {"2 points and a plane", 6, {}, [=](FittingSet& s) { s.point(a), s.point(b), s.plane(q, n); }},
            {"2 points and a perpendicular plane", 5, {turn(b - a, a)}, [=](FittingSet& s) {
                 s.point(a), s.point(b), s.plane(q, b - a);
             }}};
}

std::vector<KnownSet> points_on_lines()
{
    const Vector3d a(1, 2, -1), b(-2, 1, 1), c(2, -2, 0.5), u(1, 2, 3), v(-1, 2, 0.5), w(2, 1, -1);
    return {
        {"1 point on a line",
         2,
         {slide(u), turn(X, a), turn(Y, a), turn(Z, a)},
         [=](FittingSet& s) { s.point_on_line(a, u); }},
        {"2 points on lines", 4, {}, [=](FittingSet& s) { s.point_on_line(a, u), s.point_on_line(b, v); }},
        {"3 points on lines",
         6,
         {},
         [=](FittingSet& s) { s.point_on_line(a, u), s.point_on_line(b, v), s.point_on_line(c, w); }},
        {"3 points on parallel lines",
         5,
         {slide(u)},
         [=](FittingSet& s) { s.point_on_line(a, u), s.point_on_line(b, u), s.point_on_line(c, u); }},
        {"2 points on one line",
         4,
         {slide(b - a), turn(b - a, a)},
         [=](FittingSet& s) { s.point_on_line(a, b - a), s.point_on_line(b, b - a); }},
        {"point and point on a line",
         5,
         {turn(b - a, a)},
         [=](FittingSet& s) { s.point(a), s.point_on_line(b, u); }},
        {"point and 2 points on lines",
         6,
         {},
         [=](FittingSet& s) { s.point(a), s.point_on_line(b, u), s.point_on_line(c, v); }},
        {"2 points and point on a line",
         6,
         {},
         [=](FittingSet& s) { s.point(a), s.point(b), s.point_on_line(c, v); }},
        {"line and point on a line", 6, {}, [=](FittingSet& s) { s.line(a, u), s.point_on_line(b, v); }},
        {"plane and point on a line",
         5,
         {turn(w, b)},
         [=](FittingSet& s) { s.plane(a, w), s.point_on_line(b, v); }},
        {"plane and 2 points on lines",
         6,
         {},
         [=](FittingSet& s) { s.plane(a, w), s.point_on_line(b, v), s.point_on_line(c, u); }},
    };
}

void on_planes(FittingSet& s, size_t n)
{
    const Vector3d q[] = {{1, 2, -1},   {-2, 1, 1}, {2, -2, 0.5}, {0, 1, 2},
                          {-1, -2, -1}, {2, 1, 1},  {0, 0, -2}},
                   normals[] = {{1, 2, 3},   {-1, 2, 0.5}, {2, 1, -1}, {0, 1, 2},
                                {3, 1, 0.5}, {1, -1, 0},   {1, 0, 4}};
    for (size_t i = 0; i < n; i++) s.point_on_plane(q[i], normals[i]);
}

std::vector<KnownSet> points_on_planes()
{
    const Vector3d a(1, 2, -1), b(-2, 1, 1), c(2, -2, 0.5), n(1, 2, 3), m(-1, 2, 0.5), w(2, 1, -1);
    const Vector3d f(0, 0, 1);
    return {
        {"1 point on a plane",
         1,
         {slide(X), slide(Y), turn(X, a), turn(Y, a), turn(Z, a)},
         [=](FittingSet& s) { s.point_on_plane(a, Z); }},
        {"2 points on planes", 2, {}, [=](FittingSet& s) { on_planes(s, 2); }},
        {"3 points on planes", 3, {}, [=](FittingSet& s) { on_planes(s, 3); }},
        {"4 points on planes", 4, {}, [=](FittingSet& s) { on_planes(s, 4); }},
        {"5 points on planes", 5, {}, [=](FittingSet& s) { on_planes(s, 5); }},
        {"6 points on planes", 6, {}, [=](FittingSet& s) { on_planes(s, 6); }},
        {"7 points on planes", 6, {}, [=](FittingSet& s) { on_planes(s, 7); }},
        {"3 points on one plane",
         3,
         {slide(X), slide(Y), turn(Z, a)},
         [=](FittingSet& s)
         { s.point_on_plane(f, Z), s.point_on_plane(f + X, Z), s.point_on_plane(f + Y - X, Z); }},
        {"3 points in line on one plane",
         2,
         {slide(X), slide(Y), turn(Z, f), turn(X, f)},
         [=](FittingSet& s)
         { s.point_on_plane(f, Z), s.point_on_plane(f + X, Z), s.point_on_plane(f - 2 * X, Z); }},
        {"3, 2 and 1 points on three planes",
         6,
         {},
         [=](FittingSet& s)
         {
             s.point_on_plane(f, Z), s.point_on_plane(f + X, Z), s.point_on_plane(f + Y, Z);
             s.point_on_plane(a, X), s.point_on_plane(a + Y, X), s.point_on_plane(b, Y);
         }},
        {"point and point on a plane",
         4,
         {turn(b - a, a), turn(n, a)},
         [=](FittingSet& s) { s.point(a), s.point_on_plane(b, n); }},
        {"point and 2 points on planes",
         5,
         {turn((b - a).cross(n).cross((c - a).cross(m)), a)},
         [=](FittingSet& s) { s.point(a), s.point_on_plane(b, n), s.point_on_plane(c, m); }},
        {"point and 3 points on planes",
         6,
         {},
         [=](FittingSet& s)
         { s.point(a), s.point_on_plane(b, n), s.point_on_plane(c, m), s.point_on_plane(c + X, w); }},
        {"2 points and point on a plane",
         6,
         {},
         [=](FittingSet& s) { s.point(a), s.point(b), s.point_on_plane(c, n); }},
        {"line and point on a plane",
         5,
         {screw(n, a)},
         [=](FittingSet& s) { s.line(a, n), s.point_on_plane(b, m); }},
        {"line and 2 points on planes",
         6,
         {},
         [=](FittingSet& s) { s.line(a, n), s.point_on_plane(b, m), s.point_on_plane(c, w); }},
        {"plane and 1 point on a plane",
         4,
         {},
         [=](FittingSet& s) { s.plane(a, Z), s.point_on_plane(b, X + Z); }},
        {"plane and 2 points on walls",
         5,
         {turn(Z, {-2, 1, 0})},
         [=](FittingSet& s) {
             s.plane(a, Z), s.point_on_plane(b, X), s.point_on_plane({-2, -2, 0.5}, Y);
         }},
        {"plane and 2 points on parallel walls",
         5,
         {slide(Y)},
         [=](FittingSet& s) { s.plane(a, Z), s.point_on_plane(b, X), s.point_on_plane(c, X); }},
        {"plane and 3 points on walls",
         6,
         {},
         [=](FittingSet& s)
         { s.plane(a, Z), s.point_on_plane(b, X), s.point_on_plane(c, Y), s.point_on_plane(a, X + Y); }},
    };
}

std::vector<KnownSet> points_on_both()
{
    const Vector3d a(1, 2, -1), c(2, -2, 0.5), n(1, 2, 3), w(2, 1, -1);
    return {
        {"point on a line and 3 on planes",
         5,
         {},
         [=](FittingSet& s) { s.point_on_line(a, n), on_planes(s, 3); }},
        {"point on a line and 4 on planes",
         6,
         {},
         [=](FittingSet& s) { s.point_on_line(c, w), on_planes(s, 4); }},
        {"2 points on lines and 2 on planes",
         6,
         {},
         [=](FittingSet& s) {
             s.point_on_line(c, w), s.point_on_line({0, -2, 1}, X), on_planes(s, 2);
         }},
    };
}

/// The table: which kinds and counts of pairings determine what.
std::vector<KnownSet> table()
{
    std::vector<KnownSet> all;
    for (const auto& part : {points(), planes(), lines(), points_and_primitives(), points_on_lines(),
                             points_on_planes(), points_on_both()})
        all.insert(all.end(), part.begin(), part.end());
    return all;
}

class MinimalSet : public testing::TestWithParam<KnownSet>
{
 protected:
    /// `swapped`: directions of lines have a sign and those of normals have none.
    static FittingSet made(uint64_t seed, bool swapped = false)
    {
        FittingSet s(seed);
        if (swapped) s.signs.ln2ln_sign = DirectionSign::Oriented, s.signs.pl2pl_sign = DirectionSign::Free;
        GetParam().build(s);
        return s;
    }
    static bool has_directions(const Pairings& p)
    {
        return !p.paired_ln2ln.empty() || !p.paired_pl2pl.empty();
    }
};

/// A turn by `angle` about the mean of the local positions, which moves by `distance`.
CPose3D displaced(const FittingSet& s, double angle, double distance, SeededRandom& random)
{
    const Vector3d centre = transformed(s.truth, local_centroid(s.pairings)), u = random_direction(random);
    const CPose3D turned = moved_about(s.truth, u, centre, angle, 0);
    return make_pose(rotation_of(turned), translation_of(turned) + distance * random_direction(random));
}

/** Do closed forms, given a guess, find the rotation from vectors of which some are projections at that
 * guess? Then they are exact at an exact guess only. (With fewer than two vectors the rows decide.)
 */
bool uses_projections(const Pairings& p)
{
    const size_t projected = p.paired_pt2ln.size() + p.paired_pt2pl.size(),
                 positions = p.paired_pt2pt.size() + projected;
    return projected > 0 && positions + p.paired_ln2ln.size() + p.paired_pl2pl.size() > 2;
}

std::string of(const NamedSolver& solver, uint64_t seed)
{
    return solver.name + ", seed " + std::to_string(seed);
}
}  // namespace

TEST_P(MinimalSet, IsSolvedWithoutAGuessNearestToTheIdentity)
{
    for (uint64_t seed = 1; seed <= repetitions(1, 10); seed++)
        for (const auto& solver : all_solvers())
        {
            SCOPED_TRACE(of(solver, seed));
            const FittingSet s = made(seed);
            OptimalTF_Result r;
            ASSERT_TRUE(solver.solve(s, std::nullopt, r));
            EXPECT_LT(residual_rms(s, r.optimalPose), 1e-11 * s.size);
            expect_described(s, r, GetParam().rank);
            expect_kept_rotation(r, CPose3D(), KEPT);
            expect_kept_centroid(s, r, CPose3D(), 1e-10 * s.size);
            expect_nothing_nearer(s, r, CPose3D());
        }
}

TEST_P(MinimalSet, LeavesAnExactGuessAndWhatTheorySays)
{
    for (uint64_t seed = 21; seed <= 20 + repetitions(1, 20); seed++)
        for (const bool swapped : {false, true})
            for (const auto& solver : all_solvers())
            {
                const FittingSet s = made(seed, swapped);
                if (swapped && !has_directions(s.pairings)) continue;
                SCOPED_TRACE(of(solver, seed));
                OptimalTF_Result r;
                ASSERT_TRUE(solver.solve(s, s.truth, r));
                EXPECT_LT(rotation_between(s.truth, r.optimalPose).norm(), 1e-9);
                EXPECT_LT((translation_of(r.optimalPose) - translation_of(s.truth)).norm(), 1e-9 * s.size);
                expect_described(s, r, GetParam().rank);
                if (!GetParam().free.empty()) expect_known_motions(s, r, GetParam().free, 1e-4);
            }
}

TEST_P(MinimalSet, IsSolvedFromAGuessThatIsKeptWhereItIsFree)
{
    for (uint64_t seed = 11; seed <= 10 + repetitions(1, 20); seed++)
        for (const bool swapped : {false, true})
            for (const auto& solver : all_solvers())
            {
                const FittingSet s = made(seed, swapped);
                if (swapped && !has_directions(s.pairings)) continue;
                if (!solver.descends && uses_projections(s.pairings)) continue;
                SCOPED_TRACE(of(solver, seed));
                SeededRandom random(seed);
                const CPose3D guess = displaced(s, solver.descends ? 0.1 : 0.8, 1, random);
                OptimalTF_Result r;
                ASSERT_TRUE(solver.solve(s, guess, r));
                EXPECT_LT(residual_rms(s, r.optimalPose), 1e-11 * s.size);
                expect_described(s, r, GetParam().rank);
                expect_kept_centroid(s, r, guess, 1e-10 * s.size);
                if (solver.descends) continue;
                expect_kept_rotation(r, guess, KEPT);
                expect_nothing_nearer(s, r, guess);
            }
}

TEST_P(MinimalSet, GaussNewtonKeepsTheRotationOfTheGuessWhereItIsFree)
{
    for (uint64_t seed = 31; seed <= 30 + repetitions(2, 20); seed++)
    {
        SCOPED_TRACE(seed);
        const FittingSet s = made(seed);
        SeededRandom random(seed);
        const CPose3D guess = displaced(s, 0.1, 0.3, random);
        OptimalTF_Result r;
        ASSERT_TRUE(gauss_newton_solver().solve(s, guess, r));
        expect_kept_rotation(r, guess, KEPT);
        expect_nothing_nearer(s, r, guess);
    }
}

/// Turning the global frame turns what counts as the identity: each way the nearest exact pose must be found.
TEST_P(MinimalSet, OfSeveralExactPosesTheNearestToTheIdentityIsFound)
{
    if (GetParam().rank < 6) return;  // followed along their free motions above
    for (uint64_t seed = 41; seed <= 40 + repetitions(1, 10); seed++)
        for (const bool by_descent : {false, true})
        {
            SCOPED_TRACE(seed);
            SeededRandom random(seed);
            std::vector<Matrix3d> turns, found;
            for (int k = 0; k < 8; k++)
            {
                turns.push_back(k ? any_rotation(random) : Matrix3d(Matrix3d::Identity()));
                FittingSet s(seed);
                const CPose3D turn = make_pose(turns.back(), Vector3d::Zero());
                s.in_global = turn + s.in_global, s.truth = turn + s.truth;
                GetParam().build(s);
                OptimalTF_Result r;
                ASSERT_TRUE((by_descent ? gauss_newton_solver() : horn_solver()).solve(s, std::nullopt, r));
                found.push_back(turns.back().transpose() * rotation_of(r.optimalPose));
            }
            for (size_t i = 0; i < turns.size(); i++)
                for (const Matrix3d& other : found)
                    EXPECT_LT(angle_between(turns[i] * found[i], Matrix3d::Identity()),
                              angle_between(turns[i] * other, Matrix3d::Identity()) + 1e-6);
        }
}

INSTANTIATE_TEST_SUITE_P(Table, MinimalSet, testing::ValuesIn(table()),
                         [](const auto& row)
                         {
                             std::string name;
                             for (const char c : row.param.name)
                                 if (std::isalnum(static_cast<unsigned char>(c))) name += c;
                             return name;
                         });
