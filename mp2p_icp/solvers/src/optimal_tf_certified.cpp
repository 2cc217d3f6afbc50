#include <mp2p_icp/optimal_tf_certified.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "certified_pairings.h"
#include "closed_form.h"
#include "observability_analysis.h"
#include "rotation_certificate.h"
#include "rotation_search.h"
#include "rotation_vector.h"
#include "weighted_closed_form.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;
using mrpt::poses::CPose3D;
using Starts = std::vector<Matrix3d>;

void check(const CertifiedParameters& p)
{
    if (p.guess && !is_finite(*p.guess))
        throw std::invalid_argument("optimal_tf_certified: the guess must be finite");
    if (!(p.tolerance > 0 && p.tolerance < 1))
        throw std::invalid_argument("optimal_tf_certified: the tolerance must be positive and less than 1");
}

/// Minima, the lowest first, and the proof for that one.
struct Search
{
    const RotationQuadratic& f;
    const double tolerance;
    std::vector<RotationMinimum> minima;
    RotationCertificate proof;
    double margin = 0;

    void descend_from(const Starts& starts) { add_minima(f, starts, minima); }
    void prove(const CertificateOptions& options)
    {
        proof = certify_rotation(f.matrix(), minima.front().R, options);
        proof.gap += f.rounding() + f.unresolved();
        proof.holds = proof.holds && proof.gap <= tolerance * proof.scale;
        margin = proof.margin();
    }
    /// When another minimum comes first.
    void prove_again()
    {
        CertificateOptions options;
        options.tolerance = tolerance;
        prove(options);
    }
    /// How many cost no more than the lowest, as far as the tolerance tells.
    size_t equal() const
    {
        const double limit = minima.front().cost + tolerance * proof.scale;
        return static_cast<size_t>(
            std::count_if(minima.begin(), minima.end(), [limit](const auto& m) { return m.cost <= limit; }));
    }
    /// By its margin, all rotations at a distance of 1 rad cost more than the tolerance.
    bool unique() const { return proof.holds && margin > 10 * tolerance; }
};

/** From few starts, and from more if these do not settle it: whether the lowest minimum is the lowest of all,
 * and whether it is the only one.
 */
void search(const CertifiedParameters& p, Search& s)
{
    constexpr size_t FEW = 4;
    CertificateOptions quick, full, only;
    quick.tolerance = full.tolerance = only.tolerance = p.tolerance;
    quick.wanted_margin = only.wanted_margin = 20 * p.tolerance;
    quick.search = false;
    if (!p.all_minima)
    {
        const Starts few = lowest_spread_rotations(s.f, FEW);
        s.descend_from({p.guess ? rotation_of(*p.guess) : few.front()});
        if (s.prove(quick), s.unique()) return;
        s.descend_from(few);
        s.prove(full);
        if (s.unique() || (s.proof.holds && s.equal() > 1)) return;
        if (s.proof.holds)
            if (s.prove(only), s.unique()) return;
        if (s.proof.better_start) s.descend_from({*s.proof.better_start});
    }
    else if (p.guess)
        s.descend_from({rotation_of(*p.guess)});
    s.descend_from(spread_rotations());
    s.prove(only);
}

/// Is it the same minimum? Where the cost rises with the fourth power, descents end around it.
bool same_minimum(const Search& s, const Matrix3d& A, const Matrix3d& B)
{
    if (same_rotation(A, B)) return true;
    const Vector3d turn = rotation_between(A, B);
    return turn.norm() < 0.1 &&
           s.f.cost(rotation_by(0.5 * turn) * A) <= s.minima.front().cost + s.tolerance * s.proof.scale;
}

