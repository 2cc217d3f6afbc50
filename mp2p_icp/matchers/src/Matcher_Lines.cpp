#include <mp2p_icp/Matcher_Lines.h>
#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "equivalent_points.h"
#include "one_to_one.h"

IMPLEMENTS_MRPT_OBJECT(Matcher_Lines, mp2p_icp::Matcher, mp2p_icp)

namespace mp2p_icp
{
using Eigen::Vector3d;

namespace
{
const Range ANGLES = Range::open(0, 90);
}

void Matcher_Lines::declare_parameters(ParameterDeclaration& declare)
{
    Matcher::declare_parameters(declare);
    declare.formula("distanceThreshold", distanceThreshold, "m", Range::positive(),
                    "largest distance between paired lines, across them", Need::Required);
    declare.formula("angleThresholdDeg", angleThresholdDeg, "deg", ANGLES,
                    "largest angle between paired lines");
    declare.formula(
        "maxAlongDistance", maxAlongDistance, "m", Range::not_negative(),
        "largest distance between base points along the lines, where extents are unknown; 0: no limit");
    declare.number("minimumOverlap", minimumOverlap, "", Range::between(0, 1),
                   "shared part of the shorter line, where extents are known; 0: not checked");
    declare.flag("weightByFit", weightByFit,
                 "weigh pairings by how well the lines' places are known, if they tell?");
    declare.flag("pairAsPoints", pairAsPoints,
                 "four weighted point-plane pairings in place of each line-line one, where fits are known?");
    declare.number("unitWeightSigma", unitWeightSigma, "m", Range::positive(),
                   "a distance with this standard deviation weighs 1");
}

std::optional<double> Matcher_Lines::gate(const MatchContext& context) const
{
    return checked_value(distanceThreshold, variables(context.variables), "distanceThreshold",
                         Range::positive());
}

namespace
{
/// A line as the matcher looks at it: in the global frame, its director of unit length.
struct Candidate
{
    size_t index;  // in its map
    fitted_line_t line;
    Vector3d base, direction;
};

std::vector<Candidate> candidates(const std::vector<fitted_line_t>& lines, const mrpt::poses::CPose3D& pose)
{
    std::vector<Candidate> out;
    for (size_t i = 0; i < lines.size(); i++)
    {
        fitted_line_t line = compose(pose, lines[i]);
        const Vector3d director = to_eigen(line.director), base = to_eigen(line.pBase);
        const double length = director.norm();
        if (!(length > 0) || !std::isfinite(length) || !base.allFinite()) continue;
        line.director = to_mrpt(director / length);
        if (line.fit && !line.fit->is_sound()) line.fit.reset();
        out.push_back({i, line, base, director / length});
    }
    return out;
}

struct Limits
{
    double distance, cosine, along, overlap;
};

constexpr double NEVER = std::numeric_limits<double>::infinity();

/// An interval along the mean direction of two lines.
struct Interval
{
    double lo, hi;
};

/** Of two lines at a small angle: coordinates along their mean direction, from the base point of the first.
 */
class PairGeometry
{
 public:
    PairGeometry(const Candidate& a, const Candidate& b)
        : a_(a),
          b_(b),
          mean_((a.direction + (a.direction.dot(b.direction) < 0 ? -1.0 : 1.0) * b.direction).normalized())
    {
    }
    double along(const Vector3d& p) const { return mean_.dot(p - a_.base); }

    Interval seen(const Candidate& c) const
    {
        const double begin = along(c.base + c.line.fit->begin * c.direction),
                     end = along(c.base + c.line.fit->end * c.direction);
        return {std::min(begin, end), std::max(begin, end)};
    }
    double distance_sq_at(double s) const { return (at(a_, s) - at(b_, s)).squaredNorm(); }

