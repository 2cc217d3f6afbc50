// OLAE against slow solutions of the same problems, written from the equations of the header: vectors one by
// one, frames turned for real instead of signs flipped in sums.
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>

#include <array>

#include "random_pairings.h"
#include "test_repetitions.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
constexpr std::array<OlaeSystem, 3> SYSTEMS = {OlaeSystem::Report, OlaeSystem::LeastSquares,
                                               OlaeSystem::Newton};
const Mix POINTS{20, 0, 0, 0, 0}, DIRECTIONS{8, 0, 0, 6, 7}, ALL{8, 5, 6, 7, 8};

OlaeParameters with(OlaeSystem system, bool normalize_points = true)
{
    OlaeParameters p;
    p.system = system, p.normalize_points = normalize_points;
    return p;
}

OptimalTF_Result solved(const Pairings& p, const OlaeParameters& how,
                        const std::optional<CPose3D>& guess = {}, const PairWeights& kinds = {})
{
    WeightParameters wp;
    wp.pair_weights = kinds;
    OptimalTF_Result result;
    EXPECT_TRUE(optimal_tf_olae(p, wp, result, guess, how));
    return result;
}
Matrix3d rotation(const OptimalTF_Result& r)
{
    return rotation_of(r.optimalPose);
}

// ---- The vectors, from the header's description
// -------------------------------------------------------------

struct VectorPair
{
    double w;
    Vector3d a, b;
};
using Vectors = std::vector<VectorPair>;

/// Points as the closed form sees them, not yet relative to centroids.
struct PointPairs
{
    Vectors paired;      ///< point pairings, and projections at the guess
    Vectors local_only;  ///< all local points, for L
};

Vector3d direction(const mrpt::math::TLine3D& l)
{
    return to_eigen(l.director).normalized();
}
Vector3d direction(const plane_patch_t& p)
{
    return Vector3d(p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]).normalized();
}

PointPairs points_of(const Pairings& p, const PairWeights& k, const std::optional<CPose3D>& guess)
{
    PointPairs out;
    const auto each = p.expanded_point_weights();
    for (size_t i = 0; i < each.size(); i++)
        out.paired.push_back({k.pt2pt * each[i], global_of(p, i), local_of(p, i)});
    out.local_only = out.paired;
    const auto add = [&](double w, const mrpt::math::TPoint3D& local, const auto& projected)
    {
        out.local_only.push_back({w, Vector3d::Zero(), to_eigen(local)});
        if (guess)
            out.paired.push_back({w, projected(to_eigen(guess->composePoint(local))), to_eigen(local)});
    };
    const auto ln = expanded_weights(p.pt2ln_weights, p.paired_pt2ln.size());
    for (size_t i = 0; i < ln.size(); i++)
    {
        const auto& l = p.paired_pt2ln[i].ln_global;
        const Vector3d q = to_eigen(l.pBase), u = direction(l);
        add(k.pt2ln * ln[i], p.paired_pt2ln[i].pt_local,
            [&](const Vector3d& x) -> Vector3d { return q + u * u.dot(x - q); });
    }
    const auto pl = expanded_weights(p.pt2pl_weights, p.paired_pt2pl.size());
    for (size_t i = 0; i < pl.size(); i++)
    {
        const auto& g = p.paired_pt2pl[i].pl_global;
        const Vector3d q = to_eigen(g.centroid), n = direction(g);
        add(k.pt2pl * pl[i], p.paired_pt2pl[i].pt_local,
            [&](const Vector3d& x) -> Vector3d { return x - n * n.dot(x - q); });
    }
    return out;
}

void centre(Vectors& v)
{
    VectorPair mean{0, Vector3d::Zero(), Vector3d::Zero()};
    for (const auto& x : v) mean.w += x.w, mean.a += x.w * x.a, mean.b += x.w * x.b;
    for (auto& x : v) x.a -= mean.a / mean.w, x.b -= mean.b / mean.w;
}

double rms_radius(Vectors local)
{
    centre(local);
    double w = 0, squares = 0;
    for (const auto& x : local) w += x.w, squares += x.w * x.b.squaredNorm();
    return std::sqrt(squares / w);
}

