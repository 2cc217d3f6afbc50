#include <mp2p_icp/Matcher_Adaptive.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "pairs_with_local_surfaces.h"

IMPLEMENTS_MRPT_OBJECT(Matcher_Adaptive, mp2p_icp::Matcher_Points_Base, mp2p_icp)

namespace mp2p_icp
{
void Matcher_Adaptive::declare_parameters(ParameterDeclaration& declare)
{
    Matcher_Points_Base::declare_parameters(declare);
    declare.number("confidenceInterval", confidenceInterval, "", Range::open(0, 1),
                   "fraction of the nearest distances that the threshold lets through");
    declare.number("minimumCorrDist", minimumCorrDist, "m", Range::positive(), "least threshold");
    declare.formula("absoluteMaxSearchDistance", absoluteMaxSearchDistance, "m", Range::positive(),
                    "largest threshold; points farther apart do not count at all", Need::Required);
    declare.flag("enableDetectPlanes", enableDetectPlanes, "pair with planes where there are some");
    declare.flag("enableDetectLines", enableDetectLines, "pair with lines where there are some");
    declare.number("searchRadius", searchRadius, "m", Range::positive(),
                   "radius of the neighbourhood of a global point to which planes and lines are fitted");
    declare.integer("planeSearchPoints", planeSearchPoints, Range::between(3, 1000),
                    "fit planes and lines to so many points at most, the nearest ones, itself included");
    declare.integer("planeMinimumFoundPoints", planeMinimumFoundPoints, Range::between(3, 1000),
                    "no plane or line where the neighbourhood has fewer points");
    declare.number("planeEigenThreshold", planeEigenThreshold, "", Range::between(0, 1),
                   "no plane where the smallest eigenvalue of the neighbourhood's covariance is above this "
                   "times the largest");
    declare.number("planeWidthThreshold", planeWidthThreshold, "", Range::between(0, 1),
                   "no plane where the middle eigenvalue is below this times the largest");
    declare.number("lineEigenThreshold", lineEigenThreshold, "", Range::between(0, 1),
                   "a line where the middle eigenvalue is at most this times the largest");
    declare.number("planeMinimumDistance", planeMinimumDistance, "m", Range::not_negative(),
                   "points farther from the plane or line are paired with the global point; 0: no limit");
    declare.flag("sensorAtOrigin", sensorAtOrigin,
                 "the global map is a scan taken from the origin of its frame: normals point there");
    declare.integer("maxPt2PtCorrespondences", maxPt2PtCorrespondences, Range::between(1, 1000),
                    "up to so many global points per local point");
    Range at_least_one;
    at_least_one.lo = 1, at_least_one.hi_open = true;
    declare.number("firstToSecondDistanceMax", firstToSecondDistanceMax, "", at_least_one,
                   "none of them farther than this times the nearest");
    declare.rule(
        [this]() -> std::string
        {
            if (planeMinimumFoundPoints <= planeSearchPoints) return "";
            return "'planeMinimumFoundPoints' must not be above 'planeSearchPoints', of which planes are "
                   "made";
        });
}

std::optional<double> Matcher_Adaptive::gate(const MatchContext& context) const
{
    return checked_value(absoluteMaxSearchDistance, variables(context.variables), "absoluteMaxSearchDistance",
                         Range::positive());
}

namespace
{
/// The quantile of the squared distances to the nearest points, of those that have one. `scratch` is memory.
float quantile_sq(const NearestScratch& n, uint32_t k, double fraction, std::vector<float>& scratch)
{
    scratch.clear();
    for (size_t i = 0; i < n.local.ids.size(); i++)
        if (n.ids[i * k] != NO_NEIGHBOR) scratch.push_back(n.dist_sq[i * k]);
    if (scratch.empty()) return 0;
    const double rank = std::ceil(fraction * static_cast<double>(scratch.size()));
    const size_t index = std::min(scratch.size(), std::max<size_t>(1, static_cast<size_t>(rank))) - 1;
    const auto at = scratch.begin() + static_cast<std::ptrdiff_t>(index);
    std::nth_element(scratch.begin(), at, scratch.end());
    return *at;
}

/// Forgets the global points that are too far, or too much farther than the nearest.
void drop_far_points(uint32_t k, float max_dist_sq, double max_ratio, NearestScratch& n)
{
    for (size_t i = 0; i < n.local.ids.size(); i++)
        for (size_t j = 0; j < k; j++)
        {
            const double nearest_sq = double(n.dist_sq[i * k]);
            if (n.dist_sq[i * k + j] > max_dist_sq ||
                double(n.dist_sq[i * k + j]) > max_ratio * max_ratio * nearest_sq)
                n.ids[i * k + j] = NO_NEIGHBOR;
        }
}

/// The points of those that have no surface to be paired with. \return how many could have been paired
size_t collect_points(uint32_t k, const std::vector<bool>* excluded, SurfaceScratch& s)
{
    NearestScratch& n = s.nearest;
    size_t potential = 0;
    n.candidates.clear();
    for (size_t i = 0; i < s.chosen.size(); i++)
    {
        const bool has_surface = s.chosen[i].found();
        potential += has_surface ? 1 : k;
        for (size_t j = i * k; !has_surface && j < (i + 1) * k && n.ids[j] != NO_NEIGHBOR; j++)
            if (!excluded || !(*excluded)[n.ids[j]])
                n.candidates.push_back({static_cast<uint32_t>(i), n.ids[j], n.dist_sq[j]});
    }
    return potential;
}
}  // namespace

SurfaceScratch& Matcher_Adaptive::nearest_points(const layer_name_t& globalLayer,
                                                 const layer_name_t& localLayer,
                                                 const mrpt::poses::CPose3D& localPose, double distance,
                                                 MatchState& state) const
{
    SurfaceScratch& s =
        surface_scratch(*this, globalLayer, localLayer, {planeSearchPoints, searchRadius}, state);
    transform_local_to_global(localLayer, localPose, state, s.nearest.local);
    find_nearest(maxPt2PtCorrespondences, distance, s);
    return s;
}

void Matcher_Adaptive::choose(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                              double threshold, const MatchState& state, SurfaceScratch& s) const
{
    SurfaceChoice choice;
    choice.limits.plane = planeEigenThreshold, choice.limits.plane_width = planeWidthThreshold;
    choice.limits.line = lineEigenThreshold;
    choice.limits.plane_points = choice.limits.line_points = planeMinimumFoundPoints;
    const double reach = planeMinimumDistance > 0 ? std::min(planeMinimumDistance, threshold) : threshold;
    choice.max_plane_distance = enableDetectPlanes ? reach : 0;
    choice.max_line_distance = enableDetectLines ? reach : 0;
    choose_surfaces(*state.pcGlobal.point_layer(globalLayer), *state.pcLocal.point_layer(localLayer),
                    maxPt2PtCorrespondences, choice, s);
}

void Matcher_Adaptive::implMatchOneLayer(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                         const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                                         MatchState& state, Pairings& out) const
{
    const double largest = *gate(context);
    const uint32_t k = maxPt2PtCorrespondences;
    SurfaceScratch& s = nearest_points(globalLayer, localLayer, localPose, largest, state);
    NearestScratch& n = s.nearest;
    const double quantile = std::sqrt(double(quantile_sq(n, k, confidenceInterval, s.distances)));
    const double threshold = std::min(largest, std::max(minimumCorrDist, quantile));
    drop_far_points(k, static_cast<float>(threshold * threshold), firstToSecondDistanceMax, n);
    choose(globalLayer, localLayer, threshold, state, s);
    std::optional<Eigen::Vector3d> sensor;
    if (sensorAtOrigin) sensor = sensor_of(state.pcGlobal);
    append_surface_pairings(globalLayer, localLayer, weight_of_layers(*this, globalLayer, localLayer), sensor,
                            s, state, out);

    const auto& paired = state.globalPairedBitField.point_layers.at(globalLayer);
    const bool shared = allowMatchAlreadyMatchedGlobalPoints_;
    out.potential_pairings += collect_points(k, shared ? nullptr : &paired, s);
    if (!shared) keep_best_per_global(n.candidates, state.pcGlobal.point_layer(globalLayer)->size(), n.best);
    append_pairings(globalLayer, localLayer, n, !shared, localPose, state, out);
}

void Matcher_Adaptive::append_costs(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                    const mrpt::poses::CPose3D& localPose, const MatchContext&,
                                    MatchState& state, double gate, std::vector<double>& costs) const
{
    const uint32_t k = maxPt2PtCorrespondences;
    SurfaceScratch& s = nearest_points(globalLayer, localLayer, localPose, gate, state);
    const NearestScratch& n = s.nearest;
    choose(globalLayer, localLayer, gate, state, s);
    append_surface_costs(*state.pcGlobal.point_layer(globalLayer), gate, s, costs);
    const size_t as_surfaces = costs.size() - s.chosen.size();
    for (size_t i = 0; i < s.chosen.size(); i++)
    {
        const bool alone = n.ids[i * k] == NO_NEIGHBOR;
        double& as_surface = costs[as_surfaces + i];
        double as_point = alone ? gate * gate : double(n.dist_sq[i * k]);
        if (!alone) (s.chosen[i].found() ? as_point : as_surface) = std::numeric_limits<double>::quiet_NaN();
        costs.push_back(as_point);
    }
}

}  // namespace mp2p_icp
