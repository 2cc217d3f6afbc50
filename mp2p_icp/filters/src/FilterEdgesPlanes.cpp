#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp_filters/FilterEdgesPlanes.h>

#include <algorithm>

#include "VoxelCells.h"
#include "filter_layers.h"
#include "noted_parameter.h"
#include "plane_cells.h"

IMPLEMENTS_MRPT_OBJECT(FilterEdgesPlanes, FilterBase, mp2p_icp_filters)

namespace mp2p_icp_filters
{
using Eigen::Vector3d;
using mp2p_icp::Need;
using mp2p_icp::Range;

FilterEdgesPlanes::FilterEdgesPlanes()
{
    setLoggerName("FilterEdgesPlanes");
}

void FilterEdgesPlanes::declare_parameters(mp2p_icp::ParameterDeclaration& declare)
{
    const Range counts = Range::between(1, UINT32_MAX);
    declare.text("input_pointcloud_layer", input_pointcloud_layer, "The cloud whose voxels are sorted.");
    declare.number("voxel_filter_resolution", voxel_filter_resolution, "m", Range::positive(),
                   "Side of the voxels.", Need::Required);
    declare.integer("voxel_filter_decimation", voxel_filter_decimation, counts,
                    "One of so many points of an edge or plane voxel is kept.", Need::Required);
    declare.integer("full_pointcloud_decimation", full_pointcloud_decimation, counts,
                    "One of so many points of the cloud goes into 'full_decim'.", Need::Required);
    declare.number("voxel_filter_max_e2_e0", voxel_filter_max_e2_e0, "", Range::positive(),
                   "Of an edge, e2 / e0 is larger.", Need::Required);
    declare.number("voxel_filter_max_e1_e0", voxel_filter_max_e1_e0, "", Range::positive(),
                   "Of an edge, e1 / e0 is smaller.", Need::Required);
    declare.number("voxel_filter_min_e2_e0", voxel_filter_min_e2_e0, "", Range::positive(),
                   "Of a plane, e2 / e0 is larger.", Need::Required);
    declare.number("voxel_filter_min_e1_e0", voxel_filter_min_e1_e0, "", Range::positive(),
                   "Of a plane, e1 / e0 is larger.", Need::Required);
    declare.number("voxel_filter_min_e1", voxel_filter_min_e1, "m^2", Range::not_negative(),
                   "Of a plane, e1 is larger.");
    KeysWithoutEffect keys;
    for (const char* end : {"min", "max"})
        for (const char* axis : {"x", "y", "z"})
            keys.number(declare, std::string("init_extension_") + end + "_" + axis, HASHED);
    keys.flag(declare, "use_tsl_robin_map", ONE_HASH_MAP);
    keys.keep_in(declare);
}

namespace
{
enum class VoxelKind : uint8_t
{
    Neither,
    Edge,
    Plane
};

constexpr size_t LEAST_POINTS = 5;

/// The points of each voxel, voxels in the order of their first points.
std::vector<std::vector<size_t>> points_by_voxel(const mrpt::maps::CPointsMap& cloud, double side)
{
    VoxelCells numbers;
    std::vector<std::vector<size_t>> out;
    for (size_t i = 0; i < cloud.size(); i++)
    {
        float x = 0, y = 0, z = 0;
        cloud.getPointFast(i, x, y, z);
        const auto cell = cell_of(x, y, z, side);
        if (!cell) continue;
        const uint32_t voxel = numbers.number_of(*cell);
        if (voxel == out.size()) out.emplace_back();
        out[voxel].push_back(i);
    }
    return out;
}

PointMoments moments_of_voxel(const mrpt::maps::CPointsMap& cloud, const std::vector<size_t>& indices)
{
    std::vector<Vector3d> points;
    std::vector<uint32_t> all;
    for (const size_t i : indices)
    {
        float x = 0, y = 0, z = 0;
        cloud.getPointFast(i, x, y, z);
        all.push_back(static_cast<uint32_t>(points.size()));
        points.emplace_back(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
    }
    return moments_of(points, all.data(), all.data() + all.size());
}

VoxelKind kind_of(const FilterEdgesPlanes& f, const PointMoments& moments)
{
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(moments.scatter / moments.count,
                                                               Eigen::EigenvaluesOnly);
    const double e2 = eigen.eigenvalues()(2), e1 = eigen.eigenvalues()(1);
    constexpr double ROUNDING = 1e-12;
    const double e0 = std::max(eigen.eigenvalues()(0), ROUNDING * e2);
    if (e2 > f.voxel_filter_min_e2_e0 * e0 && e1 > f.voxel_filter_min_e1_e0 * e0 &&
        e1 > f.voxel_filter_min_e1)
        return VoxelKind::Plane;
    if (e2 > f.voxel_filter_max_e2_e0 * e0 && e1 < f.voxel_filter_max_e1_e0 * e0) return VoxelKind::Edge;
    return VoxelKind::Neither;
}

mp2p_icp::plane_patch_t patch_of(const PointMoments& moments)
{
    const MomentPlane plane = plane_through(moments);
    const Vector3d n = plane.normal.dot(plane.centre) > 0 ? Vector3d(-plane.normal) : plane.normal;
    mp2p_icp::plane_patch_t out;
    out.centroid = mp2p_icp::to_mrpt(plane.centre);
    out.plane.coefs = {n.x(), n.y(), n.z(), -n.dot(plane.centre)};
    return out;
}

void append_every(uint32_t step, const std::vector<size_t>& from, std::vector<size_t>& to)
{
    for (size_t k = 0; k < from.size(); k += step) to.push_back(from[k]);
}
}  // namespace

void FilterEdgesPlanes::filter(mp2p_icp::metric_map_t& inOut) const
{
    const auto cloud = input_layer(*this, inOut, input_pointcloud_layer);
    std::vector<size_t> edges, planes, all;
    inOut.planes.clear();
    for (const auto& voxel : points_by_voxel(*cloud, voxel_filter_resolution))
    {
        if (voxel.size() < LEAST_POINTS) continue;
        const PointMoments moments = moments_of_voxel(*cloud, voxel);
        const VoxelKind kind = kind_of(*this, moments);
        if (kind == VoxelKind::Edge) append_every(voxel_filter_decimation, voxel, edges);
        if (kind != VoxelKind::Plane) continue;
        append_every(voxel_filter_decimation, voxel, planes);
        inOut.planes.emplace_back(patch_of(moments));
    }
    append_every(full_pointcloud_decimation, mp2p_icp::finite_points(*cloud), all);
    write_centroids(inOut, mp2p_icp::metric_map_t::PT_LAYER_PLANE_CENTROIDS);
    write_layer(inOut, "edge_points", *cloud, edges);
    write_layer(inOut, "plane_points", *cloud, planes);
    write_layer(inOut, "full_decim", *cloud, all);
}

}  // namespace mp2p_icp_filters
