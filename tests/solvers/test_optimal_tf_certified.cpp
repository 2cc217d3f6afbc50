#include <mp2p_icp/optimal_tf_certified.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>

#include <map>

#include "certified_test_tools.h"
#include "degenerate_sets.h"
#include "exact_mixes.h"
#include "pose_minimiser.h"
#include "test_repetitions.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

CertifiedParameters signs_of(const ExactMix& mix)
{
    CertifiedParameters p;
    p.weights.pair_weights.pl2pl_sign = mix.normals;
    return p;
}
CertifiedResult solved(const Pairings& in, const CertifiedParameters& p = {})
{
    CertifiedResult r;
    EXPECT_TRUE(optimal_tf_certified(in, r, p));
    return r;
}
/// All minima of a set that cost as little as the lowest.
std::vector<PoseMinimum> lowest(const CertifiedResult& r)
{
    std::vector<PoseMinimum> out;
    for (const auto& m : r.minima)
        if (m.cost <= r.cost + 1e-9 * r.scale) out.push_back(m);
    return out;
}
/// What rounding of sums makes of costs: 1e-15 of the cost of a typical pose, some dozen times.
double rounding(const CertifiedResult& r)
{
    return 1e-12 * (r.scale + r.cost);
}

/// Calls f(pairings, parameters) for sets of all mixes, sizes up to a hundred, and noises up to 30 % of the
/// scene.
template <class F>
void for_all_mixes(size_t rounds, uint64_t seed, double most_noise, const F& f)
{
    SeededRandom random(seed);
    for (size_t round = 0; round < rounds; round++)
        for (const auto& mix : exact_mixes())
            for (const Mix* size : {&mix.minimal.back(), &mix.one_more.back(), &mix.ten, &mix.hundred})
                for (const double noise : {0.0, 0.01, 0.1, 0.3})
                {
                    if (noise > most_noise) continue;
                    SCOPED_TRACE(std::string(mix.name) + ", noise " + std::to_string(noise) + ", round " +
                                 std::to_string(round) + ", seed " + std::to_string(seed));
                    f(random_pairings(*size, any_rotation(random), random_point(random, 20), random,
                                      5 * noise),
                      signs_of(mix));
                }
}
}  // namespace

// ---- Against other solvers --------------------------------------------------------------------------------

TEST(OptimalTfCertified, IsProvenAndNoOtherSolverFindsLess)
{
    size_t sets = 0, proven = 0;
    std::map<GlobalVerdict, size_t> verdicts;
    for_all_mixes(repetitions(2, 50), 1, 1,
                  [&](const Pairings& pairings, const CertifiedParameters& p)
                  {
                      const CertifiedResult r = solved(pairings, p);
                      sets++, proven += r.gap <= 1e-9 * r.scale, verdicts[r.verdict]++;
                      const PoseQuadratic sums = pose_quadratic(pairings, p.weights.pair_weights);
                      // More where the translation is known badly.
                      EXPECT_NEAR(sums.cost(r.optimalPose), r.cost, rounding(r) + sums_rounding(sums));
                      OptimalTF_Result other;
                      ASSERT_TRUE(optimal_tf_horn(pairings, p.weights, other));
                      EXPECT_GE(sums.cost(other.optimalPose), r.cost - r.gap - rounding(r)) << "Horn";
                      ASSERT_TRUE(optimal_tf_olae(pairings, p.weights, other));
                      EXPECT_GE(sums.cost(other.optimalPose), r.cost - r.gap - rounding(r)) << "OLAE";
                      OptimalTF_GN_Parameters gn;
                      gn.pairWeights = p.weights.pair_weights, gn.maxInnerLoopIterations = 50;
                      ASSERT_TRUE(optimal_tf_gauss_newton(pairings, other, gn));
                      // From the best of all rotations it stays there.
                      EXPECT_NEAR(sums.cost(other.optimalPose), r.cost, r.gap + 1e-9 * r.scale)
                          << "Gauss-Newton";
                  });
    // Where the translation is known very badly, the gap's allowance for rounding may be above the tolerance.
    EXPECT_GE(static_cast<double>(proven), 0.999 * static_cast<double>(sets)) << proven << " of " << sets;
    EXPECT_EQ(verdicts[GlobalVerdict::Gap], sets - proven);
    EXPECT_GT(verdicts[GlobalVerdict::Global], sets / 2);
    EXPECT_GT(verdicts[GlobalVerdict::GlobalAmbiguous], sets / 20) << "minimal sets have several poses";
}

