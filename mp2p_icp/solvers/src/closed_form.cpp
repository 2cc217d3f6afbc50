#include "closed_form.h"

#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gauss_newton_problem.h"
#include "nearest_to_guess.h"
#include "observability_analysis.h"
#include "rotation_search.h"
#include "rotation_vector.h"
#include "vector_set.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;
using mrpt::poses::CPose3D;

struct Vector3Sum
{
    Vector3d v = Vector3d::Zero();
    Vector3Sum& operator+=(const Vector3Sum& o)
    {
        v += o.v;
        return *this;
    }
};

template <class Term>
Vector3d sum_over(size_t count, const Term& term)
{
    return block_sum<Vector3Sum>(count,
                                 [&](size_t from, size_t to)
                                 {
                                     Vector3Sum s;
                                     for (size_t i = from; i < to; i++) s.v += term(i);
                                     return s;
                                 })
        .v;
}

// ---- The rotation, where the sums alone would not be exact enough: Squares of small spreads drown in the
// rounding of the squares of large ones, residuals do not. One pass over the pairings per step.

/// Horn's cost, from residuals: Newton steps with the Hessian of the sums.
Matrix3d refined_by_residuals(const VectorSet& vectors, size_t count, Matrix3d R)
{
    for (int k = 0; k < 3; k++)
    {
        const Vector3d slope = sum_over(count,
                                        [&](size_t i) -> Vector3d
                                        {
                                            const auto p = vectors.pair(i);
                                            if (!(p.w > 0)) return Vector3d::Zero();
                                            const Vector3d b = R * p.b;
                                            return p.w * b.cross(p.a - b);
                                        });
        const Matrix3d M = vectors.profile().B * R.transpose(),
                       H = M.trace() * Matrix3d::Identity() - 0.5 * (M + M.transpose());
        const Vector3d step = H.ldlt().solve(slope);
        if (!(step.norm() < 0.1)) break;
        R = Eigen::Quaterniond(Matrix3d(rotation_by(step) * R)).normalized().toRotationMatrix();
    }
    return R;
}

/// OLAE's systems, by iterative refinement: with s = a + b and e = (a - b) - g x s, the residual of the least
/// squares system is sum w s x e, that of the report's half of sum w (s x e - d (d.g)).
Matrix3d refined_olae(const VectorSet& vectors, size_t count, OlaeSystem system, const Matrix3d& start)
{
    const OlaeFrame frame(vectors.profile(), Eigen::Quaterniond(start));
    Vector3d g = frame.solve(system);
    if (!g.allFinite()) return start;
    for (int k = 0; k < 3; k++)
    {
        const Vector3d residual = sum_over(count,
                                           [&](size_t i) -> Vector3d
                                           {
                                               const auto p = vectors.pair(i);
                                               if (!(p.w > 0)) return Vector3d::Zero();
                                               const Vector3d b = frame.turned(p.b), s = p.a + b, d = p.a - b;
                                               const Vector3d r = p.w * s.cross(d - g.cross(s));
                                               if (system == OlaeSystem::LeastSquares) return r;
                                               return 0.5 * (r - p.w * d * d.dot(g));
                                           });
        const Vector3d step = frame.correction(system, residual);
        if (!(step.norm() < 0.1 * (1 + g.squaredNorm()))) break;
        g += step;
    }
    return frame.rotation(g).toRotationMatrix();
}

struct RotationFound
{
    Matrix3d R = Matrix3d::Identity();
    bool determined = false;  ///< by the vectors alone
    bool sure = false;        ///< with no need to look closer
    bool badly = false;       ///< determined, but by vectors with a spread below 3 %
};

CPose3D guess_of(const ClosedForm& how)
{
    return how.guess.value_or(CPose3D());
}

RotationFound find_rotation(const VectorSet& vectors, const PreparedPairings& in, const ClosedForm& how)
{
    const AttitudeMethod method = how.method;
    const Attitude fast = fast_attitude(vectors.profile(), method);
    if (fast.sure) return {fast.q.toRotationMatrix(), true, true, false};
    const double scale = attitude_scale(vectors.profile());
    const Matrix3d guess = rotation_of(guess_of(how));
    if (!(scale > 0)) return {guess, false, false, false};
    const auto eigen = eigen_attitude(vectors.profile().B, scale, guess);
    if (!eigen.determined) return {eigen.R, false, false, false};
    const bool badly = eigen.distance < 1e-3;
    if (method == AttitudeMethod::OlaeReport || method == AttitudeMethod::OlaeLeastSquares)
        return {
            refined_olae(vectors, in.size(),
                         method == AttitudeMethod::OlaeReport ? OlaeSystem::Report : OlaeSystem::LeastSquares,
                         eigen.R),
            true, false, badly};
    return {refined_by_residuals(vectors, in.size(), eigen.R), true, false, badly};
}

// ---- The translation
// ------------------------------------------------------------------------------------------

