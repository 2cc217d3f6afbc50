// Any call with valid parameters gives a pose or says why not, whatever the pairings: a search for exceptions
// to the promises of OptimalTF_Result. A case is a function of its seed, which a failure prints.
#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/Solver_OLAE.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>

#include <array>
#include <limits>
#include <set>
#include <sstream>

#include "make_primitives.h"
#include "pose_minimiser.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN(),
                 INF = std::numeric_limits<double>::infinity();

enum class Call
{
    Horn,
    Olae,
    GaussNewton,
    SolverHorn,  ///< with a prior, perhaps
    SolverOlae,
    Count
};
const std::array<const char*, 5> CALL_NAMES = {"optimal_tf_horn", "optimal_tf_olae",
                                               "optimal_tf_gauss_newton", "Solver_Horn", "Solver_OLAE"};

struct Case
{
    Call call = Call::Horn;
    Pairings pairings;
    WeightParameters weights;
    OlaeParameters olae;
    OptimalTF_GN_Parameters gauss_newton;
    std::optional<CPose3D> guess;
    std::optional<mrpt::poses::CPose3DPDFGaussianInf> prior;  ///< for Solver_*
};

// ---- Drawing ----------------------------------------------------------------------------------------------

double power_of_ten(SeededRandom& random, double lo, double hi)
{
    return std::pow(10.0, random.uniform(lo, hi));
}
bool chance(SeededRandom& random, double probability)
{
    return random.uniform() < probability;
}
template <class Enum>
Enum any_of(SeededRandom& random, size_t count)
{
    return static_cast<Enum>(random.index(count));
}

/// Where the primitives lie, and how they go together.
class Scene
{
 public:
    explicit Scene(SeededRandom& random) : random_(random)
    {
        shape_ = random.index(5);
        relation_ = random.index(3);
        size_ = chance(random, 0.5) ? 1 : power_of_ten(random, -6, 6);
        frame_ = chance(random, 0.5) ? Matrix3d(Matrix3d::Identity()) : any_rotation(random);
        if (chance(random, 0.3)) centre_ = random_point(random, size_ * power_of_ten(random, 0, 4));
        R_ = shape_ == AXIS_ALIGNED || chance(random, 0.2) ? quarter_turns() : any_rotation(random);
        t_ = chance(random, 0.3) ? Vector3d(0, 0, 0) : size_ * integers(3);
        bad_ = chance(random, 0.3) ? 0.2 : 0.0;
    }

    CPose3D pose() const { return make_pose(R_, t_); }
    double size() const { return size_; }

    Vector3d global_point()
    {
        Vector3d p = shape_ == AXIS_ALIGNED ? integers(2) : random_point(random_, 1);
        if (shape_ == COPLANAR || shape_ == COLLINEAR) p.z() = 0;
        if (shape_ == COLLINEAR) p.y() = 0;
        if (shape_ == ONE_PLACE) p.setZero();
        return spoilt(size_ * (frame_ * p) + centre_);
    }
    Vector3d global_direction()
    {
        Vector3d u = random_direction(random_);
        if (shape_ != ANYWHERE || chance(random_, 0.2)) u = frame_ * Vector3d(Vector3d::Unit(axis()));
        return any_length(chance(random_, 0.5) ? u : Vector3d(-u));
    }
    /// The local side of a point of the global side.
    Vector3d local_point(const Vector3d& global)
    {
        if (relation_ == UNRELATED) return global_point();
        return spoilt(R_.transpose() * (global - t_) + noise() * size_ * random_point(random_, 1));
    }
    Vector3d local_direction(const Vector3d& global)
    {
        if (relation_ == UNRELATED) return global_direction();
        const Vector3d u = R_.transpose() * global.normalized() + noise() * random_point(random_, 1);
        return any_length(chance(random_, 0.7) ? u : Vector3d(-u));
    }

 private:
    enum Shape : size_t
    {
        ANYWHERE,
        COPLANAR,
        COLLINEAR,
        AXIS_ALIGNED,
        ONE_PLACE
    };
    enum Relation : size_t
    {
        EXACT,
        NOISY,
        UNRELATED
    };

