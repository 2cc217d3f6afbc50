#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>
#include <mp2p_icp/synthetic/report_worlds.h>

#include <algorithm>
#include <functional>
#include <iomanip>
#include <iostream>
#include <string>

#include "pose_minimiser.h"
#include "random_pairings.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp::synthetic;
using namespace mp2p_icp_test;

namespace
{
constexpr double DEG = M_PI / 180;

bool full_run()
{
    return repetitions(0, 1) == 1;
}
void print_line(const std::string& what, double mean)
{
    if (full_run()) std::cout << "  " << what << ": " << std::setprecision(5) << mean << "\n";
}
Matrix6 as_matrix(const mrpt::math::CMatrixDouble66& m)
{
    return m.asEigen();
}
ObservabilityParameters with_weights(const PairWeights& w, const std::optional<double>& sigma)
{
    ObservabilityParameters p = known_sigma(sigma);
    p.pair_weights = w;
    return p;
}

// ---- Estimators -------------------------------------------------------------------------------------------

/// A pose from pairings and their weights, without a guess.
using Estimator = std::function<bool(const Pairings&, const PairWeights&, OptimalTF_Result&)>;

bool gauss_newton(const Pairings& p, const PairWeights& w, OptimalTF_Result& r)
{
    OptimalTF_GN_Parameters gn;
    gn.pairWeights = w;
    return optimal_tf_gauss_newton(p, r, gn);
}
bool horn(const Pairings& p, const PairWeights& w, OptimalTF_Result& r)
{
    WeightParameters wp;
    wp.pair_weights = w;
    return optimal_tf_horn(p, wp, r);
}
Estimator olae(OlaeSystem system, bool unit_vectors)
{
    return [=](const Pairings& p, const PairWeights& w, OptimalTF_Result& r)
    {
        WeightParameters wp;
        wp.pair_weights = w;
        return optimal_tf_olae(p, wp, r, std::nullopt, {system, unit_vectors});
    };
}

// ---- Errors against the bound -----------------------------------------------------------------------------

/// Squared errors of one estimator, summed, next to what the bound predicts.
struct Score
{
    double rotation_sq = 0, translation_sq = 0;
    void add(const PoseError& e)
    {
        rotation_sq += e.rotation * e.rotation, translation_sq += e.translation * e.translation;
    }
};
/// The sum of the bound's squared errors, and that of their variances.
struct BoundSum
{
    double mean = 0, variance = 0;
    void add(const Matrix3d& covariance)
    {
        mean += covariance.trace();
        variance += 2 * covariance.squaredNorm();  // |e|^2 of a Gaussian e with this covariance
    }
    double ratio(double squares) const { return std::sqrt(squares / mean); }
    /// Standard deviation of ratio() of an estimator on the bound: half that of the mean square.
    double deviation() const { return 0.5 * std::sqrt(variance) / mean; }
};

struct Experiment
{
    std::string name;
    size_t points, planes;
    bool offsets;
};
struct Cell
{
    size_t runs = 0, failures = 0;
    BoundSum rotation, translation;
    std::vector<Score> scores;
};

Cell run_cell(const Experiment& e, const ReportNoise& noise, const std::vector<Estimator>& estimators,
              size_t runs, uint64_t seed)
{
    const PairWeights weights = maximum_likelihood_weights(noise, e.offsets);
    Cell cell;
    cell.runs = runs, cell.scores.resize(estimators.size());
    SeededRandom random(seed);
    for (size_t k = 0; k < runs; k++)
    {
        const ReportWorld world = report_world(e.points, e.planes, noise, random);
        const Matrix6 bound =
            as_matrix(observability(world.exact, world.truth(), with_weights(weights, 1.0)).covariance_twist);
        cell.translation.add(bound.topLeftCorner<3, 3>());
        cell.rotation.add(bound.bottomRightCorner<3, 3>());
        for (size_t i = 0; i < estimators.size(); i++)
        {
            OptimalTF_Result r;
            if (!estimators[i](world.pairings, weights, r) || r.status != SolveStatus::Determined)
                cell.failures++;
            cell.scores[i].add(error_of(r.optimalPose, world));
        }
    }
    return cell;
}

/// A grid of noises: all of it in the full run, else its diagonal.
std::vector<ReportNoise> noises(bool with_normals)
{
    const std::vector<double> points = {.01, .02, .05, .1, .2, .5, 1}, angles = {.1, .2, .5, 1, 2, 5};
    std::vector<ReportNoise> out;
    for (size_t i = 0; i < points.size(); i++)
    {
        if (!with_normals)
            out.push_back({points[i], 0});
        else if (!full_run())
            out.push_back({points[i], angles[i % angles.size()] * DEG});
        else
            for (const double angle : angles) out.push_back({points[i], angle * DEG});
    }
    return out;
}

const std::vector<std::string> NAMES = {"Gauss-Newton", "Horn",   "Report |1|", "LeastSq |1|",
                                        "Newton |1|",   "Report", "LeastSq"};
const std::vector<Estimator> ESTIMATORS = {gauss_newton,
                                           horn,
                                           olae(OlaeSystem::Report, true),
                                           olae(OlaeSystem::LeastSquares, true),
                                           olae(OlaeSystem::Newton, true),
                                           olae(OlaeSystem::Report, false),
                                           olae(OlaeSystem::LeastSquares, false)};
enum : size_t
{
    GAUSS_NEWTON,
    HORN,
    OLAE_REPORT_UNIT,
    OLAE_LEAST_SQUARES_UNIT
};

void print_head(const Experiment& e)
{
    if (!full_run()) return;
    std::cout << "\nRMSE / Cramer-Rao bound (rotation translation; chance: 0.015), " << e.name
              << "; OLAE's systems with points as unit vectors (|1|) and with their lengths\n"
              << " sigma_p m  angle deg  bound mrad  bound m ";
    for (const auto& name : NAMES) std::cout << std::setw(16) << name;
    std::cout << "\n";
}
void print(const ReportNoise& noise, const Cell& c)
{
    if (!full_run()) return;
    const auto n = static_cast<double>(c.runs);
    std::cout << std::defaultfloat << std::setprecision(4) << std::setw(10) << noise.points << std::setw(11)
              << noise.normals / DEG << std::setw(12) << 1e3 * std::sqrt(c.rotation.mean / n) << std::setw(9)
              << std::sqrt(c.translation.mean / n) << " " << std::fixed << std::setprecision(3);
    for (const Score& s : c.scores)
        std::cout << std::setw(9) << c.rotation.ratio(s.rotation_sq) << std::setw(7)
                  << c.translation.ratio(s.translation_sq);
    std::cout << "\n" << std::defaultfloat;
}

/// An estimator on the bound. Fewer runs than the full 1000 may miss 1.05 by chance: by four deviations.
void expect_on_bound(const BoundSum& bound, double squares, const std::string& what)
{
    const double chance = 4 * bound.deviation();
    EXPECT_LE(bound.ratio(squares), 1.05 + (full_run() ? 0.0 : chance)) << what;
    // Normals turned by 5 degrees move less than first order says, by s^2 / 2 = 0.004 of it.
    EXPECT_GE(bound.ratio(squares), 0.99 - chance) << what << ": better than possible";
}
void expect_on_bound(const Cell& c, size_t estimator)
{
    expect_on_bound(c.rotation, c.scores[estimator].rotation_sq, NAMES[estimator] + ", rotation");
    expect_on_bound(c.translation, c.scores[estimator].translation_sq, NAMES[estimator] + ", translation");
}

void run_experiment(const Experiment& e, uint64_t seed, const std::function<void(const Cell&)>& check)
{
    // The others are for the table.
    const std::vector<Estimator> used(ESTIMATORS.begin(),
                                      full_run() ? ESTIMATORS.end() : ESTIMATORS.begin() + 4);
    print_head(e);
    for (const ReportNoise& noise : noises(e.planes > 0))
    {
        SCOPED_TRACE(e.name + ", sigma_p " + std::to_string(noise.points) + " m, normals " +
                     std::to_string(noise.normals / DEG) + " deg, seed " + std::to_string(seed));
        const Cell cell = run_cell(e, noise, used, repetitions(30, 1000), seed++);
        print(noise, cell);
        EXPECT_EQ(cell.failures, 0u);
        expect_on_bound(cell, GAUSS_NEWTON);
        check(cell);
    }
}
}  // namespace

