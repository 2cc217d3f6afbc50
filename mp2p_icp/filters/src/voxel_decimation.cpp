#include "voxel_decimation.h"

#include <mp2p_icp/block_grid.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/random.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "VoxelCells.h"
#include "field_columns.h"

namespace mp2p_icp_filters
{
using mrpt::maps::CPointsMap;

namespace
{
/// The points that one output point stands for: those of a voxel, or one that is kept.
struct Group
{
    size_t first_point = 0;
    uint32_t count = 1;
    uint32_t voxel = mp2p_icp::NO_NEIGHBOR;
};

/// Groups in the order of their first points.
struct Groups
{
    std::vector<Group> groups;
    mp2p_icp::BlockGrid voxels;
    std::vector<uint32_t> origin;  ///< index in the cloud of each point of `voxels`; empty: its own

    size_t origin_of(size_t i) const { return origin.empty() ? i : origin[i]; }
    /// visit(point, voxel) for all points that are in voxels, in their order.
    template <class Visit>
    void for_points_in_voxels(const Visit& visit) const
    {
        const auto& voxel_of_point = voxels.voxel_of_point();
        for (size_t i = 0; i < voxel_of_point.size(); i++)
            if (voxel_of_point[i] != mp2p_icp::NO_NEIGHBOR) visit(origin_of(i), voxel_of_point[i]);
    }
};

bool is_finite(const mp2p_icp::PointView& p, size_t i)
{
    return std::isfinite(p.x[i]) && std::isfinite(p.y[i]) && std::isfinite(p.z[i]);
}

/// Parts the points of the input: those that are kept become groups of their own. \return the others, if not
/// all of the cloud
mp2p_icp::PointArrays part(const DecimationInput& input, Groups& out)
{
    const mp2p_icp::PointView all(*input.points);
    mp2p_icp::PointArrays others;
    auto whole = input.kept_whole.begin();
    for (size_t i = 0; i < all.size; i++)
    {
        while (whole != input.kept_whole.end() && i >= whole->second) ++whole;
        const bool is_kept = whole != input.kept_whole.end() && i >= whole->first;
        if (is_kept && is_finite(all, i)) out.groups.push_back({i});
        if (is_kept) continue;
        others.x.push_back(all.x[i]), others.y.push_back(all.y[i]), others.z.push_back(all.z[i]);
        out.origin.push_back(static_cast<uint32_t>(i));
    }
    return others;
}

[[noreturn]] void refuse_far_points(const mp2p_icp::PointView& points, double side)
{
    const auto radius = [&](size_t i)
    {
        return is_finite(points, i)
                   ? std::max({std::abs(points.x[i]), std::abs(points.y[i]), std::abs(points.z[i])})
                   : 0.f;
    };
    size_t farthest = 0;
    for (size_t i = 1; i < points.size; i++)
        if (radius(i) > radius(farthest)) farthest = i;
    throw std::invalid_argument("FilterDecimateVoxels: point " + std::to_string(farthest) +
                                " of the input, at (" + mp2p_icp::to_text(points.x[farthest]) + ", " +
                                mp2p_icp::to_text(points.y[farthest]) + ", " +
                                mp2p_icp::to_text(points.z[farthest]) + "), is too far away for cells of " +
                                mp2p_icp::to_text(side) + " m");
}

mp2p_icp::BlockGrid voxels_of(const mp2p_icp::PointView& points, double side)
{
    mp2p_icp::BlockGridOptions options;
    options.voxel_size = side, options.elements = mp2p_icp::GridElements::None;
    try
    {
        return mp2p_icp::BlockGrid(points, options);
    }
    catch (const std::invalid_argument&)
    {
        refuse_far_points(points, side);
    }
}

Groups group_points(const DecimationInput& input, double side)
{
    Groups out;
    if (input.kept_whole.empty())
        out.voxels = voxels_of(*input.points, side);
    else
        out.voxels = voxels_of(part(input, out), side);
    const auto kept = static_cast<std::ptrdiff_t>(out.groups.size());
    const auto& counts = out.voxels.point_counts();
    const auto& voxel_of_point = out.voxels.voxel_of_point();
    std::vector<uint8_t> is_met(out.voxels.voxel_count(), 0);
    out.groups.reserve(out.groups.size() + is_met.size());
    uint8_t* const met =
        is_met.data();  // writing bytes might change the vector itself, for all a compiler knows
    for (size_t i = 0, n = voxel_of_point.size(); i < n; i++)
    {
        const uint32_t v = voxel_of_point[i];
        if (v == mp2p_icp::NO_NEIGHBOR || met[v]) continue;
        met[v] = 1;
        out.groups.push_back({out.origin_of(i), counts[v], v});
    }
    std::inplace_merge(out.groups.begin(), out.groups.begin() + kept, out.groups.end(),
                       [](const Group& a, const Group& b) { return a.first_point < b.first_point; });
    return out;
}

/// Writes the means of the fields beyond coordinates.
void average_fields(CPointsMap& out, const CPointsMap& points, const Groups& groups)
{
    const FieldColumns columns(points);
    if (columns.count() == 0) return;
    std::vector<std::vector<double>> sums;
    for (size_t f = 0; f < columns.count(); f++)
    {
        auto& sum = sums.emplace_back(groups.voxels.voxel_count(), 0.0);
        const float* const values = columns[f];
        groups.for_points_in_voxels([&](size_t i, uint32_t v) { sum[v] += static_cast<double>(values[i]); });
    }
    std::vector<float> all(3 + columns.count());
    for (size_t g = 0; g < groups.groups.size(); g++)
    {
        const Group& group = groups.groups[g];
        for (size_t f = 0; f < columns.count(); f++)
            all[3 + f] = group.voxel == mp2p_icp::NO_NEIGHBOR
                             ? columns[f][group.first_point]
                             : static_cast<float>(sums[f][group.voxel] / group.count);
        out.setPointAllFieldsFast(g, all);
    }
}

CPointsMap::Ptr averages(const CPointsMap& points, const Groups& groups)
{
    const auto out = mp2p_icp::new_cloud_like(points);
    out->resize(groups.groups.size());
    average_fields(*out, points, groups);
    const mp2p_icp::PointView given(points), means(groups.voxels.means());
    for (size_t g = 0; g < groups.groups.size(); g++)
    {
        const bool is_mean = groups.groups[g].voxel != mp2p_icp::NO_NEIGHBOR;
        const mp2p_icp::PointView& from = is_mean ? means : given;
        const size_t i = is_mean ? groups.groups[g].voxel : groups.groups[g].first_point;
        out->setPointFast(g, from.x[i], from.y[i], from.z[i]);
    }
    out->mark_as_modified();
    return out;
}

std::vector<size_t> first_points(const Groups& groups)
{
    std::vector<size_t> picks;
    picks.reserve(groups.groups.size());
    for (const Group& g : groups.groups) picks.push_back(g.first_point);
    return picks;
}

/// The first points of all groups, but for voxels those that `pick_of_voxel` says.
std::vector<size_t> picks_of(const Groups& groups, const std::vector<size_t>& pick_of_voxel)
{
    std::vector<size_t> picks = first_points(groups);
    for (size_t g = 0; g < picks.size(); g++)
        if (const uint32_t v = groups.groups[g].voxel; v != mp2p_icp::NO_NEIGHBOR)
            picks[g] = pick_of_voxel[v];
    return picks;
}

std::vector<size_t> closest_to_average(const CPointsMap& points, const Groups& groups)
{
    const size_t n = groups.voxels.voxel_count();
    const mp2p_icp::PointView p(points);
    const auto at = [&](size_t i) { return mrpt::math::TPoint3D(p.x[i], p.y[i], p.z[i]); };
    std::vector<mrpt::math::TPoint3D> means(n);
    std::vector<double> best(n, std::numeric_limits<double>::infinity());
    std::vector<size_t> picks(n, 0);
    groups.for_points_in_voxels([&](size_t i, uint32_t v) { means[v] += at(i); });
    for (size_t v = 0; v < n; v++) means[v] *= 1.0 / groups.voxels.point_counts()[v];
    groups.for_points_in_voxels(
        [&](size_t i, uint32_t v)
        {
            if (const double d = (at(i) - means[v]).sqrNorm(); d < best[v]) best[v] = d, picks[v] = i;
        });
    return picks_of(groups, picks);
}

/// A seed from the seed of the filter and the cell alone, so that other cells have no influence.
uint64_t seed_of_cell(uint64_t seed, const std::optional<CellIndex>& cell)
{
    const CellIndex c = cell.value_or(CellIndex());
    for (const int64_t index : {c.x, c.y, c.z})
        seed = mp2p_icp::SeededRandom(seed ^ static_cast<uint64_t>(index))();
    return seed;
}

std::vector<size_t> random_points(const CPointsMap& points, const Groups& groups, double side, uint64_t seed)
{
    const size_t n = groups.voxels.voxel_count();
    const mp2p_icp::PointView p(points);
    std::vector<size_t> picks(n, 0), points_to_pass(n);
    for (const Group& g : groups.groups)
    {
        if (g.voxel == mp2p_icp::NO_NEIGHBOR) continue;
        const size_t i = g.first_point;
        points_to_pass[g.voxel] =
            mp2p_icp::SeededRandom(seed_of_cell(seed, cell_of(p.x[i], p.y[i], p.z[i], side))).index(g.count);
    }
    groups.for_points_in_voxels(
        [&](size_t i, uint32_t v)
        {
            if (points_to_pass[v]-- == 0) picks[v] = i;
        });
    return picks_of(groups, picks);
}

std::vector<size_t> picked_points(const CPointsMap& points, const Groups& groups, double side,
                                  DecimateMethod method, uint64_t seed)
{
    if (method == DecimateMethod::ClosestToAverage) return closest_to_average(points, groups);
    if (method == DecimateMethod::RandomPoint) return random_points(points, groups, side, seed);
    return first_points(groups);
}
}  // namespace

CPointsMap::Ptr decimate(const DecimationInput& input, double side, DecimateMethod method, uint64_t seed)
{
    const Groups groups = group_points(input, side);
    if (method == DecimateMethod::VoxelAverage) return averages(*input.points, groups);
    const auto out = mp2p_icp::new_cloud_like(*input.points);
    mp2p_icp::append_points(*out, *input.points, picked_points(*input.points, groups, side, method, seed));
    return out;
}

}  // namespace mp2p_icp_filters