/// One more step on residuals: sums of products are less exact than they.
Vector3d refined_translation(const PreparedPairings& in, const PoseQuadratic& q, const OriginPose& at)
{
    const Vector3d slope =
        sum_over(in.size(),
                 [&](size_t i) -> Vector3d
                 {
                     const PairingId id = pairing_id(in.pairings(), i);
                     const double w = in.weight(id);
                     if (!(w > 0)) return Vector3d::Zero();
                     const ResidualTerm t = in.terms(id).position;
                     return w * (t.C * ((t.q - q.a_centre) - at.R * (t.b - q.b_centre) - at.c));
                 });
    PoseQuadratic rest = q;
    rest.k.setZero(), rest.k.tail<3>() = slope;
    rest.K.bottomLeftCorner<3, 9>().setZero();
    return at.c + rest.best_translation(at.R, Vector3d::Zero());
}

/// Do the points coincide, but for the rounding of their coordinates? Then their directions mean nothing.
bool coincide(const PointSums& centred, const PairingSums& sums)
{
    const auto is_point = [&](const Matrix3d& squares, const Vector3d& origin)
    { return squares.trace() <= 1e-24 * centred.w * origin.squaredNorm(); };
    return is_point(centred.aa, sums.a_origin) || is_point(centred.bb, sums.b_origin);
}

void analyse_pose(const PreparedPairings& in, const std::optional<double>& sigma, OptimalTF_Result& result)
{
    AnalysisOptions options;
    options.sigma = sigma, options.epsilon = std::numeric_limits<double>::epsilon();
    set_rank(analyse(in, result.optimalPose, options), result);
}

bool solve_points(const PreparedPairings& in, const PairingSums& sums, const ClosedForm& how,
                  OptimalTF_Result& result)
{
    const VectorSet vectors(in, sums, how.points, Matrix3d::Identity(), {});
    RotationFound found;
    if (coincide(sums.points, sums))
        found.R = rotation_of(guess_of(how));
    else
        found = find_rotation(vectors, in, how);
    const OriginPose pose{found.R, vectors.a_mean() - found.R * vectors.b_mean()};
    result.optimalPose = absolute(sums.a_origin, sums.b_origin, pose);
    if (found.sure)
        set_determined(result);
    else
        analyse_pose(in, how.sigma, result);
    return true;
}

/// By how much the rounding of coordinates (some 1e-15 of the size of the scene) changes a sum of squares.
double cost_rounding(const PoseQuadratic& q, double cost)
{
    const double weight = q.K.trace() / 3, residual = 1e-14 * (q.L() + q.b_centre.norm() + q.a_centre.norm());
    return weight * residual * residual + 2 * std::sqrt(weight * cost) * residual;
}

/// A pose and its cost, from residuals.
struct Candidate
{
    CPose3D pose;
    double cost = 0;
};

/// All rows of all kinds, to the last digit, from a pose that fits them already.
Candidate settled(const PreparedPairings& in, const CPose3D& start)
{
    OptimalTF_GN_Parameters p;
    p.minDelta = 1e-14, p.maxInnerLoopIterations = 20;
    GaussNewtonReport report;
    const CPose3D pose = descend(in, p, start, report);
    return {pose, report.cost};
}

/// So many near-equal minima are points of a valley, of which a few are enough.
constexpr size_t VALLEY = 12, VALLEY_CANDIDATES = 4;

double turn_from(const Candidate& c, const Matrix3d& R)
{
    return rotation_angle(rotation_of(c.pose).transpose() * R);
}

/// The minima that may be the lowest, settled by residuals; of those in a valley, some of the nearest to the
/// guess.
std::vector<Candidate> candidates_at(const PreparedPairings& in, const PoseQuadratic& q,
                                     const OriginPose& guess)
{
    auto minima = lowest_minima(RotationQuadratic(q), guess.R);
    std::stable_sort(
        minima.begin(), minima.end(),
        [&](const auto& a, const auto& b)
        { return rotation_angle(a.R.transpose() * guess.R) < rotation_angle(b.R.transpose() * guess.R); });
    if (minima.size() > VALLEY) minima.resize(VALLEY_CANDIDATES);
    std::vector<Candidate> out;
    for (const auto& minimum : minima)
    {
        const OriginPose at{minimum.R, q.best_translation(minimum.R, guess.c)};
        out.push_back(settled(in, absolute(q.a_centre, q.b_centre, at)));
    }
    return out;
}

/// Those that are lowest, for all that residuals can tell.
void keep_lowest(const PoseQuadratic& q, std::vector<Candidate>& candidates)
{
    const auto lower = [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; };
    const double least = std::min_element(candidates.begin(), candidates.end(), lower)->cost,
                 equal = least * (1 + 1e-9) + cost_rounding(q, least);
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                    [&](const Candidate& c) { return !(c.cost <= equal); }),
                     candidates.end());
}

const Candidate& nearest(const std::vector<Candidate>& candidates, const Matrix3d& guess)
{
    return *std::min_element(candidates.begin(), candidates.end(),
                             [&](const auto& a, const auto& b)
                             { return turn_from(a, guess) < turn_from(b, guess); });
}

/** The pose of least squares over all rotations. Sums cannot tell minima apart whose costs differ by less
 * than 1e-9 of what is typical: residuals can. Of those that are equal even then, the one nearest to the
 * guess.
 */