    int axis() { return static_cast<int>(random_.index(3)); }
    /// Small ones, most of them zero.
    Vector3d integers(int largest)
    {
        Vector3d v(0, 0, 0);
        for (int i = 0; i < 3; i++)
            if (chance(random_, 0.4))
                v(i) = static_cast<double>(random_.index(static_cast<size_t>(2 * largest + 1))) - largest;
        return v;
    }
    Matrix3d quarter_turns()
    {
        Matrix3d R = Matrix3d::Identity();
        for (int k = 0; k < 3; k++)
        {
            const Vector3d u = Vector3d::Unit(axis());
            const auto turns = random_.index(4);
            for (size_t i = 0; i < turns; i++)
                R = Matrix3d(R * rotation_about(u, M_PI / 2)).array().round().matrix();
        }
        return R;
    }
    double noise() const { return relation_ == NOISY ? 0.05 : 0.0; }
    Vector3d any_length(const Vector3d& u)
    {
        if (bad_ > 0 && chance(random_, bad_ / 2)) return Vector3d::Zero();
        return spoilt(chance(random_, 0.5) ? u : Vector3d(power_of_ten(random_, -6, 6) * u));
    }
    Vector3d spoilt(Vector3d v)
    {
        if (bad_ > 0 && chance(random_, bad_ / 2))
            v(axis()) = std::array<double, 3>{NaN, INF, -INF}[random_.index(3)];
        return v;
    }

    SeededRandom& random_;
    size_t shape_ = 0, relation_ = 0;
    double size_ = 1, bad_ = 0;
    Matrix3d frame_, R_;
    Vector3d centre_ = Vector3d::Zero(), t_ = Vector3d::Zero();
};

/// 0 to 12, often few: those are the difficult ones.
size_t any_count(SeededRandom& random)
{
    return chance(random, 0.5) ? 0 : random.index(chance(random, 0.5) ? 4 : 13);
}

/// `count` of what `make` gives, some of them repeated.
template <class List, class Make>
void fill(SeededRandom& random, size_t count, List& list, const Make& make)
{
    for (size_t i = 0; i < count; i++)
    {
        if (!list.empty() && chance(random, 0.1))
        {
            const auto again = list[random.index(list.size())];
            list.push_back(again);
        }
        else
            list.push_back(make());
    }
}

WeightRuns any_runs(SeededRandom& random, size_t count)
{
    WeightRuns runs;
    if (chance(random, 0.5)) return runs;
    const bool all_zero = chance(random, 0.1), wide = chance(random, 0.5);
    for (size_t covered = 0; covered < count && !chance(random, 0.1); covered += runs.back().first)
    {
        const double w = all_zero || chance(random, 0.2) ? 0
                         : wide                          ? power_of_ten(random, -9, 9)
                                                         : random.uniform();
        runs.emplace_back(random.index(4), w);  // runs of none and runs beyond the list are valid too
    }
    return runs;
}

Pairings any_pairings(SeededRandom& random, Scene& scene)
{
    Pairings p;
    fill(random, any_count(random), p.paired_pt2pt,
         [&]()
         {
             const Vector3d q = scene.global_point();
             return mrpt::tfest::TMatchingPair_d(0, 0, to_mrpt(q), to_mrpt(scene.local_point(q)));
         });
    fill(random, any_count(random), p.paired_pt2ln,
         [&]()
         {
             const Vector3d q = scene.global_point(), u = scene.global_direction();
             return point_line_pair_t{line(q, u), to_mrpt(scene.local_point(q))};
         });
    fill(random, any_count(random), p.paired_pt2pl,
         [&]()
         {
             const Vector3d q = scene.global_point(), n = scene.global_direction();
             return point_plane_pair_t{patch(q, n), to_mrpt(scene.local_point(q))};
         });
    fill(random, any_count(random), p.paired_ln2ln,
         [&]()
         {
             const Vector3d q = scene.global_point(), u = scene.global_direction(), b = scene.local_point(q);
             return matched_line_t{line(q, u), line(b, scene.local_direction(u))};
         });
    fill(random, any_count(random), p.paired_pl2pl,
         [&]()
         {
             const Vector3d q = scene.global_point(), n = scene.global_direction(), b = scene.local_point(q);
             return matched_plane_t{patch(q, n), patch(b, scene.local_direction(n))};
         });
    p.point_weights = any_runs(random, p.paired_pt2pt.size());
    p.pt2ln_weights = any_runs(random, p.paired_pt2ln.size());
    p.pt2pl_weights = any_runs(random, p.paired_pt2pl.size());
    p.ln2ln_weights = any_runs(random, p.paired_ln2ln.size());
    p.pl2pl_weights = any_runs(random, p.paired_pl2pl.size());
    return p;
}

