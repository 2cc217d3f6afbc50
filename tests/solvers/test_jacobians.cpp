#include <mp2p_icp/errorTerms.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>

#include "pose_minimiser.h"
#include "random_pairings.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

// ---- The step of the solver against normal equations by numerical differentiation -----------------------

namespace
{
Vector3d normal_of(const plane_patch_t& p)
{
    return {p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]};
}

/// A problem, its residuals written in another way than the solver's: cross products, distances from planes.
struct Problem
{
    Pairings in;
    OptimalTF_GN_Parameters p;

    /// The weight of each pairing's position, by kinds: those of the kinds times the pairings' own.
    std::vector<double> weights(double kind, const WeightRuns& runs, size_t count) const
    {
        std::vector<double> w = expanded_weights(runs, count);
        for (double& x : w) x *= kind;
        return w;
    }

    using Weighted = std::vector<std::pair<double, Vector3d>>;
    /// The local points, and then the base points of lines and centroids of planes.
    Weighted local_points() const
    {
        Weighted all;
        const auto& w = p.pairWeights;
        const auto a = weights(w.pt2pt, in.point_weights, in.paired_pt2pt.size()),
                   b = weights(w.pt2ln, in.pt2ln_weights, in.paired_pt2ln.size()),
                   c = weights(w.pt2pl, in.pt2pl_weights, in.paired_pt2pl.size());
        for (size_t i = 0; i < a.size(); i++) all.emplace_back(a[i], local_of(in, i));
        for (size_t i = 0; i < b.size(); i++) all.emplace_back(b[i], to_eigen(in.paired_pt2ln[i].pt_local));
        for (size_t i = 0; i < c.size(); i++) all.emplace_back(c[i], to_eigen(in.paired_pt2pl[i].pt_local));
        return all;
    }
    Weighted local_positions() const
    {
        Weighted all = local_points();
        const auto& w = p.pairWeights;
        const auto a = weights(w.ln2ln, in.ln2ln_weights, in.paired_ln2ln.size()),
                   b = weights(w.pl2pl, in.pl2pl_weights, in.paired_pl2pl.size());
        for (size_t i = 0; i < a.size(); i++)
            all.emplace_back(a[i], to_eigen(in.paired_ln2ln[i].ln_local.pBase));
        for (size_t i = 0; i < b.size(); i++)
            all.emplace_back(b[i], to_eigen(in.paired_pl2pl[i].p_local.centroid));
        return all;
    }
    static Vector3d mean(const Weighted& all)
    {
        double sum = 0;
        Vector3d out = Vector3d::Zero();
        for (const auto& [w, x] : all) sum += w, out += w * x;
        return sum > 0 ? Vector3d(out / sum) : out;
    }
    double L() const
    {
        const auto all = local_points();
        const Vector3d centre = mean(all);
        double sum = 0, squares = 0;
        for (const auto& [w, x] : all) sum += w, squares += w * (x - centre).squaredNorm();
        return squares > 1e-12 * sum ? std::sqrt(squares / sum) : 1.0;
    }