TEST(OptimalTfCertified, OfPointsIsHorns)
{
    SeededRandom random(2);
    for (int k = 0; k < 100; k++)
    {
        const Pairings p =
            random_pairings({20, 0, 0, 0, 0}, any_rotation(random), random_point(random, 20), random, 0.5);
        OptimalTF_Result horn;
        ASSERT_TRUE(optimal_tf_horn(p, {}, horn));
        const CertifiedResult r = solved(p);
        EXPECT_EQ(r.verdict, GlobalVerdict::Global);
        EXPECT_LT(rotation_between(horn.optimalPose, r.optimalPose).norm(), 1e-12);
        EXPECT_LT((translation_of(horn.optimalPose) - translation_of(r.optimalPose)).norm(), 1e-11);
        EXPECT_GT(r.margin, 0.1);
    }
}

TEST(OptimalTfCertified, ManyRandomPosesNeverFitBetterThanTheMarginSays)
{
    for_all_mixes(
        1, 3, 1,
        [](const Pairings& pairings, const CertifiedParameters& p)
        {
            const CertifiedResult r = solved(pairings, p);
            const PoseQuadratic sums = pose_quadratic(pairings, p.weights.pair_weights);
            SeededRandom random(4);
            for (int k = 0; k < 50; k++)
            {
                const Matrix3d R = any_rotation(random);
                const double cost = sums.cost(OriginPose{R, sums.best_translation(R, Vector3d::Zero())}),
                             half = 0.5 * angle_between(R, rotation_of(r.optimalPose));
                EXPECT_GE(cost, r.cost +
                                    std::max(0.0, r.margin) * r.scale * (1 - std::pow(std::cos(half), 4)) -
                                    r.gap - rounding(r));
            }
        });
}

// ---- Sets with several best poses, or none ----------------------------------------------------------------

namespace
{
struct Ambiguous
{
    const char* name;
    GlobalVerdict verdict;
    size_t lowest;  ///< how many minima cost least
    std::function<void(FittingSet&)> build;
    bool free_normals = false;
};
void PrintTo(const Ambiguous& a, std::ostream* out)
{
    *out << a.name;
}
const Vector3d X = Vector3d::UnitX(), Y = Vector3d::UnitY(), Z = Vector3d::UnitZ();

const std::vector<Ambiguous> AMBIGUOUS = {
    // Half turns about the three axes, as directions have no sign and the planes meet at one point.
    {"three orthogonal planes without sign", GlobalVerdict::GlobalAmbiguous, 4,
     [](FittingSet& s) {
         s.plane({0, 0, 0}, X), s.plane({0, 0, 0}, Y), s.plane({0, 0, 0}, Z);
     },
     true},
    {"three orthogonal planes with sign", GlobalVerdict::Global, 1,
     [](FittingSet& s) {
         s.plane({0, 0, 0}, X), s.plane({0, 0, 0}, Y), s.plane({0, 0, 0}, Z);
     }},
    // Half a turn about their common perpendicular.
    {"two skew lines", GlobalVerdict::GlobalAmbiguous, 2,
     [](FittingSet& s) {
         s.line({0, 0, 1}, X), s.line({0, 0, -1}, X + 2 * Y);
     }},
    // The half turns about both lines, too: each keeps the other as a set, turned around.
    {"two lines that cross at right angles", GlobalVerdict::GlobalAmbiguous, 4,
     [](FittingSet& s) {
         s.line({0, 0, 0}, X), s.line({0, 0, 0}, Y);
     }},
    {"three skew lines", GlobalVerdict::Global, 1,
     [](FittingSet& s) {
         s.line({0, 0, 1}, X), s.line({0, 1, -1}, X + 2 * Y), s.line({1, 0, 0}, Y + Z);
     }},
    {"a point and a line", GlobalVerdict::GlobalAmbiguous, 2,
     [](FittingSet& s) {
         s.point({0, 1, 0}), s.line({0, 0, 0}, X);
     }},
    // Each point has its wall: half turns about the three axes keep them there.
    {"points on three orthogonal walls through one corner", GlobalVerdict::GlobalAmbiguous, 4,
     [](FittingSet& s)
     {
         for (const auto& n : {X, Y, Z})
             for (const auto& p : {X, Y, Z})
                 if (n != p) s.point_on_plane(p, n), s.point_on_plane(-p, n);
     }},
    {"one point", GlobalVerdict::Unobservable, 1,
     [](FittingSet& s) {
         s.point({1, 2, 3});
     }},
    {"two points", GlobalVerdict::Unobservable, 1, [](FittingSet& s) { s.point(X), s.point(-Y); }},
    {"collinear points", GlobalVerdict::Unobservable, 1,
     [](FittingSet& s)
     {
         for (int i = 0; i < 10; i++) s.point(0.3 * i * X + Y);
     }},
    {"one plane", GlobalVerdict::Unobservable, 1,
     [](FittingSet& s) {
         s.plane({0, 0, 1}, Z);
     }},
    {"parallel planes", GlobalVerdict::Unobservable, 1,
     [](FittingSet& s)
     {
         for (int i = 0; i < 5; i++) s.plane(i * Z, Z);
     }},
    // A half turn across them would keep their directions, but not their places.
    {"parallel lines", GlobalVerdict::Unobservable, 1,
     [](FittingSet& s)
     {
         for (int i = 0; i < 5; i++) s.line({0, std::cos(i), std::sin(2. * i)}, X);
     }},
    {"a corridor", GlobalVerdict::Unobservable, 1,
     [](FittingSet& s)
     {
         for (const auto& n : {Y, Vector3d(-Y), Z, Vector3d(-Z)}) s.plane(n, n);
     }},
    {"points in a plane", GlobalVerdict::Global, 1,
     [](FittingSet& s)
     {
         for (int i = 0; i < 10; i++) s.point(s.within_plane(Z));
     }},
};

class AmbiguousSet : public ::testing::TestWithParam<Ambiguous>
{
};
}  // namespace