PairWeights any_pair_weights(SeededRandom& random)
{
    PairWeights w;
    if (chance(random, 0.5)) return w;
    for (double* kind : {&w.pt2pt, &w.pt2ln, &w.pt2pl, &w.ln2ln, &w.pl2pl})
        if (chance(random, 0.4)) *kind = chance(random, 0.3) ? 0 : power_of_ten(random, -9, 9);
    for (auto* kind : {&w.ln2ln_direction, &w.pl2pl_direction})
        if (chance(random, 0.4)) *kind = chance(random, 0.3) ? 0 : power_of_ten(random, -9, 9);
    w.ln2ln_sign = any_of<DirectionSign>(random, 2), w.pl2pl_sign = any_of<DirectionSign>(random, 2);
    return w;
}

CPose3D any_estimate(SeededRandom& random, const Scene& scene)
{
    switch (random.index(4))
    {
        case 0:
            return CPose3D();
        case 1:
            return scene.pose();
        case 2:
            return scene.pose() + make_pose(rotation_about(random_direction(random), random.uniform(0, 0.1)),
                                            random_point(random, 0.1 * scene.size()));
        default:
            return make_pose(any_rotation(random), random_point(random, power_of_ten(random, -6, 6)));
    }
}

RobustKernel any_kernel(SeededRandom& random)
{
    return chance(random, 0.5) ? RobustKernel::None : any_of<RobustKernel>(random, 6);
}
double any_length(SeededRandom& random, const Scene& scene)
{
    return chance(random, 0.5) ? scene.size() * power_of_ten(random, -2, 1) : power_of_ten(random, -6, 6);
}

WeightParameters any_weight_parameters(SeededRandom& random, const Scene& scene)
{
    WeightParameters wp;
    wp.pair_weights = any_pair_weights(random);
    if (chance(random, 0.3)) wp.sigma = power_of_ten(random, -6, 3);
    if (chance(random, 0.4)) return wp;
    wp.use_scale_outlier_detector = chance(random, 0.3);
    wp.scale_outlier_threshold = 1 + power_of_ten(random, -4, 1);
    wp.outlier_rejection = any_of<OutlierRejection>(random, 5);
    wp.outlier_threshold = any_length(random, scene);
    wp.robust_kernel = any_kernel(random), wp.robust_kernel_param = any_length(random, scene);
    wp.currentEstimateForRobust = any_estimate(random, scene);
    return wp;
}

mrpt::poses::CPose3DPDFGaussianInf any_prior(SeededRandom& random, const Scene& scene)
{
    const CPose3D mean = any_estimate(random, scene);
    Matrix6 information = Matrix6::Zero();
    switch (random.index(4))
    {
        case 0:
            break;
        case 1:
            information = power_of_ten(random, -12, 15) * Matrix6::Identity();
            break;
        case 2:
            information = random_information(random, power_of_ten(random, -9, 9));
            break;
        default:  // on some coordinates only
            for (int i = 0; i < 6; i++)
                if (chance(random, 0.5)) information(i, i) = power_of_ten(random, -9, 12);
    }
    return prior_of(mean, information);
}

OptimalTF_GN_Parameters any_gauss_newton(SeededRandom& random, const Scene& scene)
{
    OptimalTF_GN_Parameters p;
    p.pairWeights = any_pair_weights(random);
    if (chance(random, 0.5)) p.linearizationPoint = any_estimate(random, scene);
    if (chance(random, 0.4)) p.prior = any_prior(random, scene);
    if (chance(random, 0.3)) p.minDelta = chance(random, 0.3) ? 0 : power_of_ten(random, -15, 0);
    if (chance(random, 0.2)) p.maxCost = any_length(random, scene);
    p.maxInnerLoopIterations = static_cast<uint32_t>(random.index(12));
    p.kernel = any_kernel(random), p.kernelParam = any_length(random, scene);
    if (chance(random, 0.3)) p.sigma = power_of_ten(random, -6, 3);
    return p;
}