CPose3D search_globally(const PreparedPairings& in, const PoseQuadratic& q, const CPose3D& guess)
{
    const OriginPose at_guess = q.relative(guess);
    std::vector<Candidate> candidates = candidates_at(in, q, at_guess);
    keep_lowest(q, candidates);
    for (auto& c : candidates) c.pose = nearest_to_guess(in, c.pose, guess);
    return nearest(candidates, at_guess.R).pose;
}

/// The rotation at which free directions get their signs.
Matrix3d sign_reference(const PreparedPairings& in, const PoseQuadratic& q, const ClosedForm& how)
{
    if (how.guess) return rotation_of(*how.guess);
    const bool free = (!in.pairings().paired_ln2ln.empty() && in.kinds().ln2ln_sign == DirectionSign::Free) ||
                      (!in.pairings().paired_pl2pl.empty() && in.kinds().pl2pl_sign == DirectionSign::Free);
    return free ? rotation_of(search_globally(in, q, CPose3D())) : Matrix3d::Identity();
}

bool solve_mixed(const PreparedPairings& in, const PairingSums& sums, const ClosedForm& how,
                 OptimalTF_Result& result)
{
    const CPose3D guess = guess_of(how);
    const PoseQuadratic q = pose_quadratic(sums, in);
    std::optional<OriginPose> projection_guess;
    if (how.guess) projection_guess = relative_to(sums.a_origin, sums.b_origin, *how.guess);
    const VectorSet vectors(in, sums, how.points, sign_reference(in, q, how), projection_guess);
    const RotationFound found = find_rotation(vectors, in, how);
    OriginPose pose{found.R, {}};
    pose.c = q.best_translation(found.R, relative_to(q.a_centre, q.b_centre, guess).c);
    // Where vectors say little of the rotation, or nothing, all rows together may say more.
    if (!found.determined || (found.badly && clearly_determined(q, pose)))
    {
        result.optimalPose = search_globally(in, q, guess);
        analyse_pose(in, how.sigma, result);
        return true;
    }
    pose.c = refined_translation(in, q, pose);
    result.optimalPose = absolute(q.a_centre, q.b_centre, pose);
    if (clearly_determined(q, pose))
        set_determined(result);
    else
        analyse_pose(in, how.sigma, result);
    return true;
}
}  // namespace

bool clearly_determined(const PoseQuadratic& q, const OriginPose& pose)
{
    Matrix6 H = q.information(pose.R);
    H.diagonal().array() -= 1e-4 * H.trace();
    H.diagonal().tail<3>().array() -= 4 * q.cost(pose) / (q.L() * q.L());
    return H.llt().info() == Eigen::Success;
}

void set_determined(OptimalTF_Result& result)
{
    result.status = SolveStatus::Determined, result.rank = 6, result.free.clear();
}

void set_rank(const Observability& seen, OptimalTF_Result& result)
{
    result.rank = seen.rank, result.free = seen.free;
    result.status = seen.rank == 6 ? SolveStatus::Determined : SolveStatus::UnderConstrained;
}

bool solve_closed_form(PreparedPairings& in, const ClosedForm& how, OptimalTF_Result& result)
{
    const PairingSums sums = pairing_sums(in);
    result.optimalScale = 1, result.skipped = in.skipped();
    result.status = SolveStatus::NoPairings, result.rank = 0, result.free.clear();
    if (!(sums.weight(in) > 0)) return false;
    return !sums.others ? solve_points(in, sums, how, result) : solve_mixed(in, sums, how, result);
}

size_t lowest_by_residuals(const PreparedPairings& in, const PoseQuadratic& q,
                           const std::vector<CPose3D>& poses, const Matrix3d& guess)
{
    std::vector<Candidate> candidates;
    for (const auto& pose : poses) candidates.push_back(settled(in, pose));
    keep_lowest(q, candidates);
    const Matrix3d chosen = rotation_of(nearest(candidates, guess).pose);
    const auto nearer = [&](const CPose3D& a, const CPose3D& b) {
        return turn_from({a, 0}, chosen) < turn_from({b, 0}, chosen);
    };
    return static_cast<size_t>(std::min_element(poses.begin(), poses.end(), nearer) - poses.begin());
}

void describe_pose(const PreparedPairings& in, const std::optional<double>& sigma, OptimalTF_Result& result)
{
    PreparedPairings summed = in;
    const PoseQuadratic q = pose_quadratic(pairing_sums(summed), in);
    if (clearly_determined(q, relative_to(q.a_centre, q.b_centre, result.optimalPose)))
        set_determined(result);
    else
        analyse_pose(in, sigma, result);
}

bool solve_globally(PreparedPairings& in, const CPose3D& guess, CPose3D& pose)
{
    OptimalTF_Result result;
    const PairingSums sums = pairing_sums(in);
    if (!(sums.weight(in) > 0)) return false;
    if (!sums.others)
    {
        ClosedForm horn;
        horn.guess = guess;
        solve_points(in, sums, horn, result);
        pose = result.optimalPose;
    }
    else
        pose = search_globally(in, pose_quadratic(sums, in), guess);
    return true;
}

}  // namespace mp2p_icp