Vectors vectors_of(const Pairings& p, const OlaeParameters& how, const std::optional<CPose3D>& guess = {},
                   const PairWeights& k = {})
{
    PointPairs points = points_of(p, k, guess);
    const double L = rms_radius(points.local_only);
    Vectors out = points.paired;
    centre(out);
    if (how.normalize_points)
        for (auto& x : out) x.w *= L * L, x.a.normalize(), x.b.normalize();
    const auto add = [&](double w, const Vector3d& a, const Vector3d& b, DirectionSign sign)
    {
        const bool flip = sign == DirectionSign::Free && guess && a.dot(rotation_of(*guess) * b) < 0;
        out.push_back({w, a, flip ? Vector3d(-b) : b});
    };
    const auto lines = expanded_weights(p.ln2ln_weights, p.paired_ln2ln.size());
    for (size_t i = 0; i < lines.size(); i++)
        add(k.ln2ln_direction.value_or(k.ln2ln * L * L) * lines[i], direction(p.paired_ln2ln[i].ln_global),
            direction(p.paired_ln2ln[i].ln_local), k.ln2ln_sign);
    const auto planes = expanded_weights(p.pl2pl_weights, p.paired_pl2pl.size());
    for (size_t i = 0; i < planes.size(); i++)
        add(k.pl2pl_direction.value_or(k.pl2pl * L * L) * planes[i], direction(p.paired_pl2pl[i].p_global),
            direction(p.paired_pl2pl[i].p_local), k.pl2pl_sign);
    return out;
}

// ---- The three systems, slowly ----------------------------------------------------------------------------

Matrix3d profile(const Vectors& v)
{
    Matrix3d B = Matrix3d::Zero();
    for (const auto& x : v) B += x.w * x.a * x.b.transpose();
    return B;
}

/// Frame 0 is as it is, 1 to 3 turn the local vectors by half a turn about x, y, z.
Matrix3d half_turn(int frame)
{
    return frame == 0 ? Matrix3d(Matrix3d::Identity()) : rotation_about(Vector3d::Unit(frame - 1), M_PI);
}
Vectors turned(Vectors v, int frame)
{
    for (auto& x : v) x.b = half_turn(frame) * x.b;
    return v;
}
Matrix3d from_gibbs(const Vector3d& g, int frame)
{
    const Matrix3d R = Eigen::Quaterniond(1, g.x(), g.y(), g.z()).normalized().toRotationMatrix();
    return R * half_turn(frame);
}

struct FrameSolution
{
    double determinant = 0;
    Matrix3d R;
};

/// The report's system with `lambda` in the place of sum w.
FrameSolution report_in_frame(const Vectors& v, double lambda, int frame)
{
    const Vectors here = turned(v, frame);
    const Matrix3d B = profile(here);
    Vector3d z = Vector3d::Zero();
    for (const auto& x : here) z += x.w * x.b.cross(x.a);
    const Matrix3d M = (lambda + B.trace()) * Matrix3d::Identity() - B - B.transpose();
    return {M.determinant(), from_gibbs(M.fullPivLu().solve(z), frame)};
}
Matrix3d report(const Vectors& v, double lambda)
{
    FrameSolution best = report_in_frame(v, lambda, 0);
    for (int frame = 1; frame < 4; frame++)
        if (const auto other = report_in_frame(v, lambda, frame);
            std::abs(other.determinant) > std::abs(best.determinant))
            best = other;
    return best.R;
}
/// For unit vectors, sum w.
double half_of_squares(const Vectors& v)
{
    double sum = 0;
    for (const auto& x : v) sum += 0.5 * x.w * (x.a.squaredNorm() + x.b.squaredNorm());
    return sum;
}

/// min sum w |d - g x s|^2 from its rows, in one frame.
Matrix3d least_squares_in_frame(const Vectors& v, int frame)
{
    const Vectors here = turned(v, frame);
    Eigen::MatrixXd A(3 * static_cast<Eigen::Index>(v.size()), 3);
    Eigen::VectorXd y(A.rows());
    for (size_t i = 0; i < v.size(); i++)
    {
        const double root = std::sqrt(here[i].w);
        const Vector3d s = here[i].a + here[i].b, d = here[i].a - here[i].b;
        const auto row = 3 * static_cast<Eigen::Index>(i);
        for (int c = 0; c < 3; c++) A.block<3, 1>(row, c) = root * Vector3d(Vector3d::Unit(c)).cross(s);
        y.segment<3>(row) = root * d;
    }
    return from_gibbs(A.householderQr().solve(y), frame);
}