Case random_case(uint64_t seed)
{
    SeededRandom random(seed);
    Scene scene(random);
    Case c;
    c.call = any_of<Call>(random, static_cast<size_t>(Call::Count));
    c.pairings = any_pairings(random, scene);
    c.weights = any_weight_parameters(random, scene);
    c.olae.system = any_of<OlaeSystem>(random, 3), c.olae.normalize_points = chance(random, 0.5);
    c.gauss_newton = any_gauss_newton(random, scene);
    if (chance(random, 0.6)) c.guess = any_estimate(random, scene);
    if (chance(random, 0.6)) c.prior = any_prior(random, scene);
    return c;
}

// ---- Calling ----------------------------------------------------------------------------------------------

/// With something in it, to see what a call leaves alone.
OptimalTF_Result used_before()
{
    OptimalTF_Result r;
    r.optimalPose = CPose3D(1, 2, 3, 0.1, 0.2, 0.3);
    r.status = SolveStatus::Determined, r.rank = 6, r.skipped = 1000;
    return r;
}

bool call(const Case& c, OptimalTF_Result& result)
{
    SolverContext context;
    context.guessRelativePose = c.guess, context.prior = c.prior;
    switch (c.call)
    {
        case Call::Horn:
        {
            WeightParameters wp = c.weights;
            if (c.guess) wp.currentEstimateForRobust.reset();  // then it is the guess
            return optimal_tf_horn(c.pairings, wp, result, c.guess);
        }
        case Call::Olae:
            return optimal_tf_olae(c.pairings, c.weights, result, c.guess, c.olae);
        case Call::GaussNewton:
            return optimal_tf_gauss_newton(c.pairings, result, c.gauss_newton);
        case Call::SolverHorn:
        {
            Solver_Horn solver;
            solver.pairingsWeightParameters = c.weights;
            return solver.optimal_pose(c.pairings, result, context);
        }
        default:
        {
            Solver_OLAE solver;
            solver.pairingsWeightParameters = c.weights, solver.parameters = c.olae;
            return solver.optimal_pose(c.pairings, result, context);
        }
    }
}

// ---- What must be true ------------------------------------------------------------------------------------

const PairWeights& pair_weights(const Case& c)
{
    return c.call == Call::GaussNewton ? c.gauss_newton.pairWeights : c.weights.pair_weights;
}

/// How many pairings count at all, and how many of these cannot be used.
struct Counts
{
    size_t in_use = 0, spoilt = 0;
};

bool is_direction(const Vector3d& v)
{
    return v.allFinite() && v.cwiseAbs().maxCoeff() > 0;
}
bool is_good(const mrpt::math::TPoint3D& p)
{
    return to_eigen(p).allFinite();
}
bool is_good(const mrpt::math::TLine3D& l)
{
    return is_good(l.pBase) && is_direction(to_eigen(l.director));
}
bool is_good(const plane_patch_t& p)
{
    return is_good(p.centroid) && is_direction({p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]});
}
bool is_good(const mrpt::tfest::TMatchingPair_d& p)
{
    return is_good(mrpt::math::TPoint3D(p.global)) && is_good(mrpt::math::TPoint3D(p.local));
}
bool is_good(const point_line_pair_t& p)
{
    return is_good(p.ln_global) && is_good(p.pt_local);
}
bool is_good(const point_plane_pair_t& p)
{
    return is_good(p.pl_global) && is_good(p.pt_local);
}
bool is_good(const matched_line_t& p)
{
    return is_good(p.ln_global) && is_good(p.ln_local);
}
bool is_good(const matched_plane_t& p)
{
    return is_good(p.p_global) && is_good(p.p_local);
}

