#include "surface_scales.h"

#include <mp2p_icp/parallel.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

namespace mp2p_icp
{
namespace
{
constexpr uint32_t LEAST_POINTS = 6;
/// Of variances: a surface is at least three times as wide as it is thick, or bent. What that makes uncertain
/// of its normal is in `tilt`.
constexpr double THIN = 0.1;
/// A wall of a 2-D scan is ten times as long as it is thick.
constexpr double THIN_LINE = 0.01;
/// A strip narrower than this, in terms of variances, has no normal of its own.
constexpr double NARROW = 0.05;
/// And what is thicker than this, of its length, is no surface: a right-angled edge has 0.17, a ball 1.
constexpr double BULKY = 0.1;
/// If it is filled: two planes that meet fill 15 of the 27 voxels, one ring that bends there some 5.
constexpr uint32_t BODY_VOXELS = 10;
/// A plane fills 9 of the 27 voxels around a point, half of it 6; the bend of one ring of a LiDAR where wall
/// and floor meet lies in a plane, too, but passes through some 5.
constexpr uint32_t FILLED_VOXELS = 7;
/// Where it is sparser, the next larger neighbourhood must agree to within some 8 degrees.
constexpr double SAME_NORMAL = 0.99;
/** How many of the points of a neighbourhood count as independent measurements of its tilt: those that the
 * plane fitted to them leaves over, 3 to 8, as neighbours share what is wrong with them: averages of the same
 * voxels, curvature. In a 2-D scan 3: points that are interpolated between beams may be most.
 */
double independent_points(uint32_t count, bool flat)
{
    return flat ? 3 : std::clamp(count - 3.0, 3.0, 8.0);
}

/// Side of the smallest voxels, in typical distances between neighbours: (3 * 1.2)^2 = 13 points of a surface
/// in 3x3.
constexpr double VOXEL_OVER_SPACING = 1.2;
/// Voxels that differ by less than this from it are as good.
constexpr double NEAR_ENOUGH = 0.5;

/// Of how many points medians are taken.
constexpr size_t LOOKED_AT = 256;

/// All points at one height?
bool is_flat(const NearestNeighborIndex& index)
{
    const auto box = index.bounding_box();
    if (!box) return false;
    const auto size = box->max - box->min;
    return size.z <= 1e-6f * std::max(size.x, size.y);
}

bool same_plane(const SurfaceAround& a, const SurfaceAround& b)
{
    return std::abs(a.axes.col(0).dot(b.axes.col(0))) > SAME_NORMAL;
}

/// The median distance of a point to its nearest neighbour, m, over some of the points; 0 without any.
double typical_spacing(const PointView& points, const NearestNeighborIndex& index)
{
    PointArrays some;
    const size_t stride = std::max<size_t>(1, points.size / LOOKED_AT);
    for (size_t i = stride / 2; i < points.size; i += stride)
        some.x.push_back(points.x[i]), some.y.push_back(points.y[i]), some.z.push_back(points.z[i]);
    const std::vector<float> everywhere(some.size(), std::numeric_limits<float>::infinity());
    std::vector<uint32_t> ids(2 * some.size());
    std::vector<float> dist_sq(2 * some.size()), found;
    index.nearest(some, 0, some.size(), 2, everywhere.data(), ids.data(), dist_sq.data());
    for (size_t i = 0; i < some.size(); i++)
        if (ids[2 * i + 1] != NO_NEIGHBOR && dist_sq[2 * i + 1] > 0) found.push_back(dist_sq[2 * i + 1]);
    if (found.empty()) return 0;
    const auto middle = found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2);
    std::nth_element(found.begin(), middle, found.end());
    return std::sqrt(static_cast<double>(*middle));
}

}  // namespace

SurfaceScales::SurfaceScales(const metric_map_t& map, const layer_name_t& layer, double voxel_in_use)
    : points_(map.point_layer(layer)), index_(map.nn_index(layer)), flat_(is_flat(*index_))
{
    spacing_ = typical_spacing(PointView(*points_), *index_);
    smallest_voxel_ = VOXEL_OVER_SPACING * spacing_;
    const double ratio = voxel_in_use / smallest_voxel_;  // NaN without points
    if (ratio > NEAR_ENOUGH && ratio < 1 / NEAR_ENOUGH) smallest_voxel_ = voxel_in_use;
    if (!(smallest_voxel_ > 0)) return;
    std::vector<std::function<void()>> tasks;
    for (size_t k = 0; k < sizes_.size(); k++)
        tasks.emplace_back([&, k]() { sizes_[k] = map.voxel_surfaces(layer, side(k)); });
    run_all(tasks);
}

const VoxelSurface& SurfaceScales::surface(size_t size, uint32_t point) const
{
    static const VoxelSurface NOTHING;
    const uint32_t voxel = sizes_[size]->voxel_of_point[point];
    return voxel == NO_NEIGHBOR ? NOTHING : sizes_[size]->of_voxel[voxel];
}