    /// All residuals times the roots of their weights (kernel included), and the prior's.
    Eigen::VectorXd rows(const CPose3D& pose, const std::vector<double>& kernel_factors) const
    {
        std::vector<double> all;
        size_t pairing = 0;
        const double L2 = L() * L();
        const PairWeights& w = p.pairWeights;
        const auto append = [&](double weight, const Vector3d& r)
        {
            for (int i = 0; i < 3; i++) all.push_back(std::sqrt(weight * kernel_factors.at(pairing)) * r(i));
        };
        const auto moved = [&](const mrpt::math::TPoint3D& x) -> Vector3d
        { return rotation_of(pose) * to_eigen(x) + translation_of(pose); };
        const auto from_line = [&](const mrpt::math::TLine3D& l, const mrpt::math::TPoint3D& x) -> Vector3d
        { return to_eigen(l.director).normalized().cross(moved(x) - to_eigen(l.pBase)); };
        const auto from_plane = [&](const plane_patch_t& g, const mrpt::math::TPoint3D& x)
        { return Vector3d(g.plane.evaluatePoint(to_mrpt(moved(x))), 0, 0); };
        const auto turned_from = [&](const Vector3d& global, const Vector3d& local,
                                     DirectionSign sign) -> Vector3d
        {
            const Vector3d g = global.normalized(), l = rotation_of(pose) * local.normalized();
            return sign == DirectionSign::Free ? g.cross(l) : Vector3d(l - g);
        };
        const auto a = weights(w.pt2pt, in.point_weights, in.paired_pt2pt.size()),
                   b = weights(w.pt2ln, in.pt2ln_weights, in.paired_pt2ln.size()),
                   c = weights(w.pt2pl, in.pt2pl_weights, in.paired_pt2pl.size()),
                   d = weights(w.ln2ln, in.ln2ln_weights, in.paired_ln2ln.size()),
                   e = weights(w.pl2pl, in.pl2pl_weights, in.paired_pl2pl.size());
        for (size_t i = 0; i < a.size(); i++, pairing++)
            append(a[i], moved(to_mrpt(local_of(in, i))) - global_of(in, i));
        for (size_t i = 0; i < b.size(); i++, pairing++)
            append(b[i], from_line(in.paired_pt2ln[i].ln_global, in.paired_pt2ln[i].pt_local));
        for (size_t i = 0; i < c.size(); i++, pairing++)
            append(c[i], from_plane(in.paired_pt2pl[i].pl_global, in.paired_pt2pl[i].pt_local));
        for (size_t i = 0; i < d.size(); i++, pairing++)
        {
            const auto& [g, l] = in.paired_ln2ln[i];
            append(d[i], from_line(g, l.pBase));
            append(d[i] / w.ln2ln * w.ln2ln_direction.value_or(w.ln2ln * L2),
                   turned_from(to_eigen(g.director), to_eigen(l.director), w.ln2ln_sign));
        }
        for (size_t i = 0; i < e.size(); i++, pairing++)
        {
            const auto& [g, l] = in.paired_pl2pl[i];
            append(e[i], from_plane(g, l.centroid));
            append(e[i] / w.pl2pl * w.pl2pl_direction.value_or(w.pl2pl * L2),
                   turned_from(normal_of(g), normal_of(l), w.pl2pl_sign));
        }
        if (p.prior) append_prior(pose, all);
        return Eigen::Map<Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
    }
    void append_prior(const CPose3D& pose, std::vector<double>& all) const
    {
        Matrix6 information;
        for (int r = 0; r < 6; r++)
            for (int c = 0; c < 6; c++) information(r, c) = p.prior->cov_inv(r, c);
        Vector6 e = coordinates(pose) - coordinates(p.prior->mean);
        for (int i = 3; i < 6; i++) e(i) = std::remainder(e(i), 2 * M_PI);
        const Vector6 weighted = information.llt().matrixU() * e;
        for (int i = 0; i < 6; i++) all.push_back(weighted(i));
    }

    /// The pose after a step: `v` of the mean of the local positions, then `omega` about it, global axes.
    CPose3D moved(const CPose3D& pose, const Vector6& step) const
    {
        const Vector3d centre = mean(local_positions()), omega = step.tail<3>(),
                       at = rotation_of(pose) * centre + translation_of(pose) + step.head<3>();
        const Matrix3d R =
            (omega.norm() > 0 ? rotation_about(omega, omega.norm()) : Matrix3d(Matrix3d::Identity())) *
            rotation_of(pose);
        return make_pose(R, at - R * centre);
    }