TEST(CramerRao, IsReachedByGaussNewtonAndHornOnPoints)
{
    run_experiment({"100 points", 100, 0, false}, 1000,
                   [](const Cell& c)
                   {
                       expect_on_bound(c, HORN);
                       // What OLAE loses with the lengths of the points.
                       EXPECT_GT(c.scores[OLAE_REPORT_UNIT].rotation_sq, c.scores[HORN].rotation_sq);
                       EXPECT_GT(c.scores[OLAE_LEAST_SQUARES_UNIT].rotation_sq, c.scores[HORN].rotation_sq);
                   });
}

TEST(CramerRao, IsReachedByGaussNewtonAndHornOnOnePointAndNormals)
{
    run_experiment({"1 point and 100 planes, directions only", 1, 100, false}, 2000,
                   [](const Cell& c) { expect_on_bound(c, HORN); });
}

TEST(CramerRao, IsReachedByGaussNewtonOnOnePointAndPlanesWithOffsets)
{
    run_experiment({"1 point and 100 planes with offsets", 1, 100, true}, 3000, [](const Cell&) {});
}

TEST(CramerRao, IsReachedByGaussNewtonOnPointsAndPlanes)
{
    run_experiment({"100 points and 100 planes with offsets", 100, 100, true}, 4000, [](const Cell&) {});
}