template <class List>
void count_list(const List& list, const WeightRuns& runs, double position, double direction, Counts& counts)
{
    const auto each = expanded_weights(runs, list.size());
    for (size_t i = 0; i < list.size(); i++)
    {
        if (!(each[i] > 0 && std::max(position, direction) > 0)) continue;
        counts.in_use++;
        counts.spoilt += is_good(list[i]) ? 0 : 1;
    }
}

Counts counts_of(const Case& c)
{
    const Pairings& p = c.pairings;
    const PairWeights& w = pair_weights(c);
    Counts n;
    count_list(p.paired_pt2pt, p.point_weights, w.pt2pt, 0, n);
    count_list(p.paired_pt2ln, p.pt2ln_weights, w.pt2ln, 0, n);
    count_list(p.paired_pt2pl, p.pt2pl_weights, w.pt2pl, 0, n);
    count_list(p.paired_ln2ln, p.ln2ln_weights, w.ln2ln, w.ln2ln_direction.value_or(w.ln2ln), n);
    count_list(p.paired_pl2pl, p.pl2pl_weights, w.pl2pl, w.pl2pl_direction.value_or(w.pl2pl), n);
    return n;
}

/// Can the kernel or the rejection take the weight of all pairings?
bool may_lose_all(const Case& c)
{
    const auto ends = [](RobustKernel k) { return k == RobustKernel::Tukey || k == RobustKernel::Truncated; };
    if (c.call == Call::GaussNewton) return ends(c.gauss_newton.kernel);
    return ends(c.weights.robust_kernel) || c.weights.use_scale_outlier_detector ||
           c.weights.outlier_rejection != OutlierRejection::None;
}

/// Sentences on what is wrong.
class Complaints
{
 public:
    void expect(bool fact, const std::string& sentence)
    {
        if (!fact) text_ << sentence << "; ";
    }
    std::string text() const { return text_.str(); }

 private:
    std::ostringstream text_;
};

bool increasing_below(const std::vector<size_t>& indices, size_t count)
{
    for (size_t i = 0; i < indices.size(); i++)
        if (indices[i] >= count || (i > 0 && indices[i] <= indices[i - 1])) return false;
    return true;
}

void check_outliers(const Pairings& p, const OutlierIndices& o, Complaints& complaints)
{
    complaints.expect(increasing_below(o.point2point, p.paired_pt2pt.size()) &&
                          increasing_below(o.point2line, p.paired_pt2ln.size()) &&
                          increasing_below(o.point2plane, p.paired_pt2pl.size()) &&
                          increasing_below(o.line2line, p.paired_ln2ln.size()) &&
                          increasing_below(o.plane2plane, p.paired_pl2pl.size()),
                      "outliers are not increasing and in range");
}

void check_free(const FreeTwist& f, Complaints& complaints)
{
    complaints.expect(std::abs(to_eigen(f.axis).norm() - 1) < 1e-9,
                      "the axis of a free motion is no unit vector");
    complaints.expect(to_eigen(f.through).allFinite(),
                      "a free motion goes through a point that is not finite");
    complaints.expect(f.sigma >= 0, "the deviation of a free motion is negative or NaN");
}

void check_pose(const OptimalTF_Result& r, Complaints& complaints)
{
    const Matrix3d R = rotation_of(r.optimalPose);
    // Products of unit quaternions: a few roundings.
    complaints.expect((R * R.transpose() - Matrix3d::Identity()).norm() < 1e-12,
                      "the rotation is not orthonormal");
    complaints.expect(std::abs(R.determinant() - 1) < 1e-12, "the determinant is not 1");
    complaints.expect(translation_of(r.optimalPose).allFinite(), "the translation is not finite");
    complaints.expect(r.optimalScale == 1, "the scale is not 1");
    complaints.expect(r.status != SolveStatus::NoPairings, "true, but NoPairings");
    complaints.expect((r.status == SolveStatus::Determined) == (r.rank == 6), "status and rank disagree");
    complaints.expect(r.rank >= 0 && static_cast<size_t>(r.rank) + r.free.size() == 6,
                      "rank and free do not make 6");
    for (const auto& f : r.free) check_free(f, complaints);
}

