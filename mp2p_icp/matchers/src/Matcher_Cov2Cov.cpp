#include <mp2p_icp/Matcher_Cov2Cov.h>
#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <Eigen/Dense>

#include "pairs_with_local_surfaces.h"

IMPLEMENTS_MRPT_OBJECT(Matcher_Cov2Cov, mp2p_icp::Matcher_Points_Base, mp2p_icp)

namespace mp2p_icp
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

void Matcher_Cov2Cov::declare_parameters(ParameterDeclaration& declare)
{
    Matcher_Points_Base::declare_parameters(declare);
    declare.formula("distanceThreshold", distanceThreshold, "m", Range::positive(),
                    "largest distance between the points of a pair", Need::Required);
    declare.number("searchRadius", searchRadius, "m", Range::positive(),
                   "radius of the neighbourhood of a point to which a plane is fitted");
    declare.integer("knn", knn, Range::between(3, 1000),
                    "fit planes to so many points at most, the nearest ones, itself included");
    declare.number(
        "surfaceVoxelSize", surfaceVoxelSize, "m", Range::not_negative(),
        "above 0: fit planes to all points in the 3x3x3 voxels of this side around the point's, in "
        "place of searchRadius and knn; takes a tenth of the time");
    declare.integer("minimumPlanePoints", minimumPlanePoints, Range::between(3, 1000),
                    "no plane where the neighbourhood has fewer points");
    Range epsilon = Range::between(0, 1);
    epsilon.lo_open = true;
    declare.number("planeEpsilon", planeEpsilon, "", epsilon,
                   "variance across a plane, of that along it; 1: plain distances between points");
}

std::optional<double> Matcher_Cov2Cov::gate(const MatchContext& context) const
{
    return checked_value(distanceThreshold, variables(context.variables), "distanceThreshold",
                         Range::positive());
}

SurfaceScratch& Matcher_Cov2Cov::nearest_points(const layer_name_t& globalLayer,
                                                const layer_name_t& localLayer,
                                                const mrpt::poses::CPose3D& localPose, double distance,
                                                MatchState& state) const
{
    SurfaceScratch& s = surface_scratch(*this, globalLayer, localLayer,
                                        neighbourhoods(surfaceVoxelSize, knn, searchRadius), state, true);
    transform_local_to_global(localLayer, localPose, state, s.nearest.local);
    find_nearest(1, distance, s);
    return s;
}

namespace
{
/// C of the Generalized-ICP paper, for a plane that is 1 wide.
Matrix3d covariance_of(const LocalSurface& surface, uint32_t least_points, double epsilon)
{
    if (surface.count < least_points || surface.normal.isZero(0)) return Matrix3d::Identity();
    const Vector3d n = surface.normal.cast<double>().normalized();
    return Matrix3d::Identity() - (1 - epsilon) * n * n.transpose();
}
}  // namespace

Matrix3d Matcher_Cov2Cov::weight_matrix(const SurfaceScratch& s, size_t k, const Matrix3d& R) const
{
    const auto of = [&](const LocalSurfaces& surfaces, uint32_t point)
    { return covariance_of(surfaces.of_point[point], minimumPlanePoints, planeEpsilon); };
    const Matrix3d sum =
        of(*s.global, s.nearest.ids[k]) + R * of(*s.local, s.nearest.local.ids[k]) * R.transpose();
    return 2 * planeEpsilon * sum.inverse();
}

void Matcher_Cov2Cov::implMatchOneLayer(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                        const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                                        MatchState& state, Pairings& out) const
{
    const SurfaceScratch& s = nearest_points(globalLayer, localLayer, localPose, *gate(context), state);
    const LocalPoints& local_points = s.nearest.local;
    const auto global = state.pcGlobal.point_layer(globalLayer),
               local = state.pcLocal.point_layer(localLayer);
    auto& is_paired = state.localPairedBitField.point_layers.at(localLayer);
    std::vector<size_t> paired;
    for (size_t k = 0; k < local_points.ids.size(); k++)
        if (s.nearest.ids[k] != NO_NEIGHBOR) paired.push_back(k), is_paired[local_points.ids[k]] = true;
    out.potential_pairings += 3 * local_points.ids.size();

    const size_t before = out.paired_pt2pl.size(), weights_before = out.pt2pl_weights.size();
    out.paired_pt2pl.resize(before + 3 * paired.size());
    out.pt2pl_weights.resize(weights_before + 3 * paired.size());
    const double weight = weight_of_layers(*this, globalLayer, localLayer);
    const Matrix3d R = rotation_of(localPose);
    const auto pair_point = [&](size_t n)
    {
        const size_t k = paired[n];
        const Vector3d there = point_of(*global, s.nearest.ids[k]);
        const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(weight_matrix(s, k, R));
        for (int i = 0; i < 3; i++)
        {
            const size_t at = 3 * n + static_cast<size_t>(i);
            const Vector3d normal = eigen.eigenvectors().col(i);
            auto& pair = out.paired_pt2pl[before + at];
            pair.pl_global.plane.coefs = {normal.x(), normal.y(), normal.z(), -normal.dot(there)};
            pair.pl_global.centroid = to_mrpt(there);
            pair.pt_local = to_mrpt(point_of(*local, local_points.ids[k]));
            out.pt2pl_weights[weights_before + at] = {1, weight * std::max(0.0, eigen.eigenvalues()(i))};
        }
    };
    parallel_for_blocks(paired.size(),
                        [&](size_t first, size_t last)
                        {
                            for (size_t n = first; n < last; n++) pair_point(n);
                        });
}

void Matcher_Cov2Cov::append_costs(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                   const mrpt::poses::CPose3D& localPose, const MatchContext&,
                                   MatchState& state, double gate, std::vector<double>& costs) const
{
    const SurfaceScratch& s = nearest_points(globalLayer, localLayer, localPose, gate, state);
    const auto global = state.pcGlobal.point_layer(globalLayer);
    const Matrix3d R = rotation_of(localPose);
    const auto cost = [&](size_t k)
    {
        if (s.nearest.ids[k] == NO_NEIGHBOR) return gate * gate;
        const Vector3d d = point_of(s.nearest.local.in_global, k) - point_of(*global, s.nearest.ids[k]);
        return d.dot(weight_matrix(s, k, R) * d);
    };
    for (size_t k = 0; k < s.nearest.local.ids.size(); k++) costs.push_back(cost(k));
}

}  // namespace mp2p_icp