// ---- OLAE's Newton steps ----------------------------------------------------------------------------------

namespace
{
/// Wahba's problem by singular values: the rotation that maximises tr(R' B), B = sum w a b'.
struct Wahba
{
    Matrix3d B = Matrix3d::Zero();
    double weights = 0;

    void add(double w, const Vector3d& a, const Vector3d& b)
    {
        B += w * a.normalized() * b.normalized().transpose(), weights += w;
    }
    Matrix3d rotation() const
    {
        const Eigen::JacobiSVD<Matrix3d> svd(B, Eigen::ComputeFullU | Eigen::ComputeFullV);
        return svd.matrixU() * Vector3d(1, 1, sign(svd)).asDiagonal() * svd.matrixV().transpose();
    }
    /// How well it is determined: the cost's least curvature, 0 to 1.
    double gap() const
    {
        const Eigen::JacobiSVD<Matrix3d> svd(B, Eigen::ComputeFullU | Eigen::ComputeFullV);
        return (svd.singularValues()(1) + sign(svd) * svd.singularValues()(2)) / weights;
    }

 private:
    static double sign(const Eigen::JacobiSVD<Matrix3d>& svd)
    {
        return svd.matrixU().determinant() * svd.matrixV().determinant() > 0 ? 1 : -1;
    }
};

/// Compares, and counts.
class WahbaCheck
{
 public:
    void compare(const Pairings& p, const Wahba& wahba)
    {
        OptimalTF_Result r;
        ASSERT_TRUE(optimal_tf_olae(p, {}, r, std::nullopt, {OlaeSystem::Newton, true}));
        const double angle = angle_between(rotation_of(r.optimalPose), wahba.rotation());
        // Both sides round to some units in the last place of B; the curvature divides that.
        const bool clear = wahba.gap() > 0.01;
        EXPECT_LE(angle, clear ? 1e-12 : 1e-14 / wahba.gap());
        (clear ? clear_ : unclear_)++;
        if (clear) largest_ = std::max(largest_, angle);
    }
    size_t clear() const { return clear_; }
    size_t unclear() const { return unclear_; }
    double largest() const { return largest_; }