TEST_P(AmbiguousSet, HasTheVerdictAndAllItsPosesAreListed)
{
    for (uint64_t seed = 1; seed <= repetitions(5, 100); seed++)
    {
        SCOPED_TRACE(seed);
        FittingSet s(seed);
        if (GetParam().free_normals) s.signs.pl2pl_sign = DirectionSign::Free;
        GetParam().build(s);
        CertifiedParameters p;
        p.weights.pair_weights = s.signs, p.all_minima = true, p.guess = s.truth;
        const CertifiedResult r = solved(s.pairings, p);
        EXPECT_EQ(to_string(r.verdict), to_string(GetParam().verdict));
        EXPECT_LE(r.gap, 1e-9 * r.scale + 1e-12);
        const auto all = lowest(r);
        EXPECT_EQ(all.size(), GetParam().lowest);
        for (const auto& m : all) EXPECT_LT(residual_rms(s, m.pose), 1e-6 * s.size) << "that pose fits";
        for (size_t i = 0; i < all.size(); i++)
            for (size_t j = 0; j < i; j++)
                EXPECT_GT(rotation_between(all[i].pose, all[j].pose).norm(), 1e-3) << "they are different";
        EXPECT_LT(rotation_between(r.optimalPose, s.truth).norm(), 1e-6) << "the guess is one of them";
        EXPECT_EQ(r.free.empty(), GetParam().verdict != GlobalVerdict::Unobservable);
        for (const auto& f : r.free) EXPECT_LT(f.information_ratio, 1e-8);
    }
}
INSTANTIATE_TEST_SUITE_P(Table, AmbiguousSet, ::testing::ValuesIn(AMBIGUOUS),
                         [](const auto& set)
                         {
                             std::string name = set.param.name;
                             std::replace(name.begin(), name.end(), ' ', '_');
                             return name;
                         });

TEST(OptimalTfCertified, OfEqualMinimaTheNearestToTheGuessIsChosen)
{
    FittingSet s(7);
    s.line({0, 0, 1}, X), s.line({0, 0, -1}, X + 2 * Y);
    CertifiedParameters p;
    p.all_minima = true;
    const auto both = lowest(solved(s.pairings, p));
    ASSERT_EQ(both.size(), 2u);
    for (const auto& m : both)
    {
        p.guess = make_pose(rotation_about(X + Y, 0.3) * rotation_of(m.pose), Vector3d(1, 2, 3));
        EXPECT_LT(rotation_between(solved(s.pairings, p).optimalPose, m.pose).norm(), 1e-9);
    }
}

// ---- Scales, offsets, weights, bad numbers ----------------------------------------------------------------