    /// What the kernel leaves of each pairing at a pose: it sees all of its rows, by the weight of the first.
    std::vector<double> kernel_factors(const CPose3D& pose) const
    {
        std::vector<double> factors(in.size(), 1.0);
        if (p.kernel == RobustKernel::None) return factors;
        const Eigen::VectorXd r = rows(pose, factors);
        const auto positions = local_positions();
        const size_t points = in.size() - in.paired_ln2ln.size() - in.paired_pl2pl.size();
        Eigen::Index row = 0;
        for (size_t i = 0; i < in.size(); i++)
        {
            const Eigen::Index count = i < points ? 3 : 6;
            factors[i] = robust_weight(p.kernel, r.segment(row, count).squaredNorm() / positions[i].first,
                                       p.kernelParam);
            row += count;
        }
        return factors;
    }

    Vector6 gauss_newton_step(const CPose3D& pose) const
    {
        const auto factors = kernel_factors(pose);
        const Eigen::VectorXd r = rows(pose, factors);
        Eigen::MatrixXd J(r.size(), 6);
        const double h = 1e-5;
        for (int i = 0; i < 6; i++)
            J.col(i) = (rows(moved(pose, h * Vector6::Unit(i)), factors) -
                        rows(moved(pose, -h * Vector6::Unit(i)), factors)) /
                       (2 * h);
        return -J.colPivHouseholderQr().solve(r);
    }
};

/// Pairings with noise, of different weights; lines as their sign asks for.
Problem random_problem(const Mix& mix, const CPose3D& truth, SeededRandom& random)
{
    Problem out;
    out.in = random_pairings(mix, rotation_of(truth), translation_of(truth), random, 0.1);
    PairWeights& w = out.p.pairWeights;
    for (double* kind : {&w.pt2pt, &w.pt2ln, &w.pt2pl, &w.ln2ln, &w.pl2pl}) *kind = random.uniform(0.3, 3);
    for (WeightRuns* runs : {&out.in.point_weights, &out.in.pt2ln_weights, &out.in.pt2pl_weights,
                             &out.in.ln2ln_weights, &out.in.pl2pl_weights})
        *runs = {{1, random.uniform(0.3, 3)}, {2, random.uniform(0.3, 3)}};
    return out;
}

void set_signs(Problem& problem, const CPose3D& truth, DirectionSign lines, DirectionSign planes)
{
    problem.p.pairWeights.ln2ln_sign = lines, problem.p.pairWeights.pl2pl_sign = planes;
    const Matrix3d R = rotation_of(truth);
    for (auto& p : problem.in.paired_ln2ln)
    {
        const Vector3d local = to_eigen(p.ln_local.director);
        const bool reversed = to_eigen(p.ln_global.director).dot(R * local) < 0;
        if (lines == DirectionSign::Oriented && reversed) p.ln_local.director = to_mrpt(-local);
    }
    size_t i = 0;
    for (auto& p : problem.in.paired_pl2pl)
        if (planes == DirectionSign::Free && i++ % 2)
            for (double& c : p.p_local.plane.coefs) c = -c;
}

/// One step from near the truth is the one that the differentiated residuals predict.
void expect_predicted_step(Problem problem, const CPose3D& truth, SeededRandom& random)
{
    const Vector6 off =
        (Vector6() << 0.2 * gaussian_vector(random), 0.05 * gaussian_vector(random)).finished();
    const CPose3D start = problem.moved(truth, off);
    problem.p.linearizationPoint = start, problem.p.maxInnerLoopIterations = 1;
    OptimalTF_Result r;
    GaussNewtonReport report;
    ASSERT_TRUE(optimal_tf_gauss_newton(problem.in, r, problem.p, &report));
    EXPECT_EQ(report.iterations, 1u);
    EXPECT_EQ(report.end, GaussNewtonEnd::MaxIterations);
    const Vector6 step = problem.gauss_newton_step(start);
    ASSERT_GT(step.norm(), 0.01);
    const CPose3D predicted = problem.moved(start, step);
    // Else the solver must not make this step.
    const auto factors = problem.kernel_factors(start);
    ASSERT_LT(problem.rows(predicted, factors).norm(), problem.rows(start, factors).norm());
    EXPECT_LT(angle_between(rotation_of(r.optimalPose), rotation_of(predicted)), 1e-6 * step.norm());
    // Translations are of the frame's origin, some ten metres from the mean.
    EXPECT_LT((translation_of(r.optimalPose) - translation_of(predicted)).norm(), 1e-5 * step.norm());
}

