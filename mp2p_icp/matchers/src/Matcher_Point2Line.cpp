#include <mp2p_icp/Matcher_Point2Line.h>

#include "pairs_with_local_surfaces.h"

IMPLEMENTS_MRPT_OBJECT(Matcher_Point2Line, mp2p_icp::Matcher_Points_Base, mp2p_icp)

namespace mp2p_icp
{
void Matcher_Point2Line::declare_parameters(ParameterDeclaration& declare)
{
    Matcher_Points_Base::declare_parameters(declare);
    declare.formula("distanceThreshold", distanceThreshold, "m", Range::positive(),
                    "largest distance of a local point from the line, and from the global point it is around",
                    Need::Required);
    declare.number("searchRadius", searchRadius, "m", Range::positive(),
                   "radius of the neighbourhood of a global point to which a line is fitted");
    declare.integer("knn", knn, Range::between(3, 1000),
                    "fit lines to so many points at most, the nearest ones, itself included");
    declare.integer("minimumLinePoints", minimumLinePoints, Range::between(3, 1000),
                    "no line where the neighbourhood has fewer points");
    declare.number(
        "lineEigenThreshold", lineEigenThreshold, "", Range::between(0, 1),
        "no line where the middle eigenvalue of the neighbourhood's covariance is above this times "
        "the largest");
    declare.integer("nearestPointsTried", nearestPointsTried, Range::between(1, 1000),
                    "take the line around the first of so many nearest global points that has one");
    declare.rule(
        [this]() -> std::string
        {
            if (minimumLinePoints <= knn) return "";
            return "'minimumLinePoints' must not be above 'knn', of which the line is made";
        });
}

std::optional<double> Matcher_Point2Line::gate(const MatchContext& context) const
{
    return checked_value(distanceThreshold, variables(context.variables), "distanceThreshold",
                         Range::positive());
}

SurfaceScratch& Matcher_Point2Line::chosen_lines(const layer_name_t& globalLayer,
                                                 const layer_name_t& localLayer,
                                                 const mrpt::poses::CPose3D& localPose, double distance,
                                                 MatchState& state) const
{
    SurfaceScratch& s = surface_scratch(*this, globalLayer, localLayer, {knn, searchRadius}, state);
    transform_local_to_global(localLayer, localPose, state, s.nearest.local);
    SurfaceChoice choice;
    choice.limits.line = lineEigenThreshold, choice.limits.line_points = minimumLinePoints;
    choice.max_line_distance = distance;
    find_nearest(nearestPointsTried, distance, s);
    choose_surfaces(*state.pcGlobal.point_layer(globalLayer), *state.pcLocal.point_layer(localLayer),
                    nearestPointsTried, choice, s);
    return s;
}

void Matcher_Point2Line::implMatchOneLayer(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                           const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                                           MatchState& state, Pairings& out) const
{
    SurfaceScratch& s = chosen_lines(globalLayer, localLayer, localPose, *gate(context), state);
    out.potential_pairings += potential_pairings(s);
    append_surface_pairings(globalLayer, localLayer, weight_of_layers(*this, globalLayer, localLayer), {}, s,
                            state, out);
}

void Matcher_Point2Line::append_costs(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                      const mrpt::poses::CPose3D& localPose, const MatchContext&,
                                      MatchState& state, double gate, std::vector<double>& costs) const
{
    const SurfaceScratch& s = chosen_lines(globalLayer, localLayer, localPose, gate, state);
    append_surface_costs(*state.pcGlobal.point_layer(globalLayer), gate, s, costs);
}

}  // namespace mp2p_icp