TEST(OptimalTfCertified, ScalesWithTheUnitOfLength)
{
    SeededRandom random(11);
    for (const double unit : {1e-6, 1e-3, 1e3, 1e6})
        for (int k = 0; k < 10; k++)
        {
            SCOPED_TRACE(unit);
            const uint64_t seed = random.index(1000000);
            const auto at_scale = [&](double scale)
            {
                SeededRandom same(seed);
                const Matrix3d R = any_rotation(same);
                return solved(random_pairings({2, 2, 2, 2, 2}, R, scale * Vector3d(1, 2, 3), same,
                                              0.1 * scale, 5 * scale));
            };
            // Lines have base points within 3 m of each other whatever the size: costs need not scale
            // exactly.
            const CertifiedResult scaled = at_scale(unit);
            EXPECT_EQ(scaled.verdict, GlobalVerdict::Global);
            EXPECT_EQ(scaled.rank, 6);
            EXPECT_LE(scaled.gap, 1e-9 * scaled.scale);
        }
    const Pairings p = random_pairings({5, 0, 5, 0, 0}, any_rotation(random), {1, 2, 3}, random, 0.3);
    const CertifiedResult one = solved(p);
    for (const double unit : {1e-6, 1e6})
    {
        Pairings q = p;
        for (auto& x : q.paired_pt2pt) x.global *= unit, x.local *= unit;
        for (auto& x : q.paired_pt2pl) x.pl_global.centroid *= unit, x.pt_local *= unit;
        const CertifiedResult r = solved(q);
        EXPECT_EQ(r.verdict, one.verdict);
        EXPECT_LT(rotation_between(r.optimalPose, one.optimalPose).norm(), 1e-13);
        EXPECT_NEAR(r.cost, one.cost * unit * unit, 1e-12 * one.cost * unit * unit);
        EXPECT_NEAR(r.margin, one.margin, 1e-10);
    }
}

TEST(OptimalTfCertified, LosesOnlyItsCoordinatesFarAway)
{
    SeededRandom random(12);
    const Vector3d far(1e8, -1e8, 1e8);
    const double spacing = std::ldexp(1.0, -26);  // of doubles at 1e8: 1.5e-8
    for (const auto& mix : exact_mixes())
    {
        SCOPED_TRACE(mix.name);
        const Matrix3d R = any_rotation(random);
        const Pairings here = random_pairings(mix.hundred, R, {1, 2, 3}, random);
        Pairings there = here;
        const auto move = [&far](mrpt::math::TPoint3D& p) { p.x += far.x(), p.y += far.y(), p.z += far.z(); };
        for (auto& p : there.paired_pt2pt)
            p.global.x += far.x(), p.global.y += far.y(), p.global.z += far.z(), p.local.x += far.x(),
                p.local.y += far.y(), p.local.z += far.z();
        for (auto& p : there.paired_pt2ln) move(p.ln_global.pBase), move(p.pt_local);
        for (auto& p : there.paired_pt2pl) move(p.pl_global.centroid), move(p.pt_local);
        for (auto& p : there.paired_ln2ln) move(p.ln_global.pBase), move(p.ln_local.pBase);
        for (auto& p : there.paired_pl2pl) move(p.p_global.centroid), move(p.p_local.centroid);
        const CertifiedResult r = solved(there, signs_of(mix));
        EXPECT_EQ(r.verdict, GlobalVerdict::Global);
        EXPECT_EQ(r.rank, 6);
        const PoseQuadratic sums = pose_quadratic(there, signs_of(mix).weights.pair_weights);
        EXPECT_LT(angle_between(rotation_of(r.optimalPose), R), 10 * spacing / 5);
        // The rotation is about the centroid: that is where the position is known.
        const Vector3d c = sums.b_centre, expected = R * (c - far) + Vector3d(1, 2, 3) + far;
        EXPECT_LT((transformed(r.optimalPose, c) - expected).norm(), 10 * spacing);
    }
}

TEST(OptimalTfCertified, SpreadWeightsAreProvenOrSaidToBeNot)
{
    SeededRandom random(13);
    size_t sets = 0, proven = 0;
    for (const double weight : {1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9})
        for (size_t k = 0; k < repetitions(30, 2000); k++)
        {
            SCOPED_TRACE(weight);
            const Pairings p = random_pairings({3, 2, 2, 2, 2}, any_rotation(random), {1, 2, 3}, random, 0.3);
            CertifiedParameters parameters;
            PairWeights& w = parameters.weights.pair_weights;
            w.pt2pt = weight, w.ln2ln_direction = 1 / weight, w.pl2pl_sign = DirectionSign::Free;
            const CertifiedResult r = solved(p, parameters);
            sets++, proven += r.verdict != GlobalVerdict::Gap;
            const PoseQuadratic sums = pose_quadratic(p, w);
            for (int i = 0; i < 5; i++)
            {
                OptimalTF_GN_Parameters gn;
                gn.pairWeights = w, gn.maxInnerLoopIterations = 30,
                gn.linearizationPoint = any_pose(random, 5);
                OptimalTF_Result other;
                optimal_tf_gauss_newton(p, other, gn);
                // Sums hold the light rows to 1e-15 of the heavy ones.
                EXPECT_GE(sums.cost(other.optimalPose), r.cost - r.gap - 1e-12 * (sums.K.trace() * 100));
            }
        }
    EXPECT_GE(static_cast<double>(proven), 0.99 * static_cast<double>(sets)) << proven << " of " << sets;
}