void check_nothing_done(const OptimalTF_Result& r, const Case& c, Complaints& complaints)
{
    const CPose3D before = used_before().optimalPose;
    complaints.expect(rotation_of(r.optimalPose) == rotation_of(before) &&
                          translation_of(r.optimalPose) == translation_of(before),
                      "false, but the pose has changed");
    complaints.expect(r.status == SolveStatus::NoPairings, "false, but not NoPairings");
    complaints.expect(r.rank == 0 && r.free.empty(), "false, but a rank or free motions");
    const Counts n = counts_of(c);
    complaints.expect(may_lose_all(c) || n.in_use == n.spoilt, "false, though there are usable pairings");
}

bool same(const FreeTwist& a, const FreeTwist& b)
{
    return a.kind == b.kind && a.axis == b.axis && a.through == b.through && a.sigma == b.sigma &&
           a.name == b.name;
}
bool same(const OptimalTF_Result& a, const OptimalTF_Result& b)
{
    return rotation_of(a.optimalPose) == rotation_of(b.optimalPose) &&
           translation_of(a.optimalPose) == translation_of(b.optimalPose) && a.status == b.status &&
           a.rank == b.rank && a.skipped == b.skipped && a.outliers.point2point == b.outliers.point2point &&
           a.outliers.point2line == b.outliers.point2line &&
           a.outliers.point2plane == b.outliers.point2plane && a.outliers.line2line == b.outliers.line2line &&
           a.outliers.plane2plane == b.outliers.plane2plane &&
           std::equal(a.free.begin(), a.free.end(), b.free.begin(), b.free.end(),
                      [](const auto& x, const auto& y) { return same(x, y); });
}

/// What is wrong with the result of a case; nothing, if all is well. `seen`: what the call returned.
std::string complaints_on(const Case& c, OptimalTF_Result* seen = nullptr)
{
    Complaints complaints;
    OptimalTF_Result r = used_before(), again = used_before();
    try
    {
        const bool solved = call(c, r);
        if (solved)
            check_pose(r, complaints);
        else
            check_nothing_done(r, c, complaints);
        const Counts n = counts_of(c);
        complaints.expect(!solved || n.in_use > n.spoilt, "true, though there is no usable pairing");
        complaints.expect(r.skipped == n.spoilt, "skipped is " + std::to_string(r.skipped) + ", but " +
                                                     std::to_string(n.spoilt) + " cannot be used");
        check_outliers(c.pairings, r.outliers, complaints);
        complaints.expect(call(c, again) == solved && same(r, again), "the second call gives other bits");
    }
    catch (const std::exception& e)
    {
        complaints.expect(false, std::string("threw: ") + e.what());
    }
    if (seen) *seen = r;
    return complaints.text();
}
}  // namespace

namespace
{
/// `draw`: a case from its seed.
template <class Draw>
void expect_promises_kept(size_t calls, const Draw& draw)
{
    std::set<int> ranks;
    size_t failures = 0;
    for (uint64_t seed = 1; seed <= calls && failures < 10; seed++)
    {
        const Case c = draw(seed);
        OptimalTF_Result result;
        const std::string complaints = complaints_on(c, &result);
        EXPECT_EQ(complaints, "") << CALL_NAMES[static_cast<size_t>(c.call)] << ", seed " << seed;
        failures += complaints.empty() ? 0 : 1;
        ranks.insert(result.rank);
    }
    // The draws reach everything from nothing to all six degrees of freedom.
    for (const int rank : {0, 3, 5, 6}) EXPECT_TRUE(failures > 0 || ranks.count(rank) == 1) << rank;
}
}  // namespace

TEST(RandomCalls, WithPairingsOfAllKindsKeepThePromisesOfTheirResults)
{
    // Far fewer than of points: where these leave motions free, a call searches for milliseconds.
    expect_promises_kept(repetitions(500, 100000), [](uint64_t seed) { return random_case(seed); });
}

TEST(RandomCalls, WithPointsAloneKeepThePromisesOfTheirResults)
{
    expect_promises_kept(repetitions(5000, 1000000),
                         [](uint64_t seed)
                         {
                             Case c = random_case(seed);
                             Pairings points;
                             points.paired_pt2pt = c.pairings.paired_pt2pt;
                             points.point_weights = c.pairings.point_weights;
                             c.pairings = points;
                             return c;
                         });
}
