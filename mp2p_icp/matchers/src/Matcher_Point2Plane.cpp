#include <mp2p_icp/Matcher_Point2Plane.h>
#include <mp2p_icp/se3.h>

#include "pairs_with_local_surfaces.h"

IMPLEMENTS_MRPT_OBJECT(Matcher_Point2Plane, mp2p_icp::Matcher_Points_Base, mp2p_icp)

namespace mp2p_icp
{
void Matcher_Point2Plane::declare_parameters(ParameterDeclaration& declare)
{
    Matcher_Points_Base::declare_parameters(declare);
    declare.formula(
        "distanceThreshold", distanceThreshold, "m", Range::positive(),
        "largest distance of a local point from the plane, and from the global point it is around",
        Need::Required);
    declare.number("searchRadius", searchRadius, "m", Range::positive(),
                   "radius of the neighbourhood of a global point to which a plane is fitted");
    declare.integer("knn", knn, Range::between(3, 1000),
                    "fit planes to so many points at most, the nearest ones, itself included");
    declare.number(
        "surfaceVoxelSize", surfaceVoxelSize, "m", Range::not_negative(),
        "above 0: fit planes to all points in the 3x3x3 voxels of this side around the global point's, in "
        "place of searchRadius and knn; takes a tenth of the time");
    declare.integer("minimumPlanePoints", minimumPlanePoints, Range::between(3, 1000),
                    "no plane where the neighbourhood has fewer points");
    declare.number("planeEigenThreshold", planeEigenThreshold, "", Range::between(0, 1),
                   "no plane (but a blob) where the smallest eigenvalue of the neighbourhood's covariance is "
                   "above this times the largest");
    declare.number("planeWidthThreshold", planeWidthThreshold, "", Range::between(0, 1),
                   "no plane (but a line) where the middle eigenvalue is below this times the largest");
    declare.integer("nearestPointsTried", nearestPointsTried, Range::between(1, 1000),
                    "take the plane around the first of so many nearest global points that has one");
    declare.flag("localPointMustFitPlaneToo", localPointMustFitPlaneToo,
                 "only pair local points that lie on a plane of the local cloud, with a similar normal");
    declare.number("localToGlobalPlaneMinAbsCosine", localToGlobalPlaneMinAbsCosine, "", Range::between(0, 1),
                   "least cosine between the normals, for localPointMustFitPlaneToo");
    declare.flag(
        "sensorAtOrigin", sensorAtOrigin,
        "both maps are scans taken from the origins of their frames: normals point there, and the two "
        "sides of a plane differ");
    declare.rule(
        [this]() -> std::string
        {
            if (minimumPlanePoints <= knn || surfaceVoxelSize > 0) return "";
            return "'minimumPlanePoints' must not be above 'knn', of which the plane is made";
        });
}

std::optional<double> Matcher_Point2Plane::gate(const MatchContext& context) const
{
    return checked_value(distanceThreshold, variables(context.variables), "distanceThreshold",
                         Range::positive());
}

LocalSurfaceOptions Matcher_Point2Plane::surface_options() const
{
    return neighbourhoods(surfaceVoxelSize, knn, searchRadius);
}

SurfaceScratch& Matcher_Point2Plane::chosen_planes(const layer_name_t& globalLayer,
                                                   const layer_name_t& localLayer,
                                                   const mrpt::poses::CPose3D& localPose, double distance,
                                                   MatchState& state) const
{
    SurfaceScratch& s =
        surface_scratch(*this, globalLayer, localLayer, surface_options(), state, localPointMustFitPlaneToo);
    SurfaceChoice choice;
    choice.limits.plane = planeEigenThreshold, choice.limits.plane_width = planeWidthThreshold;
    choice.limits.plane_points = minimumPlanePoints;
    choice.limits.line = 0;
    choice.max_plane_distance = distance;
    if (localPointMustFitPlaneToo)
    {
        if (!s.local_planar) s.local_planar = planar_points(*s.local, choice.limits);
        choice.agreement = NormalAgreement{rotation_of(localPose), localToGlobalPlaneMinAbsCosine, {}, {}};
        if (sensorAtOrigin)
            choice.agreement->global_sensor = sensor_of(state.pcGlobal),
            choice.agreement->local_sensor = sensor_of(state.pcLocal);
    }
    transform_local_to_global(localLayer, localPose, state, s.nearest.local,
                              localPointMustFitPlaneToo ? &*s.local_planar : nullptr);
    find_nearest(nearestPointsTried, distance, s);
    choose_surfaces(*state.pcGlobal.point_layer(globalLayer), *state.pcLocal.point_layer(localLayer),
                    nearestPointsTried, choice, s);
    return s;
}

void Matcher_Point2Plane::implMatchOneLayer(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                            const mrpt::poses::CPose3D& localPose,
                                            const MatchContext& context, MatchState& state,
                                            Pairings& out) const
{
    SurfaceScratch& s = chosen_planes(globalLayer, localLayer, localPose, *gate(context), state);
    out.potential_pairings += potential_pairings(s);
    std::optional<Eigen::Vector3d> sensor;
    if (sensorAtOrigin) sensor = sensor_of(state.pcGlobal);
    append_surface_pairings(globalLayer, localLayer, weight_of_layers(*this, globalLayer, localLayer), sensor,
                            s, state, out);
}

void Matcher_Point2Plane::append_costs(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                       const mrpt::poses::CPose3D& localPose, const MatchContext&,
                                       MatchState& state, double gate, std::vector<double>& costs) const
{
    const SurfaceScratch& s = chosen_planes(globalLayer, localLayer, localPose, gate, state);
    append_surface_costs(*state.pcGlobal.point_layer(globalLayer), gate, s, costs);
}

}  // namespace mp2p_icp
