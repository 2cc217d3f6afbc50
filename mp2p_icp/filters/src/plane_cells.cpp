#include "plane_cells.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mp2p_icp_filters
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace
{
/// The items 0..count-1 sorted by their cell, stable: where each cell starts, and the order.
void sort_by_cell(const std::vector<uint32_t>& cell_of_item, uint32_t cells, std::vector<uint32_t>& starts,
                  std::vector<uint32_t>& order)
{
    starts.assign(cells + 1, 0);
    for (const uint32_t c : cell_of_item) starts[c + 1]++;
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    order.resize(cell_of_item.size());
    std::vector<uint32_t> next(starts.begin(), starts.end() - 1);
    for (uint32_t i = 0; i < cell_of_item.size(); i++) order[next[cell_of_item[i]]++] = i;
}
}  // namespace

BlockedPoints::BlockedPoints(const mrpt::maps::CPointsMap& cloud, double block_side)
{
    VoxelCells numbers;
    std::vector<uint32_t> kept, cell_of_kept;
    const auto &xs = cloud.getPointsBufferRef_x(), &ys = cloud.getPointsBufferRef_y(),
               &zs = cloud.getPointsBufferRef_z();
    for (uint32_t i = 0; i < cloud.size(); i++)
        if (const auto cell = cell_of(xs[i], ys[i], zs[i], block_side))
        {
            kept.push_back(i);
            cell_of_kept.push_back(numbers.number_of(*cell));
        }
    std::vector<uint32_t> starts, order;
    sort_by_cell(cell_of_kept, numbers.size(), starts, order);
    for (const uint32_t k : order)
    {
        ids.push_back(kept[k]);
        points.emplace_back(double(xs[kept[k]]), double(ys[kept[k]]), double(zs[kept[k]]));
    }
    for (uint32_t b = 0; b < numbers.size(); b++)
    {
        Vector3d lo = points[starts[b]], hi = lo;
        for (uint32_t i = starts[b]; i < starts[b + 1]; i++)
            lo = lo.cwiseMin(points[i]), hi = hi.cwiseMax(points[i]);
        blocks.push_back({starts[b], starts[b + 1], (lo + hi) / 2, (hi - lo) / 2});
    }
}

void PointMoments::add(const PointMoments& other)
{
    if (other.count == 0) return;
    const double total = count + other.count;
    const Vector3d between = other.mean - mean;
    scatter += other.scatter + between * between.transpose() * (count * other.count / total);
    mean += between * (other.count / total);
    count = total;
}

PointMoments moments_of(const std::vector<Vector3d>& points, const uint32_t* first, const uint32_t* last)
{
    PointMoments m;
    m.count = static_cast<double>(last - first);
    if (first == last) return m;
    for (auto i = first; i != last; ++i) m.mean += points[*i];
    m.mean /= m.count;
    for (auto i = first; i != last; ++i)
    {
        const Vector3d d = points[*i] - m.mean;
        m.scatter += d * d.transpose();
    }
    return m;
}

MomentPlane plane_through(const PointMoments& moments)
{
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(moments.scatter);
    const auto deviation = [&](int i, double divisor)
    { return std::sqrt(std::max(0.0, eigen.eigenvalues()(i)) / std::max(1.0, divisor)); };
    MomentPlane plane;
    plane.centre = moments.mean;
    plane.normal = eigen.eigenvectors().col(0).normalized();
    plane.sigma = deviation(0, moments.count - 3);
    plane.spread_1 = deviation(1, moments.count);
    plane.spread_2 = deviation(2, moments.count);
    return plane;
}

namespace
{
constexpr double LEAST_POINTS_IN_CELL = 6;  // three fit any plane; as many again say whether it is one

bool is_flat(const PlaneCell& cell, double side, const PlaneParameters& parameters)
{
    const MomentPlane& p = cell.plane;
    return cell.moments.count >= LEAST_POINTS_IN_CELL && p.sigma <= parameters.maximum_noise &&
           p.spread_1 >= 2.5 * p.sigma &&     // else a string of points, or a ball
           p.spread_1 >= 0.1 * p.spread_2 &&  // nor a string without noise
           p.spread_1 >= 0.05 * side;
}
}  // namespace

CellLevel::CellLevel(const BlockedPoints& all, const std::vector<uint32_t>& which, double side,
                     const PlaneParameters& parameters)
    : side_(side)
{
    std::vector<uint32_t> cell_of_item(which.size());
    for (size_t i = 0; i < which.size(); i++)
    {
        const Eigen::Vector3f p = all.points[which[i]].cast<float>();
        // The larger cells of BlockedPoints could be numbered; where these cannot, all land in one.
        cell_of_item[i] = numbers_.number_of(cell_of(p.x(), p.y(), p.z(), side).value_or(CellIndex{}));
    }
    sort_by_cell(cell_of_item, numbers_.size(), starts_, order_);
    for (auto& i : order_) i = which[i];
    cells_.resize(numbers_.size());
    for (uint32_t c = 0; c < cells_.size(); c++)
    {
        cells_[c].moments = moments_of(all.points, first_point(c), last_point(c));
        if (cells_[c].moments.count < LEAST_POINTS_IN_CELL) continue;
        cells_[c].plane = plane_through(cells_[c].moments);
        cells_[c].flat = is_flat(cells_[c], side, parameters);
    }
}

void CellLevel::neighbours(uint32_t cell, std::vector<uint32_t>& out) const
{
    out.clear();
    const CellIndex& c = numbers_.cell(cell);
    for (int64_t dx = -1; dx <= 1; dx++)
        for (int64_t dy = -1; dy <= 1; dy++)
            for (int64_t dz = -1; dz <= 1; dz++)
            {
                if (dx == 0 && dy == 0 && dz == 0) continue;
                const uint32_t n = numbers_.find({c.x + dx, c.y + dy, c.z + dz});
                if (n != NO_CELL) out.push_back(n);
            }
}

}  // namespace mp2p_icp_filters