TEST(OptimalTfCertified, NumbersThatAreNotFiniteChangeNotABit)
{
    SeededRandom random(14);
    const Pairings good = random_pairings({4, 3, 3, 3, 3}, any_rotation(random), {1, 2, 3}, random, 0.1);
    Pairings bad = good;
    add_pair(bad, {1, 2, NaN}, {1, 2, 3});
    bad.paired_pt2ln.push_back({line({1, 2, 3}, {0, 0, 0}), {1, 2, 3}});
    const CertifiedResult a = solved(good), b = solved(bad);
    EXPECT_EQ(b.skipped, 2u);
    expect_same_bits(a.optimalPose, b.optimalPose);
    EXPECT_EQ(a.cost, b.cost);
    EXPECT_EQ(a.G, b.G);
}

TEST(OptimalTfCertified, NothingToSolveWithLeavesThePose)
{
    const CPose3D pose(1, 2, 3, 0.4, 0.5, 0.6);
    for (const double weight : {0.0, 1.0})
    {
        Pairings p;
        if (weight == 0) add_pair(p, {1, 2, 3}, {4, 5, 6});
        CertifiedParameters parameters;
        parameters.weights.pair_weights.pt2pt = weight;
        CertifiedResult r;
        r.optimalPose = pose;
        EXPECT_FALSE(optimal_tf_certified(p, r, parameters));
        EXPECT_EQ(r.status, SolveStatus::NoPairings);
        expect_same_bits(r.optimalPose, pose);
    }
}

TEST(OptimalTfCertified, MistakesOfTheCallerAreNamed)
{
    SeededRandom random(15);
    const Pairings p = random_pairings({4, 0, 0, 0, 0}, any_rotation(random), {1, 2, 3}, random);
    CertifiedResult r;
    const auto message = [&](const CertifiedParameters& parameters) -> std::string
    {
        try
        {
            optimal_tf_certified(p, r, parameters);
        }
        catch (const std::invalid_argument& e)
        {
            return e.what();
        }
        return "";
    };
    CertifiedParameters parameters;
    parameters.guess = CPose3D(NaN, 0, 0, 0, 0, 0);
    EXPECT_NE(message(parameters).find("guess"), std::string::npos);
    parameters = {}, parameters.tolerance = 0;
    EXPECT_NE(message(parameters).find("tolerance"), std::string::npos);
    parameters = {}, parameters.weights.pair_weights.pt2pt = -1;
    EXPECT_NE(message(parameters).find("weights"), std::string::npos);
    parameters = {}, parameters.prior.emplace();
    parameters.prior->cov_inv(0, 0) = -1;
    EXPECT_NE(message(parameters).find("prior"), std::string::npos);
}

TEST(OptimalTfCertified, IsTheSameBitsOnAnyNumberOfThreads)
{
    SeededRandom random(16);
    const Pairings p =
        random_pairings({3000, 1500, 1500, 1500, 1500}, any_rotation(random), {1, 2, 3}, random, 0.1);
    CertifiedResult one, many;
    with_threads(1, [&] { optimal_tf_certified(p, one); });
    for (const int threads : {2, 8})
    {
        with_threads(threads, [&] { optimal_tf_certified(p, many); });
        expect_same_bits(one.optimalPose, many.optimalPose);
        EXPECT_EQ(one.gap, many.gap);
        EXPECT_EQ(one.G, many.G);
    }
}

// ---- Sums, outliers, priors -------------------------------------------------------------------------------

TEST(OptimalTfCertified, OfSumsIsThatOfThePairingsBehindThem)
{
    SeededRandom random(21);
    PairWeights w;
    w.ln2ln_direction = 2, w.pl2pl_direction = 3;
    CertifiedParameters p;
    p.weights.pair_weights = w;
    for (int k = 0; k < 20; k++)
    {
        const Matrix3d R = any_rotation(random);
        const Pairings a = random_pairings({2, 1, 3, 1, 1}, R, {1, 2, 3}, random, 0.3),
                       b = random_pairings({1, 3, 1, 2, 1}, R, {1, 2, 3}, random, 0.3);
        Pairings both = a;
        both.push_back(b);
        PoseQuadratic sums = pose_quadratic(a, w);
        sums += pose_quadratic(b, w);
        CertifiedResult merged;
        ASSERT_TRUE(optimal_tf_certified(sums, merged));
        const CertifiedResult joint = solved(both, p);
        EXPECT_LT(rotation_between(joint.optimalPose, merged.optimalPose).norm(), 1e-11);
        EXPECT_LT((translation_of(joint.optimalPose) - translation_of(merged.optimalPose)).norm(), 1e-10);
        EXPECT_EQ(joint.verdict, merged.verdict);
        EXPECT_NEAR(joint.cost, merged.cost, 1e-11 * joint.scale);
    }
}