/// Of points in one valley, the one that is nearest to the guess.
void collapse_valleys(const Matrix3d& guess, Search& s)
{
    const size_t equal = s.equal();
    if (s.unique())  // the others are where descents stopped on its floor
    {
        s.minima.erase(s.minima.begin() + 1, s.minima.begin() + static_cast<std::ptrdiff_t>(equal));
        return;
    }
    std::vector<RotationMinimum> out;
    for (size_t i = 0; i < equal; i++)
    {
        const auto at = nearest_in_valley(s.f, s.minima[i], guess);
        const bool known =
            std::any_of(out.begin(), out.end(), [&](const auto& o) { return same_minimum(s, o.R, at.R); });
        if (!known) out.push_back(at);
    }
    out.insert(out.end(), s.minima.begin() + static_cast<std::ptrdiff_t>(equal), s.minima.end());
    const bool moved = out.front().R != s.minima.front().R;
    s.minima = out;
    if (moved) s.prove_again();
}

/// What is solved, and the pairings behind it where they are known.
struct Problem
{
    PoseQuadratic pairings, all;  ///< without and with the prior
    const PreparedPairings* in = nullptr;
    OriginPose guess;  ///< relative to `all`

    /// What the guess costs along translations that the sums do not resolve.
    double cost_of_guess(const Matrix3d& R) const
    {
        const Vector3d least = all.best_translation(R, Vector3d::Zero()),
                       c = all.best_translation(R, guess.c);
        const double rounding = 1e-15 * all.K.bottomRightCorner<3, 3>().trace() * (c - least).squaredNorm();
        return std::max(0.0, all.cost(OriginPose{R, c}) - all.cost(OriginPose{R, least})) + rounding;
    }
    CPose3D pose_at(const Matrix3d& R) const { return all.absolute({R, all.best_translation(R, guess.c)}); }
};

/// How many of the lowest minima cost the same, but for the rounding of sums.
size_t count_lowest(const Search& s)
{
    const double limit = s.minima.front().cost + 2 * s.f.rounding();
    const auto end =
        std::find_if(s.minima.begin(), s.minima.end(), [limit](const auto& m) { return m.cost > limit; });
    return static_cast<size_t>(end - s.minima.begin());
}

/// Of several, the one that residuals prefer comes first; else the one nearest to the guess.
void put_best_first(const Problem& problem, Search& s)
{
    const size_t count = count_lowest(s);
    if (count < 2) return;
    const auto begin = s.minima.begin(), end = begin + static_cast<std::ptrdiff_t>(count);
    const Matrix3d guess = problem.guess.R;
    auto best = std::min_element(
        begin, end,
        [&](const auto& a, const auto& b)
        { return rotation_between(a.R, guess).norm() < rotation_between(b.R, guess).norm(); });
    if (problem.in)
    {
        std::vector<CPose3D> poses;
        for (auto m = begin; m != end; ++m) poses.push_back(problem.pose_at(m->R));
        best =
            begin + static_cast<std::ptrdiff_t>(lowest_by_residuals(*problem.in, problem.all, poses, guess));
    }
    if (best == begin) return;
    std::rotate(begin, best, best + 1);
    s.prove_again();  // it costs the same, and has a proof of its own
}

/// Rank and free motions of the pairings at the result's pose.
void describe(const Problem& problem, const std::optional<double>& sigma, OptimalTF_Result& result)
{
    const PoseQuadratic& q = problem.pairings;
    if (clearly_determined(q, q.relative(result.optimalPose))) return set_determined(result);
    if (problem.in) return describe_pose(*problem.in, sigma, result);
    AnalysisOptions options;
    options.sigma = sigma, options.epsilon = std::numeric_limits<double>::epsilon();
    set_rank(analyse(q, result.optimalPose, options), result);
}

/** Does the cost rise in all directions, to second order? (The information does not tell: at a minimum of as
 * many rows as unknowns that leaves residuals it is singular, and the minimum may be strict all the same.)
 */
bool rises_everywhere(const PoseQuadratic& q, const Search& s)
{
    const auto eigenvalues = [](const Matrix3d& M)
    { return Eigen::SelfAdjointEigenSolver<Matrix3d>(M, Eigen::EigenvaluesOnly).eigenvalues(); };
    const auto translation = eigenvalues(q.K.bottomRightCorner<3, 3>());
    if (!(translation(0) > RESOLVED_INFORMATION * translation(2))) return false;
    if (s.unique()) return true;
    const auto d = s.f.derivatives(s.minima.front().R);
    return eigenvalues(d.hessian)(0) > 1e-9 * s.f.scale(d.cost);
}