 private:
    Vector3d at(const Candidate& c, double s) const
    {
        return c.base + c.direction * ((s - along(c.base)) / mean_.dot(c.direction));
    }
    const Candidate &a_, &b_;
    Vector3d mean_;
};

/// Infinite if they may not be paired whatever it is.
double distance_sq(const Candidate& a, const Candidate& b, const Limits& limits)
{
    if (!(std::abs(a.direction.dot(b.direction)) >= limits.cosine)) return NEVER;
    const PairGeometry pair(a, b);
    if (!a.line.fit || !b.line.fit)
    {
        const double along = pair.along(b.base);
        if (limits.along > 0 && !(std::abs(along) <= limits.along)) return NEVER;
        return pair.distance_sq_at(along / 2);
    }
    const Interval of_a = pair.seen(a), of_b = pair.seen(b);
    const Interval shared = {std::max(of_a.lo, of_b.lo), std::min(of_a.hi, of_b.hi)};
    const double shorter = std::min(of_a.hi - of_a.lo, of_b.hi - of_b.lo);
    if (limits.overlap > 0 && !(shared.hi - shared.lo >= limits.overlap * shorter)) return NEVER;
    return pair.distance_sq_at((shared.lo + shared.hi) / 2);
}

Limits limits_of(const Matcher_Lines& m, const RunVariables& vars)
{
    const double angle = checked_value(m.angleThresholdDeg, vars, "angleThresholdDeg", ANGLES);
    return {checked_value(m.distanceThreshold, vars, "distanceThreshold", Range::positive()),
            std::cos(mrpt::DEG2RAD(angle)),
            checked_value(m.maxAlongDistance, vars, "maxAlongDistance", Range::not_negative()),
            m.minimumOverlap};
}

/// Positions in the lists of both, with their squared distance.
std::vector<RatedPair> pairs_among(const std::vector<Candidate>& global, const std::vector<Candidate>& local,
                                   const Limits& limits)
{
    std::vector<RatedPair> nearest;
    for (size_t l = 0; l < local.size(); l++)
    {
        RatedPair best{global.size(), l, limits.distance * limits.distance};
        for (size_t g = 0; g < global.size(); g++)
            if (const double d = distance_sq(global[g], local[l], limits); d < best.cost) best = {g, l, d};
        if (best.global < global.size()) nearest.push_back(best);
    }
    return best_per_global(nearest);
}

/// Variance of a line's place `s` from its base point, along one direction across it: the mean over
/// directions.
double variance_at(const line_fit_t& fit, double s)
{
    const auto& c = fit.covariance;
    return (c(0, 0) + c(1, 1) + 2 * s * (c(0, 2) + c(1, 3)) + s * s * (c(2, 2) + c(3, 3))) / 2;
}

double weight_of(const Candidate& global, const Candidate& local, double unit_variance)
{
    const double s = global.direction.dot(local.base - global.base);
    return unit_variance /
           (variance_at(*global.line.fit, s) + variance_at(*local.line.fit, 0) + ROUNDING_VARIANCE);
}
}  // namespace

void Matcher_Lines::impl_match(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                               const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                               MatchState&, Pairings& out) const
{
    const Limits limits = limits_of(*this, variables(context.variables));
    const auto global = candidates(pcGlobal.lines, {}), local = candidates(pcLocal.lines, localPose);
    for (const Candidate& l : local) out.potential_pairings += pairAsPoints && l.line.fit ? 4 : 1;
    const double unit_variance = unitWeightSigma * unitWeightSigma;
    for (const RatedPair& pair : pairs_among(global, local, limits))
    {
        const Candidate &g = global[pair.global], &l = local[pair.local];
        const bool known = g.line.fit && l.line.fit;
        if (pairAsPoints && known)
        {
            equivalent_points(g.line, l.line, unit_variance).append_to(out, localPose);
            continue;
        }
        out.paired_ln2ln.push_back({pcGlobal.lines[g.index], pcLocal.lines[l.index]});
        out.ln2ln_weights.emplace_back(1, known && weightByFit ? weight_of(g, l, unit_variance) : 1.0);
    }
}

std::vector<double> Matcher_Lines::truncated_costs(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                                   const mrpt::poses::CPose3D& localPose,
                                                   const MatchContext& context, MatchState&,
                                                   double gate) const
{
    const Limits limits = limits_of(*this, variables(context.variables));
    const auto global = candidates(pcGlobal.lines, {});
    std::vector<double> costs;
    for (const Candidate& l : candidates(pcLocal.lines, localPose))
    {
        double least = gate * gate;
        for (const Candidate& g : global) least = std::min(least, distance_sq(g, l, limits));
        costs.push_back(least);
    }
    return costs;
}

}  // namespace mp2p_icp