 private:
    size_t clear_ = 0, unclear_ = 0;
    double largest_ = 0;
};

/// Each pairing's weight, in the pairings and as a list.
std::vector<double> random_weights(WeightRuns& runs, size_t n, SeededRandom& random)
{
    std::vector<double> w(n);
    for (double& x : w) x = random.uniform(0.1, 3);
    runs = as_runs(w);
    return w;
}

void compare_on_normals(size_t n, double noise, SeededRandom& random, WahbaCheck& check)
{
    const Matrix3d R = any_rotation(random);
    Pairings p;
    const auto w = random_weights(p.pl2pl_weights, n, random);
    Wahba wahba;
    for (size_t i = 0; i < n; i++)
    {
        const Vector3d b = random_direction(random), a = R * b + noise * gaussian_vector(random);
        p.paired_pl2pl.push_back({patch(gaussian_vector(random), a), patch(gaussian_vector(random), b)});
        wahba.add(w[i], a, b);
    }
    check.compare(p, wahba);
}

void compare_on_points(size_t n, double noise, SeededRandom& random, WahbaCheck& check)
{
    const double size = 5;
    Pairings p = moved_points(random_points(n, size, random()), any_rotation(random),
                              random_point(random, 20), noise * size, random());
    const auto w = random_weights(p.point_weights, n, random);
    Vector3d a_mean = Vector3d::Zero(), b_mean = Vector3d::Zero();
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        a_mean += w[i] * global_of(p, i), b_mean += w[i] * local_of(p, i), sum += w[i];
    a_mean /= sum, b_mean /= sum;
    Wahba wahba;
    for (size_t i = 0; i < n; i++) wahba.add(w[i], global_of(p, i) - a_mean, local_of(p, i) - b_mean);
    check.compare(p, wahba);
}
}  // namespace

TEST(OlaeNewton, IsTheOptimumOfWahbasProblemForTheSameUnitVectors)
{
    WahbaCheck check;
    for (const double noise : {.01, .03, .1, .3})
        for (const size_t n : {3u, 4u, 5u, 10u, 30u, 100u})
            for (uint64_t seed = 1; seed <= repetitions(20, 1000); seed++)
            {
                SCOPED_TRACE("noise " + std::to_string(noise) + ", n " + std::to_string(n) + ", seed " +
                             std::to_string(seed));
                SeededRandom random(seed);
                compare_on_normals(n, noise, random, check);
                compare_on_points(n, noise, random, check);
            }
    EXPECT_GT(check.clear(), 20 * check.unclear());
    print_line("OLAE's Newton steps, largest angle to Wahba's optimum, rad", check.largest());
}

TEST(OlaeNewton, IsNotTheReportsSystemOnNoise)
{
    // So that the test above tells the two apart.
    SeededRandom random(7);
    const ReportWorld world = report_world(10, 0, {5, 0}, random);
    OptimalTF_Result report, newton;
    ASSERT_TRUE(optimal_tf_olae(world.pairings, {}, report, std::nullopt, {OlaeSystem::Report, true}));
    ASSERT_TRUE(optimal_tf_olae(world.pairings, {}, newton, std::nullopt, {OlaeSystem::Newton, true}));
    EXPECT_GT(angle_between(rotation_of(report.optimalPose), rotation_of(newton.optimalPose)), 1e-4);
}

// ---- Covariances ------------------------------------------------------------------------------------------