TEST(OptimalTfCertified, FindsOutliersByGraduatedNonConvexity)
{
    SeededRandom random(22);
    for (const auto kind : {OutlierRejection::GncTruncated, OutlierRejection::GncGemanMcClure})
    {
        const Matrix3d R = any_rotation(random);
        Pairings p = random_pairings({20, 0, 20, 0, 5}, R, {1, 2, 3}, random, 0.01);
        for (int i = 0; i < 10; i++)
            add_pair(p, R * random_point(random, 5) + Vector3d(1, 2, 3), random_point(random, 5));
        CertifiedParameters parameters;
        parameters.weights.outlier_rejection = kind, parameters.weights.outlier_threshold = 0.1;
        const CertifiedResult r = solved(p, parameters);
        std::vector<size_t> expected;
        for (size_t i = 20; i < 30; i++) expected.push_back(i);
        EXPECT_EQ(r.outliers.point2point, expected);
        EXPECT_EQ(r.outliers.size(), 10u);
        EXPECT_LT(angle_between(rotation_of(r.optimalPose), R), 0.01);
        EXPECT_EQ(r.verdict, GlobalVerdict::Global);
        EXPECT_LT(r.cost, 50 * 3 * 4 * 1e-4) << "of the weighted problem";
    }
}

TEST(OptimalTfCertified, APriorDeterminesWhatPairingsLeaveFree)
{
    FittingSet s(23);
    s.point(X), s.point(-Y);  // the turn about their line is free
    CertifiedParameters p;
    p.prior.emplace();
    p.prior->mean =
        make_pose(rotation_about(X + Y + 3 * Z, 0.5) * rotation_of(s.truth), translation_of(s.truth));
    for (int i = 3; i < 6; i++) p.prior->cov_inv(i, i) = 1e-6;
    const CertifiedResult r = solved(s.pairings, p);
    EXPECT_EQ(r.verdict, GlobalVerdict::Global) << "pairings and prior together";
    EXPECT_EQ(r.status, SolveStatus::UnderConstrained) << "the pairings alone";
    EXPECT_EQ(r.rank, 5);
    EXPECT_LT(residual_rms(s, r.optimalPose), 1e-5) << "the prior is weak";
    // Without it, the guess decides, and the same pose is the nearest but for the prior's metric.
    p.guess = p.prior->mean, p.prior.reset();
    const CertifiedResult guessed = solved(s.pairings, p);
    EXPECT_EQ(guessed.verdict, GlobalVerdict::Unobservable);
    EXPECT_LT(rotation_between(guessed.optimalPose, r.optimalPose).norm(), 0.1);
    EXPECT_GT(rotation_between(CPose3D(), r.optimalPose).norm(), 0.1);
}

TEST(OptimalTfCertified, AStrongPriorWins)
{
    SeededRandom random(24);
    const Pairings pairings = random_pairings({10, 0, 0, 0, 0}, any_rotation(random), {1, 2, 3}, random, 0.1);
    CertifiedParameters p;
    p.prior.emplace();
    p.prior->mean = CPose3D(4, 5, 6, 0.1, 0.2, 0.3);
    for (int i = 0; i < 6; i++) p.prior->cov_inv(i, i) = 1e9;
    const CertifiedResult r = solved(pairings, p);
    EXPECT_LT(rotation_between(r.optimalPose, p.prior->mean).norm(), 1e-4);
    EXPECT_LT((translation_of(r.optimalPose) - translation_of(p.prior->mean)).norm(), 1e-4);
    EXPECT_LE(r.gap, 1e-9 * r.scale);
}

TEST(OptimalTfCertified, WithAPriorThatDeterminesThePoseTheGuessSaysNothing)
{
    SeededRandom random(25);
    FittingSet s(25);
    s.plane({0, 0, 0}, Z);
    CertifiedParameters p;
    p.prior.emplace();
    p.prior->mean = make_pose(rotation_about(X, 0.2) * rotation_of(s.truth), translation_of(s.truth));
    for (int i = 0; i < 6; i++) p.prior->cov_inv(i, i) = 2;
    const CertifiedResult without = solved(s.pairings, p);
    EXPECT_EQ(without.verdict, GlobalVerdict::Global);
    for (int k = 0; k < 10; k++)
    {
        p.guess = any_pose(random);
        const CertifiedResult with = solved(s.pairings, p);
        EXPECT_LT(rotation_between(without.optimalPose, with.optimalPose).norm(), 1e-9);
        EXPECT_LT((translation_of(without.optimalPose) - translation_of(with.optimalPose)).norm(), 1e-8);
    }
}

