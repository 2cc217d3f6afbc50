#include "voxel_decimation.h"

#include <mp2p_icp/block_grid.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/random.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "VoxelCells.h"

namespace mp2p_icp_filters
{
using mrpt::maps::CPointsMap;

namespace
{
constexpr uint32_t NO_GROUP = UINT32_MAX;

/// The points that one output point stands for: those of a voxel, or one that is kept.
struct Group
{
    size_t first_point = 0;
    uint32_t count = 1;
    uint32_t voxel = mp2p_icp::NO_NEIGHBOR;
};

/// Groups in the order of their first points, and the group of each point.
struct Groups
{
    std::vector<Group> groups;
    std::vector<uint32_t> group_of_point;  ///< NO_GROUP: not finite
    mp2p_icp::BlockGrid voxels;
};

/// The points of a cloud that are to be thinned, and where they come from.
struct Thinned
{
    mp2p_icp::PointArrays copies;  ///< only if not all of the cloud
    mp2p_icp::PointView points;
    std::vector<uint32_t> origin;  ///< index in the cloud of each point; empty: its own

    size_t origin_of(size_t i) const { return origin.empty() ? i : origin[i]; }
};

bool is_finite(const mp2p_icp::PointView& p, size_t i)
{
    return std::isfinite(p.x[i]) && std::isfinite(p.y[i]) && std::isfinite(p.z[i]);
}

/// Parts the points of the input; those that are kept become groups of their own.
Thinned points_to_thin(const DecimationInput& input, Groups& out)
{
    const mp2p_icp::PointView all(*input.points);
    Thinned thinned;
    thinned.points = all;
    if (input.kept_whole.empty()) return thinned;
    auto whole = input.kept_whole.begin();
    for (size_t i = 0; i < all.size; i++)
    {
        while (whole != input.kept_whole.end() && i >= whole->second) ++whole;
        const bool is_kept = whole != input.kept_whole.end() && i >= whole->first;
        if (is_kept && is_finite(all, i)) out.groups.push_back({i});
        if (is_kept) continue;
        thinned.copies.x.push_back(all.x[i]), thinned.copies.y.push_back(all.y[i]);
        thinned.copies.z.push_back(all.z[i]);
        thinned.origin.push_back(static_cast<uint32_t>(i));
    }
    thinned.points = thinned.copies;
    return thinned;
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
    options.voxel_size = side;
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
    const Thinned thinned = points_to_thin(input, out);
    out.voxels = voxels_of(thinned.points, side);
    const auto& voxel_of_point = out.voxels.voxel_of_point();
    const auto kept = static_cast<std::ptrdiff_t>(out.groups.size());
    for (size_t i = 0; i < voxel_of_point.size(); i++)
        if (const uint32_t v = voxel_of_point[i];
            v != mp2p_icp::NO_NEIGHBOR && out.voxels.first_points()[v] == i)
            out.groups.push_back({thinned.origin_of(i), out.voxels.point_counts()[v], v});
    std::inplace_merge(out.groups.begin(), out.groups.begin() + kept, out.groups.end(),
                       [](const Group& a, const Group& b) { return a.first_point < b.first_point; });

    std::vector<uint32_t> group_of_voxel(out.voxels.voxel_count());
    out.group_of_point.assign(input.points->size(), NO_GROUP);
    for (uint32_t g = 0; g < out.groups.size(); g++)
    {
        const Group& group = out.groups[g];
        if (group.voxel == mp2p_icp::NO_NEIGHBOR)
            out.group_of_point[group.first_point] = g;
        else
            group_of_voxel[group.voxel] = g;
    }
    for (size_t i = 0; i < voxel_of_point.size(); i++)
        if (voxel_of_point[i] != mp2p_icp::NO_NEIGHBOR)
            out.group_of_point[thinned.origin_of(i)] = group_of_voxel[voxel_of_point[i]];
    return out;
}

/// How many numbers a point of the cloud has, its coordinates among them.
size_t field_count(const CPointsMap& points)
{
    std::vector<float> values;
    if (points.size() > 0) points.getPointAllFieldsFast(0, values);
    return values.size();
}

/// Sums of all fields of the points of each group, in double: `fields` numbers per group.
std::vector<double> sum_fields(const CPointsMap& points, const Groups& groups, size_t fields)
{
    std::vector<double> sums(fields * groups.groups.size(), 0.0);
    std::vector<float> values;
    for (size_t i = 0; i < points.size(); i++)
    {
        const uint32_t group = groups.group_of_point[i];
        if (group == NO_GROUP) continue;
        points.getPointAllFieldsFast(i, values);
        for (size_t f = 0; f < fields; f++) sums[group * fields + f] += static_cast<double>(values[f]);
    }
    return sums;
}

CPointsMap::Ptr averages(const CPointsMap& points, const Groups& groups)
{
    const auto out = mp2p_icp::new_cloud_like(points);
    out->resize(groups.groups.size());
    const size_t fields = field_count(points);
    const bool has_more = fields > 3;
    const std::vector<double> sums = has_more ? sum_fields(points, groups, fields) : std::vector<double>();
    std::vector<float> values(fields);
    for (size_t g = 0; g < groups.groups.size(); g++)
    {
        const Group& group = groups.groups[g];
        if (has_more)
        {
            for (size_t f = 0; f < fields; f++)
                values[f] = static_cast<float>(sums[g * fields + f] / group.count);
            out->setPointAllFieldsFast(g, values);
        }
        float x = 0, y = 0, z = 0;
        points.getPointFast(group.first_point, x, y, z);
        if (group.voxel != mp2p_icp::NO_NEIGHBOR)
            x = groups.voxels.means().x[group.voxel], y = groups.voxels.means().y[group.voxel],
            z = groups.voxels.means().z[group.voxel];
        out->setPointFast(g, x, y, z);
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

std::vector<size_t> closest_to_average(const CPointsMap& points, const Groups& groups)
{
    const size_t n = groups.groups.size();
    std::vector<mrpt::math::TPoint3D> means(n);
    std::vector<double> best(n, std::numeric_limits<double>::infinity());
    std::vector<size_t> picks(n, 0);
    const auto each_point = [&](const auto& visit)
    {
        float x = 0, y = 0, z = 0;
        for (size_t i = 0; i < points.size(); i++)
        {
            const uint32_t group = groups.group_of_point[i];
            if (group == NO_GROUP) continue;
            points.getPointFast(i, x, y, z);
            visit(i, group, mrpt::math::TPoint3D(x, y, z));
        }
    };
    each_point([&](size_t, uint32_t g, const mrpt::math::TPoint3D& p) { means[g] += p; });
    for (size_t g = 0; g < n; g++) means[g] *= 1.0 / groups.groups[g].count;
    each_point(
        [&](size_t i, uint32_t g, const mrpt::math::TPoint3D& p)
        {
            if (const double d = (p - means[g]).sqrNorm(); d < best[g]) best[g] = d, picks[g] = i;
        });
    return picks;
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
    const size_t n = groups.groups.size();
    std::vector<size_t> picks(n, 0), points_to_pass(n);
    for (size_t g = 0; g < n; g++)
    {
        float x = 0, y = 0, z = 0;
        points.getPointFast(groups.groups[g].first_point, x, y, z);
        points_to_pass[g] =
            mp2p_icp::SeededRandom(seed_of_cell(seed, cell_of(x, y, z, side))).index(groups.groups[g].count);
    }
    for (size_t i = 0; i < groups.group_of_point.size(); i++)
    {
        const uint32_t group = groups.group_of_point[i];
        if (group == NO_GROUP) continue;
        if (points_to_pass[group]-- == 0) picks[group] = i;
    }
    return picks;
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