namespace
{
/// Measurements of a pose with weights that are inverse variances.
struct Measurements
{
    Pairings pairings;
    CPose3D truth;
    PairWeights weights;
};
using Measure = std::function<Measurements(SeededRandom&)>;

Measure report_measurements(size_t points, size_t planes, const ReportNoise& noise)
{
    return [=](SeededRandom& random)
    {
        const ReportWorld w = report_world(points, planes, noise, random);
        return Measurements{w.pairings, w.truth(), maximum_likelihood_weights(noise)};
    };
}

/// All five kinds, each with a noise of its own.
Measurements mixed_measurements(SeededRandom& random)
{
    const Matrix3d R = any_rotation(random);
    const Vector3d t = random_point(random, 20);
    const double size = 5, pt2pt = .1, pt2ln = .05, pt2pl = .03, ln2ln = .08, pl2pl = .04;
    Measurements out{{}, make_pose(R, t), {}};
    out.pairings = random_pairings({10, 0, 0, 0, 0}, R, t, random, pt2pt, size);
    out.pairings.push_back(random_pairings({0, 10, 0, 0, 0}, R, t, random, pt2ln, size));
    out.pairings.push_back(random_pairings({0, 0, 10, 0, 0}, R, t, random, pt2pl, size));
    out.pairings.push_back(random_pairings({0, 0, 0, 10, 0}, R, t, random, ln2ln, size));
    out.pairings.push_back(random_pairings({0, 0, 0, 0, 10}, R, t, random, pl2pl, size));
    const auto inverse_square = [](double sigma) { return 1 / (sigma * sigma); };
    PairWeights& w = out.weights;
    w.pt2pt = inverse_square(pt2pt), w.pt2ln = inverse_square(pt2ln), w.pt2pl = inverse_square(pt2pl);
    w.ln2ln = inverse_square(ln2ln), w.ln2ln_direction = inverse_square(ln2ln / size);
    w.pl2pl = inverse_square(pl2pl), w.pl2pl_direction = inverse_square(pl2pl / size);
    return out;
}

void scale_weights(PairWeights& w, double factor)
{
    for (double* x : {&w.pt2pt, &w.pt2ln, &w.pt2pl, &w.ln2ln, &w.pl2pl}) *x *= factor;
    if (w.ln2ln_direction) *w.ln2ln_direction *= factor;
    if (w.pl2pl_direction) *w.pl2pl_direction *= factor;
}

struct NamedMeasure
{
    const char* name;
    Measure measure;
};
const std::vector<NamedMeasure> MEASURES = {
    {"100 points", report_measurements(100, 0, {0.5, 0})},
    {"100 planes and 1 point", report_measurements(1, 100, {0.5, 2 * DEG})},
    {"mixed", mixed_measurements}};

CPose3D estimate(const Measurements& m)
{
    OptimalTF_Result r;
    EXPECT_TRUE(gauss_newton(m.pairings, m.weights, r));
    EXPECT_EQ(r.status, SolveStatus::Determined);
    return r.optimalPose;
}

/// On the tangent of SE(3): x y z and the rotation vector, in the global frame.
Vector6 twist_error(const CPose3D& pose, const CPose3D& truth)
{
    const Eigen::AngleAxisd turn(Matrix3d(rotation_of(pose) * rotation_of(truth).transpose()));
    Vector6 e;
    e << translation_of(pose) - translation_of(truth), turn.angle() * turn.axis();
    return e;
}
Vector6 coordinates_error(const CPose3D& pose, const CPose3D& truth)
{
    Vector6 e = coordinates(pose) - coordinates(truth);
    for (int i = 3; i < 6; i++) e(i) = std::remainder(e(i), 2 * M_PI);
    return e;
}
double squared_in_units_of(const Matrix6& covariance, const Vector6& e)
{
    return e.dot(covariance.ldlt().solve(e));
}

/// Mean of a sample, and its variance.
struct Statistics
{
    double n = 0, sum = 0, squares = 0;
    void add(double x) { n += 1, sum += x, squares += x * x; }
    double mean() const { return sum / n; }
    double variance() const { return squares / n - mean() * mean(); }
};

/** Chi-square of 6 degrees of freedom has the mean 6 and the variance 12. The band asked for is 0.3 of 10 000
 * runs; of fewer, four standard deviations of their mean and 0.06 for what first order neglects.
 */
double nees_band(double runs)
{
    return full_run() ? 0.3 : 4 * std::sqrt(12 / runs) + 0.06;
}

size_t monte_carlo_runs()
{
    return repetitions(250, 10000);
}
}  // namespace

