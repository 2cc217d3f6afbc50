#include "voxel_decimation.h"

#include <mp2p_icp/numbers.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/random.h>

#include "VoxelCells.h"

namespace mp2p_icp_filters
{
using mrpt::maps::CPointsMap;

namespace
{
constexpr uint32_t NO_GROUP = UINT32_MAX;

/// The points that one output point stands for.
struct Group
{
    size_t first_point = 0;
    uint32_t count = 0;
    CellIndex cell;
};

/// Groups in the order of their first points, and the group of each point.
struct Groups
{
    std::vector<Group> groups;
    std::vector<uint32_t> group_of_point;  ///< NO_GROUP: not finite

    uint32_t add_group(size_t first_point, const CellIndex& cell)
    {
        groups.push_back({first_point, 0, cell});
        return static_cast<uint32_t>(groups.size() - 1);
    }
};

CellIndex checked_cell(const CPointsMap& points, size_t i, double side)
{
    float x = 0, y = 0, z = 0;
    points.getPointFast(i, x, y, z);
    if (const auto cell = cell_of(x, y, z, side)) return *cell;
    throw std::invalid_argument("FilterDecimateVoxels: point " + std::to_string(i) + " of the input, at (" +
                                mp2p_icp::to_text(x) + ", " + mp2p_icp::to_text(y) + ", " +
                                mp2p_icp::to_text(z) + "), is too far away for cells of " +
                                mp2p_icp::to_text(side) + " m");
}

Groups group_points(const DecimationInput& input, double side)
{
    const CPointsMap& points = *input.points;
    Groups result;
    result.group_of_point.assign(points.size(), NO_GROUP);
    VoxelCells cells;
    std::vector<uint32_t> group_of_cell;
    auto whole = input.kept_whole.begin();
    for (size_t i = 0; i < points.size(); i++)
    {
        while (whole != input.kept_whole.end() && i >= whole->second) ++whole;
        const bool is_kept = whole != input.kept_whole.end() && i >= whole->first;
        if (!mp2p_icp::is_finite_point(points, i)) continue;
        const CellIndex cell = is_kept ? CellIndex() : checked_cell(points, i, side);
        uint32_t group = NO_GROUP;
        if (!is_kept)
        {
            const uint32_t number = cells.number_of(cell);
            if (number == group_of_cell.size()) group_of_cell.push_back(NO_GROUP);
            group = group_of_cell[number];
            if (group == NO_GROUP) group = group_of_cell[number] = result.add_group(i, cell);
        }
        else
            group = result.add_group(i, cell);
        result.groups[group].count++;
        result.group_of_point[i] = group;
    }
    return result;
}

/// Sums of all fields of the points of each group, in double.
struct FieldSums
{
    size_t fields = 0;
    std::vector<double> sums;  ///< `fields` numbers per group
};

FieldSums sum_fields(const CPointsMap& points, const Groups& groups)
{
    FieldSums out;
    std::vector<float> values;
    for (size_t i = 0; i < points.size(); i++)
    {
        const uint32_t group = groups.group_of_point[i];
        if (group == NO_GROUP) continue;
        points.getPointAllFieldsFast(i, values);
        if (out.sums.empty())
        {
            out.fields = values.size();
            out.sums.assign(out.fields * groups.groups.size(), 0.0);
        }
        for (size_t f = 0; f < out.fields; f++)
            out.sums[group * out.fields + f] += static_cast<double>(values[f]);
    }
    return out;
}

CPointsMap::Ptr averages(const CPointsMap& points, const Groups& groups)
{
    const auto out = mp2p_icp::new_cloud_like(points);
    out->resize(groups.groups.size());
    const FieldSums all = sum_fields(points, groups);
    std::vector<float> values(all.fields);
    for (size_t g = 0; g < groups.groups.size(); g++)
    {
        for (size_t f = 0; f < all.fields; f++)
            values[f] = static_cast<float>(all.sums[g * all.fields + f] / groups.groups[g].count);
        out->setPointAllFieldsFast(g, values);
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
uint64_t seed_of_cell(uint64_t seed, const CellIndex& cell)
{
    for (const int64_t index : {cell.x, cell.y, cell.z})
        seed = mp2p_icp::SeededRandom(seed ^ static_cast<uint64_t>(index))();
    return seed;
}

std::vector<size_t> random_points(const Groups& groups, uint64_t seed)
{
    const size_t n = groups.groups.size();
    std::vector<size_t> picks(n, 0), points_to_pass(n);
    for (size_t g = 0; g < n; g++)
        points_to_pass[g] =
            mp2p_icp::SeededRandom(seed_of_cell(seed, groups.groups[g].cell)).index(groups.groups[g].count);
    for (size_t i = 0; i < groups.group_of_point.size(); i++)
    {
        const uint32_t group = groups.group_of_point[i];
        if (group == NO_GROUP) continue;
        if (points_to_pass[group]-- == 0) picks[group] = i;
    }
    return picks;
}

std::vector<size_t> picked_points(const CPointsMap& points, const Groups& groups, DecimateMethod method,
                                  uint64_t seed)
{
    if (method == DecimateMethod::ClosestToAverage) return closest_to_average(points, groups);
    if (method == DecimateMethod::RandomPoint) return random_points(groups, seed);
    return first_points(groups);
}
}  // namespace

CPointsMap::Ptr decimate(const DecimationInput& input, double side, DecimateMethod method, uint64_t seed)
{
    const Groups groups = group_points(input, side);
    if (method == DecimateMethod::VoxelAverage) return averages(*input.points, groups);
    const auto out = mp2p_icp::new_cloud_like(*input.points);
    mp2p_icp::append_points(*out, *input.points, picked_points(*input.points, groups, method, seed));
    return out;
}

}  // namespace mp2p_icp_filters