/// Each kind alone, then mixes.
const std::vector<Mix> MIXES = {{6, 0, 0, 0, 0}, {0, 8, 0, 0, 0}, {0, 0, 14, 0, 0}, {0, 0, 0, 6, 0},
                                {0, 0, 0, 0, 7}, {3, 3, 3, 3, 3}, {0, 0, 0, 3, 3},  {4, 0, 0, 2, 2}};

/// Random, near half turns about any axis, and half turns about the frame's axes.
std::vector<CPose3D> poses(SeededRandom& random)
{
    std::vector<CPose3D> out;
    for (size_t k = 0; k < repetitions(4, 50); k++)
        out.push_back(make_pose(any_rotation(random), random_point(random, 10)));
    for (const double from_half_turn : {1e-2, 1e-5, 0.0})
        out.push_back(make_pose(rotation_about(random_direction(random), M_PI - from_half_turn),
                                random_point(random, 10)));
    for (int i = 0; i < 3; i++)
        out.push_back(make_pose(rotation_about(Vector3d::Unit(i), M_PI), random_point(random, 10)));
    return out;
}
constexpr DirectionSign SIGNS[] = {DirectionSign::Free, DirectionSign::Oriented};

std::string of(const Mix& m, size_t pose)
{
    std::string out = "pose " + std::to_string(pose) + ", mix";
    for (const size_t n : {m.pt2pt, m.pt2ln, m.pt2pl, m.ln2ln, m.pl2pl}) out += " " + std::to_string(n);
    return out;
}
}  // namespace

TEST(GaussNewtonStep, IsThatOfTheDifferentiatedResidualsOfEveryKind)
{
    SeededRandom random(1);
    const auto all = poses(random);
    for (size_t k = 0; k < all.size(); k++)
        for (const Mix& mix : MIXES)
            for (const DirectionSign lines : SIGNS)
                for (const DirectionSign planes : SIGNS)
                    for (const bool direction_weights : {false, true})
                    {
                        SCOPED_TRACE(of(mix, k));
                        Problem problem = random_problem(mix, all[k], random);
                        set_signs(problem, all[k], lines, planes);
                        if (direction_weights)
                        {
                            problem.p.pairWeights.ln2ln_direction = random.uniform(1, 30);
                            problem.p.pairWeights.pl2pl_direction = random.uniform(1, 30);
                        }
                        expect_predicted_step(problem, all[k], random);
                    }
}

TEST(GaussNewtonStep, IsThatOfTheDifferentiatedPriorToo)
{
    SeededRandom random(2);
    std::vector<Mix> mixes = MIXES;
    mixes.push_back({1, 0, 0, 0, 0}), mixes.push_back({0, 0, 1, 0, 0});  // the prior decides the rest
    for (size_t k = 0; k < repetitions(20, 200); k++)
    {
        // Yaw, pitch and roll are smooth away from a pitch of 90 degrees; yaw and roll may wrap around.
        const double yaw = k % 3 ? random.uniform(-3, 3) : M_PI - 0.01,
                     roll = k % 4 ? random.uniform(-3, 3) : -M_PI + 0.01;
        const Vector3d t = random_point(random, 10);
        const CPose3D truth(t.x(), t.y(), t.z(), yaw, random.uniform(-1, 1), roll);
        for (const Mix& mix : mixes)
        {
            SCOPED_TRACE(of(mix, k));
            Problem problem = random_problem(mix, truth, random);
            set_signs(problem, truth, SIGNS[k % 2], SIGNS[k / 2 % 2]);
            const Vector6 off =
                (Vector6() << 0.3 * gaussian_vector(random), 0.05 * gaussian_vector(random)).finished();
            problem.p.prior =
                prior_of(problem.moved(truth, off), random_information(random, 5) + 2 * Matrix6::Identity());
            expect_predicted_step(problem, truth, random);
        }
    }
}