TEST(Covariance, OfTheTwistPredictsTheErrors)
{
    for (const auto& [name, measure] : MEASURES)
    {
        SCOPED_TRACE(std::string(name) + ", seed 1");
        SeededRandom random(1);
        Statistics nees;
        for (size_t k = 0; k < monte_carlo_runs(); k++)
        {
            const Measurements m = measure(random);
            const Matrix6 covariance =
                as_matrix(observability(m.pairings, m.truth, with_weights(m.weights, 1.0)).covariance_twist);
            ASSERT_LT(std::sqrt(covariance.bottomRightCorner<3, 3>().eigenvalues().real().maxCoeff()), DEG);
            nees.add(squared_in_units_of(covariance, twist_error(estimate(m), m.truth)));
        }
        EXPECT_NEAR(nees.mean(), 6, nees_band(nees.n));
        print_line(std::string("NEES of the twist, ") + name, nees.mean());
    }
}

TEST(Covariance, OfTheCoordinatesPredictsTheErrorsUpToEightyDegreesOfPitch)
{
    for (const auto& [name, measure] : MEASURES)
    {
        SCOPED_TRACE(std::string(name) + ", seed 2");
        SeededRandom random(2);
        Statistics nees;
        double steepest = 0;
        while (nees.n < static_cast<double>(monte_carlo_runs()))
        {
            const Measurements m = measure(random);
            if (std::abs(m.truth.pitch()) > 80 * DEG) continue;
            steepest = std::max(steepest, std::abs(m.truth.pitch()));
            const Matrix6 cov = as_matrix(covariance(m.pairings, m.truth, with_weights(m.weights, 1.0)));
            nees.add(squared_in_units_of(cov, coordinates_error(estimate(m), m.truth)));
        }
        EXPECT_GT(steepest, 70 * DEG);
        EXPECT_NEAR(nees.mean(), 6, nees_band(nees.n));
        print_line(std::string("NEES of the coordinates, ") + name, nees.mean());
    }
}

TEST(Covariance, PredictsTheErrorsWithTheVarianceEstimatedFromTheResiduals)
{
    for (const auto& [name, measure] : MEASURES)
    {
        SCOPED_TRACE(std::string(name) + ", seed 3");
        SeededRandom random(3);
        Statistics nees, variance;
        const double unit = 0.07;  // m: the deviation of a residual of weight 1, which is not told
        for (size_t k = 0; k < monte_carlo_runs(); k++)
        {
            Measurements m = measure(random);
            scale_weights(m.weights, unit * unit);
            const CPose3D pose = estimate(m);
            const Observability o = observability(m.pairings, pose, with_weights(m.weights, std::nullopt));
            nees.add(squared_in_units_of(as_matrix(o.covariance_twist), twist_error(pose, m.truth)));
            variance.add(o.sigma * o.sigma / (unit * unit));
        }
        EXPECT_NEAR(variance.mean(), 1, 4 * std::sqrt(variance.variance() / variance.n) + 0.005);
        // The estimate s^2 is in the denominator: E[1 / s^2] = 1 + var(s^2), to second order.
        const double expected = 6 * (1 + variance.variance());
        EXPECT_NEAR(nees.mean(), expected, nees_band(nees.n));
        print_line(std::string("NEES with estimated variance, ") + name, nees.mean());
        print_line(std::string("  expected, ") + name, expected);
        print_line(std::string("  estimated variance / true one, ") + name, variance.mean());
    }
}
