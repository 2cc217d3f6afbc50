#include <mp2p_icp/Matcher_Planes.h>
#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "equivalent_points.h"
#include "one_to_one.h"
#include "plane_overlap.h"

IMPLEMENTS_MRPT_OBJECT(Matcher_Planes, mp2p_icp::Matcher, mp2p_icp)

namespace mp2p_icp
{
using Eigen::Vector3d;

namespace
{
const Range ANGLES = Range::open(0, 90);
}

void Matcher_Planes::declare_parameters(ParameterDeclaration& declare)
{
    Matcher::declare_parameters(declare);
    declare.formula("distanceThreshold", distanceThreshold, "m", Range::positive(),
                    "largest distance between paired planes, along their normals", Need::Required);
    declare.formula("angleThresholdDeg", angleThresholdDeg, "deg", ANGLES,
                    "largest angle between the normals of paired planes");
    declare.formula("maxCentroidDistance", maxCentroidDistance, "m", Range::not_negative(),
                    "largest distance between centroids where extents are unknown; 0: no limit");
    declare.number("minimumOverlap", minimumOverlap, "", Range::between(0, 1),
                   "shared part of the smaller plane, where extents are known; 0: not checked");
    declare.flag("weightByFit", weightByFit,
                 "weigh pairings by how well the planes' places are known, if they tell?");
    declare.flag(
        "pairAsPoints", pairAsPoints,
        "four weighted point-plane pairings in place of each plane-plane one, where fits are known?");
    declare.number("unitWeightSigma", unitWeightSigma, "m", Range::positive(),
                   "a distance with this standard deviation weighs 1");
}

std::optional<double> Matcher_Planes::gate(const MatchContext& context) const
{
    return checked_value(distanceThreshold, variables(context.variables), "distanceThreshold",
                         Range::positive());
}

namespace
{
/// A plane as the matcher looks at it: in the global frame, its normal of unit length.
struct Candidate
{
    size_t index;  // in its map
    fitted_plane_t plane;
    Vector3d normal, centroid;
    std::optional<PlaneBox> box;
};

std::vector<Candidate> candidates(const std::vector<fitted_plane_t>& planes, const mrpt::poses::CPose3D& pose)
{
    std::vector<Candidate> out;
    for (size_t i = 0; i < planes.size(); i++)
    {
        fitted_plane_t plane = compose(pose, planes[i]);
        const double length = plane.normal().norm();
        const Vector3d centroid = to_eigen(plane.centroid);
        if (!(length > 0) || !std::isfinite(length) || !centroid.allFinite()) continue;
        for (double& c : plane.plane.coefs) c /= length;
        if (plane.fit && !plane.fit->is_sound()) plane.fit.reset();
        Candidate candidate{i, plane, plane.normal(), centroid, {}};
        if (plane.fit) candidate.box = box_of(centroid, candidate.normal, *plane.fit);
        out.push_back(candidate);
    }
    return out;
}

/// Along the mean of the normals.
double distance_along_normals(const Candidate& a, const Candidate& b)
{
    return std::abs((a.normal + b.normal).normalized().dot(a.centroid - b.centroid));
}

struct Limits
{
    double distance, cosine, centroid_distance, overlap;

    /// Everything but the distance along the normals.
    bool may_pair(const Candidate& global, const Candidate& local) const
    {
        if (!(global.normal.dot(local.normal) >= cosine)) return false;
        if (global.box && local.box) return overlap == 0 || shared_area(*global.box, *local.box) >= overlap;
        return centroid_distance == 0 || (global.centroid - local.centroid).norm() <= centroid_distance;
    }
    bool may_pair_near(const Candidate& global, const Candidate& local) const
    {
        return global.normal.dot(local.normal) >= cosine &&
               distance_along_normals(global, local) < distance && may_pair(global, local);
    }
};

Limits limits_of(const Matcher_Planes& m, const RunVariables& vars)
{
    const double angle = checked_value(m.angleThresholdDeg, vars, "angleThresholdDeg", ANGLES);
    return {checked_value(m.distanceThreshold, vars, "distanceThreshold", Range::positive()),
            std::cos(mrpt::DEG2RAD(angle)),
            checked_value(m.maxCentroidDistance, vars, "maxCentroidDistance", Range::not_negative()),
            m.minimumOverlap};
}

/// Positions in the lists of both, with the squared distance of the centroids.
std::vector<RatedPair> pairs_among(const std::vector<Candidate>& global, const std::vector<Candidate>& local,
                                   const Limits& limits)
{
    std::vector<RatedPair> nearest;
    for (size_t l = 0; l < local.size(); l++)
    {
        RatedPair best{0, l, std::numeric_limits<double>::infinity()};
        for (size_t g = 0; g < global.size(); g++)
        {
            const double distance_sq = (global[g].centroid - local[l].centroid).squaredNorm();
            if (distance_sq < best.cost && limits.may_pair_near(global[g], local[l]))
                best = {g, l, distance_sq};
        }
        if (best.cost < std::numeric_limits<double>::infinity()) nearest.push_back(best);
    }
    return best_per_global(nearest);
}

/// Variance of the distance of the local centroid from the global plane.
double distance_variance(const Candidate& global, const Candidate& local)
{
    const Vector3d d = local.centroid - global.centroid;
    const Vector3d place(global.box->axis_u.dot(d), global.box->axis_v.dot(d), 1);
    return place.dot(global.plane.fit->covariance * place) + local.plane.fit->covariance(2, 2) +
           ROUNDING_VARIANCE;
}
}  // namespace

void Matcher_Planes::impl_match(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                                MatchState&, Pairings& out) const
{
    const Limits limits = limits_of(*this, variables(context.variables));
    const auto global = candidates(pcGlobal.planes, {}), local = candidates(pcLocal.planes, localPose);
    for (const Candidate& l : local) out.potential_pairings += pairAsPoints && l.plane.fit ? 4 : 1;
    const double unit_variance = unitWeightSigma * unitWeightSigma;
    for (const RatedPair& pair : pairs_among(global, local, limits))
    {
        const Candidate &g = global[pair.global], &l = local[pair.local];
        const bool known = g.plane.fit && l.plane.fit;
        if (pairAsPoints && known)
        {
            equivalent_points(g.plane, l.plane, unit_variance).append_to(out, localPose);
            continue;
        }
        out.paired_pl2pl.push_back({pcGlobal.planes[g.index], pcLocal.planes[l.index]});
        out.pl2pl_weights.emplace_back(1,
                                       known && weightByFit ? unit_variance / distance_variance(g, l) : 1.0);
    }
}

std::vector<double> Matcher_Planes::truncated_costs(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                                    const mrpt::poses::CPose3D& localPose,
                                                    const MatchContext& context, MatchState&,
                                                    double gate) const
{
    const Limits limits = limits_of(*this, variables(context.variables));
    const auto global = candidates(pcGlobal.planes, {});
    std::vector<double> costs;
    for (const Candidate& l : candidates(pcLocal.planes, localPose))
    {
        double least = gate;
        for (const Candidate& g : global)
            if (limits.may_pair(g, l)) least = std::min(least, distance_along_normals(g, l));
        costs.push_back(least * least);
    }
    return costs;
}

}  // namespace mp2p_icp