TEST(OptimalTfCertified, AWeakPriorBreaksTies)
{
    FittingSet s(26);
    s.line({0, 0, 1}, X), s.line({0, 0, -1}, X + 2 * Y);
    CertifiedParameters p;
    p.all_minima = true;
    const auto both = lowest(solved(s.pairings, p));
    ASSERT_EQ(both.size(), 2u);
    for (const auto& m : both)
    {
        CertifiedParameters with;
        with.prior.emplace();
        with.prior->mean =
            make_pose(rotation_about(X + Y, 0.3) * rotation_of(m.pose), translation_of(m.pose));
        for (int i = 3; i < 6; i++) with.prior->cov_inv(i, i) = 1e-5;
        with.guess = both[0].pose;  // says nothing
        const CertifiedResult r = solved(s.pairings, with);
        EXPECT_EQ(r.verdict, GlobalVerdict::Global);
        EXPECT_LT(rotation_between(r.optimalPose, m.pose).norm(), 1e-4);
    }
}

TEST(OptimalTfCertified, OnePairingOfEachKindLeavesTheRestFree)
{
    const std::vector<std::pair<Mix, int>> ranks = {{{1, 0, 0, 0, 0}, 3},
                                                    {{0, 1, 0, 0, 0}, 2},
                                                    {{0, 0, 1, 0, 0}, 1},
                                                    {{0, 0, 0, 1, 0}, 4},
                                                    {{0, 0, 0, 0, 1}, 3}};
    SeededRandom random(27);
    for (const auto& [mix, rank] : ranks)
        for (int k = 0; k < 20; k++)
        {
            SCOPED_TRACE(std::to_string(rank) + ", round " + std::to_string(k));
            const Pairings p = random_pairings(mix, any_rotation(random), random_point(random, 20), random);
            CertifiedParameters parameters;
            parameters.guess = any_pose(random);
            const CertifiedResult r = solved(p, parameters);
            EXPECT_EQ(r.verdict, GlobalVerdict::Unobservable);
            EXPECT_EQ(r.status, SolveStatus::UnderConstrained);
            EXPECT_EQ(r.rank, rank);
            EXPECT_EQ(r.free.size(), static_cast<size_t>(6 - rank));
            EXPECT_LT(rows_of(p, {}).cost(r.optimalPose), 1e-24) << "one pairing can be fitted";
        }
}

TEST(OptimalTfCertified, ARobustKernelIsASetOfWeights)
{
    SeededRandom random(28);
    const Matrix3d R = any_rotation(random);
    Pairings p = random_pairings({20, 0, 0, 0, 0}, R, {1, 2, 3}, random, 0.05);
    for (int i = 0; i < 5; i++) add_pair(p, random_point(random, 5), random_point(random, 5));
    CertifiedParameters robust;
    robust.weights.robust_kernel = RobustKernel::GemanMcClure, robust.weights.robust_kernel_param = 0.2;
    robust.weights.currentEstimateForRobust = make_pose(R, {1, 2, 3});
    const CertifiedResult r = solved(p, robust);
    Pairings weighted = p;
    for (size_t i = 0; i < p.size(); i++)
    {
        const double square = (R * local_of(p, i) + Vector3d(1, 2, 3) - global_of(p, i)).squaredNorm();
        weighted.point_weights.emplace_back(1, robust_weight(RobustKernel::GemanMcClure, square, 0.2));
    }
    const CertifiedResult expected = solved(weighted);
    EXPECT_LT(rotation_between(expected.optimalPose, r.optimalPose).norm(), 1e-12);
    EXPECT_NEAR(r.cost, expected.cost, 1e-12 * expected.scale) << "what is certified is the weighted problem";
    EXPECT_EQ(to_string(r.verdict), "global");
    EXPECT_LT(angle_between(rotation_of(r.optimalPose), R), 0.02);
}

TEST(OptimalTfCertified, LightPairingsBesideVeryHeavyOnesAreSolvedToo)
{
    // One plane stops the motion along Z, the other one that along X, and the pose can fit both.
    for (const double light : {1e-6, 1e-9, 1e-11, 1e-12})
    {
        SCOPED_TRACE(light);
        FittingSet s(29);
        s.point_on_plane({1, 2, 0}, Z), s.point_on_plane({0, 1, 3}, X);
        s.pairings.pt2pl_weights = {{1, 1.0}, {1, light}};
        const CertifiedResult r = solved(s.pairings);
        const double cost = rows_of(s.pairings, s.signs).cost(r.optimalPose);
        // In double, sums of the heavy one are known to 1e-16 of what it costs elsewhere, some 1e3 m^2.
        EXPECT_LE(cost, r.gap + 1e-12) << "it can be 0, and the gap is proven";
        if (light > 1e-10)
        {
            EXPECT_LT(std::sqrt(cost / light), 1e-2) << "m beside the plane";
        }
    }
}