SurfaceAround SurfaceScales::at(uint32_t point) const
{
    SurfaceAround first;                // at the smallest size at which there is something
    std::optional<SurfaceAround> thin;  // a plane that was seen too sparsely to be sure
    for (size_t k = 0; k < sizes_.size() && smallest_voxel_ > 0; k++)
    {
        const SurfaceAround seen = judged(k, point);
        if (seen.shape == SurfaceShape::Planar)
        {
            if (thin && same_plane(*thin, seen)) return surest(*thin, k, point);
            if (surface(k, point).voxels >= FILLED_VOXELS) return surest(seen, k + 1, point);
        }
        thin = seen.shape == SurfaceShape::Planar ? std::optional(seen) : std::nullopt;
        if (first.shape == SurfaceShape::Unknown) first = seen;
        if (flat_ && first.is_surface()) return first;
    }
    if (!first.is_surface()) return first;
    first.shape = SurfaceShape::Other, first.bulky = false;
    return first;
}

SurfaceAround SurfaceScales::surest(SurfaceAround plane, size_t next_size, uint32_t point) const
{
    for (size_t k = next_size; k < sizes_.size(); k++)
    {
        const SurfaceAround larger = judged(k, point);
        if (larger.shape != SurfaceShape::Planar || !same_plane(plane, larger)) break;
        if (larger.tilt.sum() < plane.tilt.sum()) plane = larger;
    }
    return plane;
}

SurfaceAround SurfaceScales::judged(size_t size, uint32_t point) const
{
    const VoxelSurface& s = surface(size, point);
    SurfaceAround out;
    out.voxel = side(size);
    const Eigen::Vector3d e(double(s.eigenvalues[0]), double(s.eigenvalues[1]), double(s.eigenvalues[2]));
    if (s.count < LEAST_POINTS || !(e[2] > 0)) return out;
    Eigen::Vector3d normal(double(s.nx), double(s.ny), double(s.nz)),
        along(double(s.dx), double(s.dy), double(s.dz));
    // Of two equal eigenvalues any directions will do.
    if (along.squaredNorm() == 0) along = normal.unitOrthogonal();
    if (normal.squaredNorm() == 0) normal = along.unitOrthogonal();
    normal =
        flat_ ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d(normal - along * along.dot(normal)).normalized();
    out.axes << normal, along.cross(normal), along;
    out.mean = {double(s.mean_x), double(s.mean_y), double(s.mean_z)};
    const bool planar = !flat_ && e[0] <= THIN * e[1] && e[1] >= NARROW * e[2];
    out.shape = e[1] <= THIN_LINE * e[2] ? SurfaceShape::Linear
                : planar                 ? SurfaceShape::Planar
                                         : SurfaceShape::Other;
    const bool is_body = e[0] >= BULKY * e[2] && s.voxels >= BODY_VOXELS;
    out.bulky = out.shape == SurfaceShape::Other && (flat_ || is_body);
    const double independent = independent_points(s.count, flat_);
    out.thickness = std::sqrt(flat_ ? e[1] : e[0]);
    if (out.shape == SurfaceShape::Planar) out.tilt = Eigen::Vector2d(e[0] / e[1], e[0] / e[2]) / independent;
    if (out.shape == SurfaceShape::Linear) out.tilt = Eigen::Vector2d(e[0] / e[2], e[1] / e[2]) / independent;
    return out;
}

double SurfaceScales::typical_thickness() const
{
    std::vector<double> found;
    const size_t n = points_->size(), stride = std::max<size_t>(1, n / LOOKED_AT);
    for (size_t i = stride / 2; i < n; i += stride)
        if (const SurfaceAround a = at(static_cast<uint32_t>(i)); a.is_surface())
            found.push_back(a.thickness);
    if (found.empty()) return 0;
    const auto middle = found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2);
    std::nth_element(found.begin(), middle, found.end());
    return *middle;
}

std::vector<uint32_t> SurfaceScales::points_near(const std::vector<Eigen::Vector3d>& places,
                                                 double distance) const
{
    PointArrays queries;
    queries.resize(places.size());
    for (size_t i = 0; i < places.size(); i++)
        queries.x[i] = float(places[i].x()), queries.y[i] = float(places[i].y()),
        queries.z[i] = float(places[i].z());
    const std::vector<float> reach_sq(places.size(), static_cast<float>(distance * distance));
    std::vector<uint32_t> ids(places.size());
    std::vector<float> dist_sq(places.size());
    parallel_for_blocks(
        places.size(), [&](size_t first, size_t last)
        { index_->nearest(queries, first, last, 1, reach_sq.data(), ids.data(), dist_sq.data()); });
    return ids;
}

}  // namespace mp2p_icp