/// Wahba's problem, by singular values.
Matrix3d wahba(const Vectors& v)
{
    const Eigen::JacobiSVD<Matrix3d> svd(profile(v), Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    return svd.matrixU() * Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

/// The number of the largest component of (w, x, y, z), and by how much it leads.
std::pair<int, double> largest_component(const Matrix3d& R)
{
    const Eigen::Quaterniond q(R);
    Eigen::Vector4d c(std::abs(q.w()), std::abs(q.x()), std::abs(q.y()), std::abs(q.z()));
    int k = 0;
    const double largest = c.maxCoeff(&k);
    c(k) = 0;
    return {k, largest - c.maxCoeff()};
}

/// A rotation whose quaternion clearly has its largest component in this place.
Matrix3d rotation_of_frame(int frame, SeededRandom& random)
{
    for (;;)
    {
        const Matrix3d R = any_rotation(random);
        const auto [k, lead] = largest_component(R);
        if (k == frame && lead > 0.2) return R;
    }
}

Matrix3d by_oracle(const Vectors& v, OlaeSystem system)
{
    const Matrix3d best = wahba(v);
    if (system == OlaeSystem::Newton) return best;
    if (system == OlaeSystem::Report) return report(v, half_of_squares(v));
    return least_squares_in_frame(v, largest_component(best).first);
}

/// All position rows, given the rotation: the normal equations of the translation.
Vector3d translation_by_oracle(const Pairings& p, const Matrix3d& R)
{
    Matrix3d A = Matrix3d::Zero();
    Vector3d y = Vector3d::Zero();
    const auto add = [&](const Matrix3d& C, const Vector3d& q, const Vector3d& b)
    { A += C, y += C * (q - R * b); };
    const Matrix3d I = Matrix3d::Identity();
    const auto across = [&](const Vector3d& u) -> Matrix3d { return I - u * u.transpose(); };
    const auto along = [](const Vector3d& n) -> Matrix3d { return n * n.transpose(); };
    for (size_t i = 0; i < p.paired_pt2pt.size(); i++) add(I, global_of(p, i), local_of(p, i));
    for (const auto& x : p.paired_pt2ln)
        add(across(direction(x.ln_global)), to_eigen(x.ln_global.pBase), to_eigen(x.pt_local));
    for (const auto& x : p.paired_pt2pl)
        add(along(direction(x.pl_global)), to_eigen(x.pl_global.centroid), to_eigen(x.pt_local));
    for (const auto& x : p.paired_ln2ln)
        add(across(direction(x.ln_global)), to_eigen(x.ln_global.pBase), to_eigen(x.ln_local.pBase));
    for (const auto& x : p.paired_pl2pl)
        add(along(direction(x.p_global)), to_eigen(x.p_global.centroid), to_eigen(x.p_local.centroid));
    return A.ldlt().solve(y);
}

template <class List>
WeightRuns random_weights(const List& list, SeededRandom& random)
{
    WeightRuns runs;
    for (size_t i = 0; i < list.size(); i++) runs.emplace_back(1, random.uniform(0.2, 3));
    return runs;
}
void weigh_all(Pairings& p, SeededRandom& random)
{
    p.point_weights = random_weights(p.paired_pt2pt, random);
    p.pt2ln_weights = random_weights(p.paired_pt2ln, random);
    p.pt2pl_weights = random_weights(p.paired_pt2pl, random);
    p.ln2ln_weights = random_weights(p.paired_ln2ln, random);
    p.pl2pl_weights = random_weights(p.paired_pl2pl, random);
}
void scale_weights(Pairings& p, double factor)
{
    for (auto* runs :
         {&p.point_weights, &p.pt2ln_weights, &p.pt2pl_weights, &p.ln2ln_weights, &p.pl2pl_weights})
        for (auto& run : *runs) run.second *= factor;
}
}  // namespace

// ---- Each system is what it says --------------------------------------------------------------------------

TEST(OptimalTfOlae, EverySystemIsItsSlowSolutionInTheFrameOfEachQuaternionComponent)
{
    const size_t rounds = repetitions(10, 1000);
    for (uint64_t seed = 1; seed <= rounds; seed++)
        for (int frame = 0; frame < 4; frame++)
        {
            SCOPED_TRACE(::testing::Message() << "seed " << seed << ", frame " << frame);
            SeededRandom random(seed);
            const Matrix3d R = rotation_of_frame(frame, random);
            const Vector3d t = random_point(random, 20);
            const CPose3D guess = make_pose(R, t);
            for (const Mix& mix : {POINTS, DIRECTIONS, ALL})
                for (const double noise : {1e-3, 0.1, 0.5})
                {
                    Pairings p = random_pairings(mix, R, t, random, noise);
                    weigh_all(p, random);
                    for (const auto system : SYSTEMS)
                        for (const bool normalize : {true, false})
                        {
                            const auto how = with(system, normalize);
                            const auto vectors = vectors_of(p, how, guess);
                            // Some 20 roundings, times a condition below 1e3.
                            EXPECT_LT(
                                angle_between(rotation(solved(p, how, guess)), by_oracle(vectors, system)),
                                1e-11)
                                << static_cast<int>(system) << " " << normalize << " noise " << noise;
                        }
                }
        }
}

TEST(OptimalTfOlae, TheThreeSystemsDifferOnNoisyVectorsAndAgreeWithoutNoise)
{
    SeededRandom random(5);
    for (int k = 0; k < 20; k++)
    {
        const Matrix3d R = any_rotation(random);
        const Vector3d t = random_point(random, 20);
        for (const bool normalize : {true, false})
            for (const double noise : {0.0, 0.5})
            {
                const Pairings p = random_pairings(POINTS, R, t, random, noise);
                std::array<Matrix3d, 3> found;
                for (size_t s = 0; s < 3; s++) found[s] = rotation(solved(p, with(SYSTEMS[s], normalize)));
                for (size_t s = 0; s < 3; s++)
                {
                    const double angle = angle_between(found[s], found[(s + 1) % 3]);
                    // Noise of a tenth of the radius: the systems differ by its square.
                    if (noise > 0)
                        EXPECT_GT(angle, 1e-6) << k << " " << s;
                    else
                        EXPECT_LT(angle, 1e-12) << k << " " << s;
                    EXPECT_LT(angle_between(found[s], R), noise > 0 ? 0.5 : 1e-12) << k << " " << s;
                }
            }
    }
}

TEST(OptimalTfOlae, AFactorOnAllWeightsChangesNothingOnNoisyData)
{
    SeededRandom random(6);
    for (int k = 0; k < 10; k++)
    {
        const Matrix3d R = any_rotation(random);
        Pairings p = random_pairings(ALL, R, random_point(random, 20), random, 0.5);
        weigh_all(p, random);
        for (const auto system : SYSTEMS)
            for (const bool normalize : {true, false})
            {
                const auto how = with(system, normalize);
                const Matrix3d plain = rotation(solved(p, how));
                for (const double factor : {0.1, 2.0, 7.0})
                {
                    Pairings scaled = p;
                    scale_weights(scaled, factor);
                    EXPECT_LT(angle_between(rotation(solved(scaled, how)), plain), 1e-12)
                        << k << " " << factor;
                    PairWeights kinds;
                    kinds.pt2pt = kinds.pt2ln = kinds.pt2pl = kinds.ln2ln = kinds.pl2pl = factor;
                    EXPECT_LT(angle_between(rotation(solved(p, how, {}, kinds)), plain), 1e-12)
                        << k << " " << factor;
                }
            }
    }
}

TEST(OptimalTfOlae, TheReportsOneInThePlaceOfTheSumOfTheWeightsWouldBeSeen)
{
    SeededRandom random(7);
    const Matrix3d R = rotation_about({1, 2, 3}, 1.0);
    const Pairings p = random_pairings(POINTS, R, {1, 2, 3}, random);
    Vectors vectors = vectors_of(p, {});
    const double sum = half_of_squares(vectors);
    for (auto& x : vectors) x.w *= 1.1 / sum;  // they sum to 1.1
    EXPECT_GT(angle_between(report(vectors, 1), R), 0.01);
    EXPECT_LT(angle_between(report(vectors, 1.1), R), 1e-12);
    EXPECT_LT(angle_between(rotation(solved(p, {})), R), 1e-12);
}

TEST(OptimalTfOlae, NewtonWithLengthsIsHorns)
{
    SeededRandom random(8);
    for (int k = 0; k < 50; k++)
    {
        const Matrix3d R = any_rotation(random);
        const Vector3d t = random_point(random, 20);
        const CPose3D guess = make_pose(R, t);
        Pairings p = random_pairings(ALL, R, t, random, 1.0);
        weigh_all(p, random);
        OptimalTF_Result horn;
        ASSERT_TRUE(optimal_tf_horn(p, {}, horn, guess));
        const auto olae = solved(p, with(OlaeSystem::Newton, false), guess);
        EXPECT_LT(angle_between(rotation(olae), rotation(horn)), 1e-12) << k;
        EXPECT_LT((translation_of(olae.optimalPose) - translation_of(horn.optimalPose)).norm(), 1e-11) << k;
        // Directions instead of lengths are another problem.
        EXPECT_GT(angle_between(rotation(solved(p, with(OlaeSystem::Newton), guess)), rotation(horn)), 1e-4)
            << k;
    }
}

TEST(OptimalTfOlae, NormalisedPointsCostAccuracyAgainstHorn)
{
    SeededRandom random(9);
    double olae = 0, horn = 0;
    for (int k = 0; k < 300; k++)
    {
        const Matrix3d R = any_rotation(random);
        const Pairings p = random_pairings({30, 0, 0, 0, 0}, R, {1, 2, 3}, random, 0.2);
        OptimalTF_Result other;
        ASSERT_TRUE(optimal_tf_horn(p, {}, other));
        olae += std::pow(angle_between(rotation(solved(p, {})), R), 2);
        horn += std::pow(angle_between(rotation(other), R), 2);
    }
    // Points near the centroid get as much weight as far ones, though their directions are noisier.
    EXPECT_GT(std::sqrt(olae / horn), 1.05);
    EXPECT_LT(std::sqrt(olae / horn), 2.0);
}

// ---- The whole pose ---------------------------------------------------------------------------------------

TEST(OptimalTfOlae, ExactDataGiveTheExactPoseAlsoAtHalfTurns)
{
    SeededRandom random(10);
    for (int k = 0; k < 12; k++)
    {
        const Vector3d axis = k < 3 ? Vector3d(Vector3d::Unit(k)) : random_direction(random);
        for (const double angle : {0.0, 1e-9, M_PI / 2, M_PI - 1e-2, M_PI - 1e-8, M_PI, -M_PI})
        {
            const Matrix3d R = rotation_about(axis, angle);
            const Vector3d t = random_point(random, 10);
            for (const Mix& mix : {Mix{3, 0, 0, 0, 0}, POINTS, DIRECTIONS, ALL, Mix{1, 0, 0, 0, 3}})
            {
                const Pairings p = random_pairings(mix, R, t, random);
                for (const auto system : SYSTEMS)
                    for (const bool normalize : {true, false})
                    {
                        const auto r = solved(p, with(system, normalize));
                        // Three random vectors may have a condition of 100.
                        EXPECT_LT(angle_between(rotation(r), R), 1e-12) << k << " " << angle;
                        EXPECT_LT((translation_of(r.optimalPose) - t).norm(), 1e-11) << k << " " << angle;
                        EXPECT_EQ(r.status, SolveStatus::Determined) << k << " " << angle;
                    }
            }
        }
    }
}

TEST(OptimalTfOlae, TheTranslationIsThatOfAllPositionRows)
{
    SeededRandom random(11);
    for (int k = 0; k < 20; k++)
    {
        const Matrix3d R = any_rotation(random);
        const Vector3d t = random_point(random, 20);
        for (const Mix& mix : {POINTS, DIRECTIONS, ALL})
        {
            const Pairings p = random_pairings(mix, R, t, random, 0.3);
            for (const auto system : SYSTEMS)
            {
                const auto r = solved(p, with(system), make_pose(R, t));
                EXPECT_LT((translation_of(r.optimalPose) - translation_by_oracle(p, rotation(r))).norm(),
                          1e-11)
                    << k;
                EXPECT_GT((translation_of(r.optimalPose) - t).norm(), 1e-4) << k;
            }
        }
    }
}

TEST(OptimalTfOlae, SignsOfLinesDoNotMatterAndSignsOfNormalsDo)
{
    SeededRandom random(12);
    const Matrix3d R = any_rotation(random);
    const Vector3d t(1, -2, 3);
    for (const bool guessed : {true, false})
        for (const auto system : SYSTEMS)
        {
            const std::optional<CPose3D> guess =
                guessed ? std::optional<CPose3D>(make_pose(R, t)) : std::nullopt;
            Pairings p = random_pairings(DIRECTIONS, R, t, random, 0.1);
            const Matrix3d before = rotation(solved(p, with(system), guess));
            auto& u = p.paired_ln2ln[1].ln_local.director;
            u = mrpt::math::TVector3D(-u.x, -u.y, -u.z);
            EXPECT_LT(angle_between(rotation(solved(p, with(system), guess)), before), 1e-12);
            for (double& c : p.paired_pl2pl[1].p_local.plane.coefs) c = -c;
            EXPECT_GT(angle_between(rotation(solved(p, with(system), guess)), before), 1e-3);
        }
}

// ---- Weights ----------------------------------------------------------------------------------------------

TEST(OptimalTfOlae, AWeightIsARepetition)
{
    SeededRandom random(13);
    const Matrix3d R = any_rotation(random);
    const Vector3d t = random_point(random, 20);
    const CPose3D guess = make_pose(R, t);
    const Pairings p = random_pairings(ALL, R, t, random, 0.5);
    const auto expect_equal =
        [&](const Pairings& repeated, const Pairings& weighted, const PairWeights& kinds, const char* what)
    {
        for (const auto system : SYSTEMS)
            for (const bool normalize : {true, false})
            {
                const auto how = with(system, normalize);
                const auto a = solved(repeated, how, guess), b = solved(weighted, how, guess, kinds);
                EXPECT_LT(angle_between(rotation(a), rotation(b)), 1e-12) << what;
                EXPECT_LT((translation_of(a.optimalPose) - translation_of(b.optimalPose)).norm(), 1e-11)
                    << what;
                EXPECT_GT(angle_between(rotation(b), rotation(solved(p, how, guess))), 1e-5) << what;
            }
    };
    const auto check = [&](auto list, auto runs, auto kind, const char* what)
    {
        Pairings repeated = p, weighted = p;
        const auto second = (p.*list)[1];
        for (int k = 0; k < 2; k++) (repeated.*list).push_back(second);
        weighted.*runs = {{1, 1.0}, {1, 3.0}};
        expect_equal(repeated, weighted, {}, what);
        repeated = p;
        for (int k = 0; k < 2; k++)
            for (const auto& x : p.*list) (repeated.*list).push_back(x);
        PairWeights kinds;
        kinds.*kind = 3;
        expect_equal(repeated, p, kinds, what);
    };
    check(&Pairings::paired_pt2pt, &Pairings::point_weights, &PairWeights::pt2pt, "pt2pt");
    check(&Pairings::paired_pt2ln, &Pairings::pt2ln_weights, &PairWeights::pt2ln, "pt2ln");
    check(&Pairings::paired_pt2pl, &Pairings::pt2pl_weights, &PairWeights::pt2pl, "pt2pl");
    check(&Pairings::paired_ln2ln, &Pairings::ln2ln_weights, &PairWeights::ln2ln, "ln2ln");
    check(&Pairings::paired_pl2pl, &Pairings::pl2pl_weights, &PairWeights::pl2pl, "pl2pl");
}

TEST(OptimalTfOlae, PointsNearTheCentroidHaveNoDirection)
{
    // Pairs of points on opposite sides: their centroid is the origin, and stays so.
    SeededRandom random(14);
    Pairings p;
    for (int k = 0; k < 10; k++)
    {
        const Vector3d b = random_point(random, 5);
        for (const double side : {1.0, -1.0})
            add_pair(p, rotation_about({0, 0, 1}, 0.3) * (side * b) + 0.1 * gaussian_vector(random),
                     side * b);
    }
    const double L = rms_radius(points_of(p, {}, {}).local_only);
    Vector3d ca = Vector3d::Zero(), cb = Vector3d::Zero();
    for (size_t i = 0; i < 20; i++) ca += global_of(p, i) / 20, cb += local_of(p, i) / 20;
    for (const auto system : SYSTEMS)
    {
        const Matrix3d before = rotation(solved(p, with(system)));
        const auto angle_with_contradiction_at = [&](double distance)
        {
            Pairings more = p;
            add_pair(more, ca + distance * L * Vector3d(1, 0, 0), cb + distance * L * Vector3d(0, 1, 0));
            return angle_between(rotation(solved(more, with(system))), before);
        };
        EXPECT_LT(angle_with_contradiction_at(0), 1e-12);
        EXPECT_LT(angle_with_contradiction_at(0.5e-6), 1e-6);  // the centroid moves by less than that
        EXPECT_GT(angle_with_contradiction_at(1e-3), 1e-2);    // one of 21 vectors says 90 degrees
        // With lengths it hardly counts.
        Pairings more = p;
        add_pair(more, ca + 1e-3 * L * Vector3d(1, 0, 0), cb + 1e-3 * L * Vector3d(0, 1, 0));
        EXPECT_LT(angle_between(rotation(solved(more, with(system, false))),
                                rotation(solved(p, with(system, false)))),
                  1e-3);
    }
}

// ---- What is not determined -------------------------------------------------------------------------------

namespace
{
/// The roll about `axis` (global) is free and stays at the guess's; the axis itself is taken over.
void expect_free_about(const Vector3d& axis, const Vector3d& local_axis, const Pairings& p,
                       const OlaeParameters& how, const CPose3D& guess, const char* what)
{
    SCOPED_TRACE(::testing::Message() << what << ", system " << static_cast<int>(how.system) << ", normalize "
                                      << how.normalize_points);
    const auto r = solved(p, how, guess);
    EXPECT_EQ(r.status, SolveStatus::UnderConstrained);
    EXPECT_EQ(r.rank, 5);
    ASSERT_EQ(r.free.size(), 1u);
    EXPECT_EQ(r.free[0].kind, FreeTwist::Kind::Rotation);
    EXPECT_GT(std::abs(to_eigen(r.free[0].axis).dot(axis)), 1 - 1e-9);
    EXPECT_LT((rotation(r) * local_axis - axis).norm(), 1e-9);
    // Nearest to the guess: what is left between them has no part about the free axis.
    const Eigen::AngleAxisd rest(Matrix3d(rotation(r) * rotation_of(guess).transpose()));
    EXPECT_LT(std::abs(rest.axis().dot(axis)) * rest.angle(), 1e-6);
}
}  // namespace

TEST(OptimalTfOlae, VectorsThatAreAllParallelLeaveTheRollToTheGuess)
{
    SeededRandom random(15);
    for (int k = 0; k < 10; k++)
    {
        const Matrix3d R = any_rotation(random);
        const Vector3d t = random_point(random, 5), u = random_direction(random);
        const CPose3D guess = make_pose(R * rotation_about(random_direction(random), 0.5), t);
        Pairings line_of_points, stretched, swapped, normals;
        for (const double along : {-3.0, -2.0, -1.0, 1.0, 2.0, 3.0})
        {
            add_pair(line_of_points, R * (along * u) + t, along * u);
            add_pair(stretched, R * (1.5 * along * u) + t, along * u);
            add_pair(swapped, R * ((std::abs(along) < 1.5 ? -along : along) * u) + t, along * u);
        }
        add_pair(normals, R * u + t, u);
        for (int i = 0; i < 3; i++) normals.paired_pl2pl.push_back({patch(R * u + t, R * u), patch(u, u)});
        for (const auto system : SYSTEMS)
            for (const bool normalize : {true, false})
            {
                const auto how = with(system, normalize);
                expect_free_about(R * u, u, line_of_points, how, guess, "points on a line");
                expect_free_about(R * u, u, stretched, how, guess, "points on a line, of other distances");
                expect_free_about(R * u, u, swapped, how, guess, "points on a line, two of them swapped");
                expect_free_about(R * u, u, normals, how, guess, "one point and parallel normals");
            }
    }
}

TEST(OptimalTfOlae, TwoPointsWhoseDistancesDifferDoNotDetermineTheRotation)
{
    for (const double stretch : {1.0, 1.1, 1.3, 2.0, 10.0})
    {
        Pairings p;
        add_pair(p, {0, 0, 0}, {0, 0, 0});
        add_pair(p, {stretch, 0, 0}, {0, 1, 0});
        for (const auto system : SYSTEMS)
            for (const bool normalize : {true, false})
                expect_free_about({1, 0, 0}, {0, 1, 0}, p, with(system, normalize),
                                  CPose3D(0, 0, 0, -1, 0, 0.4), "two points");
    }
}

TEST(OptimalTfOlae, APointAloneGivesTheTranslationAndKeepsTheGuessedRotation)
{
    Pairings p;
    add_pair(p, {1, 2, 3}, {4, 5, 6});
    const CPose3D guess(9, 9, 9, 0.5, -0.4, 0.3);
    for (const auto system : SYSTEMS)
        for (const bool normalize : {true, false})
        {
            const auto r = solved(p, with(system, normalize), guess);
            EXPECT_LT(angle_between(rotation(r), rotation_of(guess)), 1e-12);
            EXPECT_LT(
                (rotation(r) * Vector3d(4, 5, 6) + translation_of(r.optimalPose) - Vector3d(1, 2, 3)).norm(),
                1e-12);
            EXPECT_EQ(r.status, SolveStatus::UnderConstrained);
            EXPECT_EQ(r.rank, 3);
            EXPECT_EQ(r.free.size(), 3u);
        }
}

TEST(OptimalTfOlae, OnePointOnALineOrAPlaneKeepsTheGuessedRotation)
{
    // With a guess it is paired with its projection. That is one vector of no length, but for rounding.
    SeededRandom random(17);
    for (int k = 0; k < 50; k++)
    {
        Pairings on_line, on_plane;
        const Vector3d q = random_point(random, 10), u = random_direction(random),
                       b = random_point(random, 30);
        on_line.paired_pt2ln.push_back({line(q, u), to_mrpt(b)}),
            on_line.pt2ln_weights = {{1, random.uniform()}};
        on_plane.paired_pt2pl.push_back({patch(q, u), to_mrpt(b)}),
            on_plane.pt2pl_weights = {{1, random.uniform()}};
        const CPose3D guess = any_pose(random);
        for (const auto system : SYSTEMS)
            for (const bool normalize : {true, false})
                for (const auto* p : {&on_line, &on_plane})
                {
                    SCOPED_TRACE(::testing::Message()
                                 << k << " system " << static_cast<int>(system) << ", normalize " << normalize
                                 << (p == &on_line ? ", line" : ", plane"));
                    const auto r = solved(*p, with(system, normalize), guess);
                    EXPECT_TRUE(is_finite(r.optimalPose));
                    EXPECT_EQ(r.rank, p == &on_line ? 2 : 1);
                    EXPECT_LT(angle_between(rotation(r), rotation_of(guess)), 1e-6);
                }
    }
}

TEST(OptimalTfOlae, NothingToSolveWithChangesNothing)
{
    Pairings weightless = moved_points(random_points(5, 1, 1), Matrix3d::Identity(), {1, 2, 3});
    weightless.point_weights = {{5, 0.0}};
    for (const auto system : SYSTEMS)
        for (const auto& p : {Pairings(), weightless})
        {
            OptimalTF_Result r;
            r.optimalPose = CPose3D(1, 2, 3, 0.1, 0.2, 0.3), r.status = SolveStatus::Determined, r.rank = 6;
            EXPECT_FALSE(optimal_tf_olae(p, {}, r, {}, with(system)));
            expect_same_bits(r.optimalPose, CPose3D(1, 2, 3, 0.1, 0.2, 0.3));
            EXPECT_EQ(r.status, SolveStatus::NoPairings);
            EXPECT_EQ(r.rank, 0);
        }
}

TEST(OptimalTfOlae, HasTheSameBitsOnAnyNumberOfThreads)
{
    SeededRandom random(16);
    const Matrix3d R = any_rotation(random);
    const Pairings p = random_pairings({5000, 300, 300, 1500, 1500}, R, {1, 2, 3}, random, 0.3);
    for (const auto system : SYSTEMS)
        for (const bool normalize : {true, false})
        {
            CPose3D one;
            const auto how = with(system, normalize);
            with_threads(1, [&]() { one = solved(p, how, make_pose(R, {1, 2, 3})).optimalPose; });
            EXPECT_LT(angle_between(rotation_of(one), R), 0.05);
            for (const int threads : {2, 8})
                with_threads(threads,
                             [&]() {
                                 expect_same_bits(solved(p, how, make_pose(R, {1, 2, 3})).optimalPose, one);
                             });
        }
}