TEST(OptimalTfCertified, GraduatedNonConvexityKeepsTheGuessAlongWhatInliersLeaveFree)
{
    for (uint64_t seed = 1; seed <= 10; seed++)
    {
        SCOPED_TRACE(seed);
        FittingSet s(seed);
        for (int i = 0; i < 10; i++) s.plane({0, 0, 0}, Z);
        const Pairings inliers = s.pairings;
        for (int i = 0; i < 3; i++)
            add_pair(s.pairings, s.global(4 * Z + s.anywhere()), s.local(s.anywhere()));
        CertifiedParameters p;
        p.guess = make_pose(rotation_about(random_direction(s.random), 0.3) * rotation_of(s.truth),
                            translation_of(s.truth) + random_point(s.random, 0.5));
        const CertifiedResult expected = solved(inliers, p);
        p.weights.outlier_rejection = OutlierRejection::GncTruncated, p.weights.outlier_threshold = 0.05;
        const CertifiedResult r = solved(s.pairings, p);
        if (r.outliers.point2point.size() != 3) continue;  // chance may let one fit
        EXPECT_LT(rotation_between(expected.optimalPose, r.optimalPose).norm(), 1e-6);
        const Vector3d c = local_centroid(inliers);
        EXPECT_LT((transformed(expected.optimalPose, c) - transformed(r.optimalPose, c)).norm(), 1e-5);
    }
}

TEST(OptimalTfCertified, PointsInOnePlaceSayNothingOfTheRotation)
{
    for (uint64_t seed = 1; seed <= 40; seed++)
    {
        SCOPED_TRACE(seed);
        FittingSet s(seed);
        for (const auto& u : {X, Y, Vector3d(X + Y)}) s.point_on_line({1, 2, 3}, u);
        s.pairings.pt2ln_weights = {{1, 3.0}, {1, 0.7}, {1, 1.3}};  // their centroid is rounded
        CertifiedParameters p;
        p.guess = s.truth;
        const CertifiedResult r = solved(s.pairings, p);
        EXPECT_EQ(to_string(r.verdict), "unobservable");
        EXPECT_EQ(r.rank, 3);
        EXPECT_LT(rotation_between(s.truth, r.optimalPose).norm(), 1e-9) << "the guess is kept";
    }
}

TEST(OptimalTfCertified, MinimaOfANarrowValleyAreMinima)
{
    for (uint64_t seed = 1; seed <= repetitions(20, 300); seed++)
    {
        SCOPED_TRACE(seed);
        FittingSet s(seed);  // a small thing, and a plane that is paired metres away: information as 1 to 1e5
        const Vector3d n = random_direction(s.random);
        for (int i = 0; i < 6; i++) s.point(random_point(s.random, 0.01));
        s.plane(random_point(s.random, 0.01), n);
        CertifiedParameters p;
        EXPECT_EQ(to_string(solved(s.pairings, p).verdict), "global");
        p.all_minima = true;
        const CertifiedResult r = solved(s.pairings, p);
        EXPECT_EQ(to_string(r.verdict), "global");
        const Matrix10 Q = rows_of(s.pairings, {}).form();
        for (const auto& m : r.minima)
        {
            const Matrix3d R = rotation_of(m.pose);
            const Vector10 Qx = Q * stacked(R);
            const Matrix3d A = Eigen::Map<const Matrix3d>(Qx.data()) * R.transpose();
            const Vector3d slope(A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1));
            EXPECT_LT(2 * slope.norm(), 1e-7 * r.scale) << "of the minimum at " << m.cost - r.cost;
        }
    }
}

TEST(OptimalTfCertified, GraduatedNonConvexityOfAPriorWithoutPairingsEnds)
{
    CertifiedParameters p;
    p.prior.emplace();
    p.prior->mean = CPose3D(1, 2, 3, 0.1, 0.2, 0.3);
    for (int i = 0; i < 6; i++) p.prior->cov_inv(i, i) = 1;
    p.weights.outlier_rejection = OutlierRejection::GncTruncated;
    CertifiedResult r;
    const bool solved = optimal_tf_certified(Pairings(), r, p);
    if (solved)
    {
        EXPECT_LT(rotation_between(r.optimalPose, p.prior->mean).norm(), 1e-12);
    }
    else
    {
        expect_same_bits(r.optimalPose, CPose3D());
    }
    EXPECT_EQ(r.outliers.size(), 0u);
}