GlobalVerdict verdict_of(const Search& s, bool rises)
{
    if (!s.proof.holds) return GlobalVerdict::Gap;
    if (!rises) return GlobalVerdict::Unobservable;
    return s.equal() > 1 && !s.unique() ? GlobalVerdict::GlobalAmbiguous : GlobalVerdict::Global;
}
}  // namespace

std::string to_string(GlobalVerdict verdict)
{
    switch (verdict)
    {
        case GlobalVerdict::Global:
            return "global";
        case GlobalVerdict::GlobalAmbiguous:
            return "global_ambiguous";
        case GlobalVerdict::Gap:
            return "gap";
        default:
            return "unobservable";
    }
}

namespace
{
/// Everything but outliers and skipped pairings.
void solve(const Problem& problem, const CertifiedParameters& p, CertifiedResult& result)
{
    const RotationQuadratic f(problem.all);
    Search s{f, p.tolerance, {}, {}};
    search(p, s);
    const bool depends = f.depends_on_rotation(s.minima.front().cost);
    const Matrix3d guess = problem.guess.R;
    if (depends)
        collapse_valleys(guess, s), put_best_first(problem, s);
    else
    {
        s.proof.gap += f.cost(guess) - s.minima.front().cost;
        s.minima = {{guess, f.cost(guess)}};
    }

    for (const auto& m : s.minima) result.minima.push_back({problem.pose_at(m.R), m.cost});
    result.optimalPose = result.minima.front().pose, result.cost = std::max(0.0, s.minima.front().cost);
    // Pairings and prior are sums of squares: nothing costs less than 0.
    result.gap =
        std::min(s.proof.gap, result.cost + f.rounding()) + problem.cost_of_guess(s.minima.front().R);
    result.scale = s.proof.scale, result.margin = s.margin, result.G = s.proof.G;
    result.verdict = depends ? verdict_of(s, rises_everywhere(problem.all, s)) : GlobalVerdict::Unobservable;
    describe(problem, p.weights.sigma, result);
}

bool solve(const PoseQuadratic& sums, const PreparedPairings* in, const CertifiedParameters& p,
           CertifiedResult& result)
{
    check(p);
    if (!sums.is_finite()) throw std::invalid_argument("optimal_tf_certified: the sums must be finite");
    CertifiedResult fresh;
    fresh.optimalPose = result.optimalPose, fresh.outliers = result.outliers, fresh.skipped = sums.skipped;
    result = fresh;
    Problem problem{sums, sums, in, {}};
    if (p.prior) problem.all += pose_quadratic(*p.prior), problem.in = nullptr;
    if (problem.all.empty()) return false;
    problem.guess = problem.all.relative(p.guess.value_or(CPose3D()));
    solve(problem, p, result);
    return true;
}
}  // namespace

bool optimal_tf_certified(const PoseQuadratic& sums, CertifiedResult& result, const CertifiedParameters& p)
{
    return solve(sums, nullptr, p, result);
}

bool solve_certified(const Pairings& pairings, CertifiedResult& result, const CertifiedParameters& p,
                     std::optional<PreparedPairings>& certified)
{
    check(p);
    const auto solve = [&](PreparedPairings& in, OptimalTF_Result& out)
    {
        const PairingSums sums = pairing_sums(in);
        certified = in;
        result.optimalPose = out.optimalPose, result.outliers = out.outliers;
        const PoseQuadratic q = pose_quadratic(sums, in);
        const bool solved = mp2p_icp::solve(q, &in, p, result);
        result.skipped = in.skipped();
        out = result;
        return solved;
    };
    OptimalTF_Result last = result;
    const bool solved = solve_weighted(pairings, p.weights, p.guess, solve, last);
    result.outliers = last.outliers;
    return solved;
}

bool optimal_tf_certified(const Pairings& in, CertifiedResult& result, const CertifiedParameters& parameters)
{
    std::optional<PreparedPairings> certified;
    return solve_certified(in, result, parameters, certified);
}

}  // namespace mp2p_icp