TEST(GaussNewtonStep, IsThatOfTheResidualsAsTheKernelWeighsThem)
{
    SeededRandom random(3);
    for (const RobustKernel kernel : {RobustKernel::Huber, RobustKernel::Cauchy})
        for (size_t k = 0; k < repetitions(10, 100); k++)
            for (const Mix& mix : MIXES)
            {
                SCOPED_TRACE(of(mix, k));
                const CPose3D truth = make_pose(any_rotation(random), random_point(random, 10));
                Problem problem = random_problem(mix, truth, random);
                set_signs(problem, truth, SIGNS[k % 2], SIGNS[k / 2 % 2]);
                problem.p.kernel = kernel, problem.p.kernelParam = 0.3;
                expect_predicted_step(problem, truth, random);
            }
}

// ---- The Jacobians of the error terms, chained with increments of the pose ------------------------------

namespace
{
template <class Vector>
Eigen::VectorXd as_eigen(const Vector& v)
{
    Eigen::VectorXd out(static_cast<Eigen::Index>(v.size()));
    for (int i = 0; i < out.size(); i++) out(i) = v[i];
    return out;
}

/// d (columns of R, t) / d (v, omega) for t + v and exp([omega]x) R.
Eigen::Matrix<double, 12, 6> entries_by_increment(const CPose3D& pose)
{
    Eigen::Matrix<double, 12, 6> out = Eigen::Matrix<double, 12, 6>::Zero();
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < 3; i++)
            out.block<3, 1>(3 * c, 3 + i) = Vector3d::Unit(i).cross(rotation_of(pose).col(c));
    out.bottomLeftCorner<3, 3>().setIdentity();
    return out;
}

template <int ROWS, class Pairing, class Function>
void expect_chained(Function function, const Pairing& pairing, const CPose3D& pose)
{
    ErrorTermJacobian<ROWS> by_entries;
    function(pairing, pose, by_entries);
    Eigen::Matrix<double, ROWS, 12> J;
    for (int r = 0; r < ROWS; r++)
        for (int c = 0; c < 12; c++) J(r, c) = by_entries(r, c);
    const Eigen::Matrix<double, ROWS, 6> chained = J * entries_by_increment(pose);
    Eigen::Matrix<double, ROWS, 6> numeric;
    const double h = 1e-5;
    for (int i = 0; i < 6; i++)
    {
        const auto at = [&](double s) -> Eigen::VectorXd
        {
            const Vector3d u = Vector3d::Unit(i % 3);
            const CPose3D there =
                i < 3 ? make_pose(rotation_of(pose), translation_of(pose) + s * u)
                      : make_pose(rotation_about(u, s) * rotation_of(pose), translation_of(pose));
            return as_eigen(function(pairing, there, std::nullopt));
        };
        numeric.col(i) = (at(h) - at(-h)) / (2 * h);
    }
    EXPECT_GT(numeric.norm(), 0.1);
    EXPECT_LT((chained - numeric).norm(), 1e-6 * numeric.norm());
}
}  // namespace

TEST(ErrorTerms, RandomPairingsHaveTheJacobiansOfTheirResidualsAtRandomPosesAndHalfTurns)
{
    SeededRandom random(4);
    for (const CPose3D& pose : poses(random))
    {
        // Of another pose: no residual is zero.
        const Pairings p =
            random_pairings({3, 3, 3, 3, 3}, any_rotation(random), random_point(random, 10), random);
        for (const auto& x : p.paired_pt2pt) expect_chained<3>(error_point2point, x, pose);
        for (const auto& x : p.paired_pt2ln) expect_chained<3>(error_point2line, x, pose);
        for (const auto& x : p.paired_pt2pl) expect_chained<3>(error_point2plane, x, pose);
        for (const auto& x : p.paired_ln2ln) expect_chained<4>(error_line2line, x, pose);
        for (const auto& x : p.paired_pl2pl) expect_chained<3>(error_plane2plane, x, pose);
    }
}
