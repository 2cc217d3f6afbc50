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

/// Of points in one valley, the one that is nearest to the guess.
void collapse_valleys(const RotationQuadratic& f, const Matrix3d& guess, Search& s)
{
    if (s.unique()) return;
    std::vector<RotationMinimum> out;
    const size_t equal = s.equal();
    for (size_t i = 0; i < s.minima.size(); i++)
    {
        const auto at = i < equal ? nearest_in_valley(f, s.minima[i], guess) : s.minima[i];
        const bool known =
            std::any_of(out.begin(), out.end(), [&](const auto& o) { return same_rotation(o.R, at.R); });
        if (!known) out.push_back(at);
    }
    const bool moved = out.front().R != s.minima.front().R;
    s.minima = out;
    if (moved) s.prove_again();
}

/// Of those that cost the same but for rounding, the one nearest to the guess comes first.
void put_nearest_first(const RotationQuadratic& f, const Matrix3d& guess, Search& s)
{
    const double limit = s.minima.front().cost + 4e-15 * f.matrix().norm();
    const auto end =
        std::find_if(s.minima.begin(), s.minima.end(), [limit](const auto& m) { return m.cost > limit; });
    const auto nearest = std::min_element(
        s.minima.begin(), end,
        [&](const auto& a, const auto& b)
        { return rotation_between(a.R, guess).norm() < rotation_between(b.R, guess).norm(); });
    if (nearest == s.minima.begin()) return;
    std::rotate(s.minima.begin(), nearest, nearest + 1);
    s.prove_again();  // it costs the same, and has a proof of its own
}

/// Rank and free motions of the pairings at the result's pose.
void describe(const PoseQuadratic& q, const std::optional<double>& sigma, OptimalTF_Result& result)
{
    if (clearly_determined(q, q.relative(result.optimalPose))) return set_determined(result);
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
    if (!(translation(0) > 1e-10 * translation(2))) return false;
    if (s.unique()) return true;
    const auto d = s.f.derivatives(s.minima.front().R);
    return eigenvalues(d.hessian)(0) > 1e-9 * s.f.scale(d.cost);
}

GlobalVerdict verdict_of(const Search& s, bool rises)
{
    if (!s.proof.holds) return GlobalVerdict::Gap;
    if (!rises) return GlobalVerdict::Unobservable;
    return s.equal() > 1 ? GlobalVerdict::GlobalAmbiguous : GlobalVerdict::Global;
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

bool optimal_tf_certified(const PoseQuadratic& sums, CertifiedResult& result, const CertifiedParameters& p)
{
    check(p);
    const CPose3D unchanged = result.optimalPose;
    const OutlierIndices outliers = result.outliers;
    result = {}, result.optimalPose = unchanged, result.outliers = outliers, result.skipped = sums.skipped;
    PoseQuadratic all = sums;
    if (p.prior) all += pose_quadratic(*p.prior);
    if (all.empty()) return false;

    const RotationQuadratic f(all);
    const OriginPose guess = all.relative(p.guess.value_or(CPose3D()));
    Search s{f, p.tolerance, {}, {}};
    search(p, s);
    const bool depends = f.depends_on_rotation(s.minima.front().cost);
    if (depends)
        collapse_valleys(f, guess.R, s), put_nearest_first(f, guess.R, s);
    else
        s.minima = {{guess.R, f.cost(guess.R)}};

    for (const auto& m : s.minima)
        result.minima.push_back({all.absolute({m.R, all.best_translation(m.R, guess.c)}), m.cost});
    result.optimalPose = result.minima.front().pose, result.cost = std::max(0.0, s.minima.front().cost);
    // Pairings and prior are sums of squares: nothing costs less than 0.
    result.gap = std::min(s.proof.gap, result.cost + 4e-15 * f.matrix().norm());
    result.scale = s.proof.scale, result.margin = s.margin, result.G = s.proof.G;
    result.verdict = depends ? verdict_of(s, rises_everywhere(all, s)) : GlobalVerdict::Unobservable;
    describe(sums, p.weights.sigma, result);
    return true;
}

bool solve_certified(const Pairings& pairings, CertifiedResult& result, const CertifiedParameters& p,
                     std::optional<PreparedPairings>& certified)
{
    check(p);
    CertifiedParameters now = p;
    const auto solve = [&](PreparedPairings& in, OptimalTF_Result& out)
    {
        const PairingSums sums = pairing_sums(in);
        certified = in;
        result.optimalPose = out.optimalPose, result.outliers = out.outliers;
        const PoseQuadratic q = sums.usable() ? pose_quadratic(sums, in) : PoseQuadratic();
        const bool solved = optimal_tf_certified(q, result, now);
        result.skipped = in.skipped();
        if (solved) now.guess = result.optimalPose;
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
