#include <mp2p_icp/block_grid.h>
#include <mp2p_icp/nn_index.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "finite_box.h"

namespace mp2p_icp
{
namespace
{
/// How many points of one block a search may look at, on average: what is aimed at, what is good enough, and
/// where a tree is better.
constexpr double AIM = 16, FEWEST = 6, MOST = 40, TOO_MANY = 100;

class BlockGridIndex : public NearestNeighborIndex
{
 public:
    BlockGridIndex(const mrpt::maps::CPointsMap::ConstPtr& points, BlockGrid grid)
        : points_(points), grid_(std::move(grid)), box_(grid_.bounding_box())
    {
    }

    size_t size() const override { return points_->size(); }
    std::optional<mrpt::math::TBoundingBoxf> bounding_box() const override { return box_; }

    void nearest(const PointArrays& queries, size_t first, size_t last, uint32_t k, const float* max_dist_sq,
                 uint32_t* ids, float* dist_sq) const override
    {
        if (k == 0) return;
        for (size_t i = first; k == 1 && i < last; i++)
        {
            const GridNeighbor found =
                grid_.nearest(queries.x[i], queries.y[i], queries.z[i], max_dist_sq[i]);
            ids[i] = found.id, dist_sq[i] = found.dist_sq;
        }
        for (size_t i = first; k > 1 && i < last; i++)
        {
            const uint32_t found = grid_.nearest_k(queries.x[i], queries.y[i], queries.z[i], max_dist_sq[i],
                                                   k, ids + i * k, dist_sq + i * k);
            std::fill(ids + i * k + found, ids + (i + 1) * k, NO_NEIGHBOR);
            std::fill(dist_sq + i * k + found, dist_sq + (i + 1) * k, std::numeric_limits<float>::infinity());
        }
    }

    void nearest_and_bound(const PointArrays& queries, size_t first, size_t last, const float* max_dist_sq,
                           uint32_t* ids, float* dist_sq, float* others) const override
    {
        for (size_t i = first; i < last; i++)
        {
            const BoundedNeighbor found =
                grid_.nearest_and_bound(queries.x[i], queries.y[i], queries.z[i], max_dist_sq[i]);
            ids[i] = found.id, dist_sq[i] = found.dist_sq, others[i] = found.others;
        }
    }

 private:
    mrpt::maps::CPointsMap::ConstPtr points_;
    BlockGrid grid_;
    std::optional<mrpt::math::TBoundingBoxf> box_;
};

/// The side of a block with AIM points if they were spread evenly over a surface as large as the box, or over
/// its longest side if that is all there is. 0 if they coincide.
double first_block_side(const mrpt::math::TBoundingBoxf& box, size_t count)
{
    std::array<double, 3> e = {double(box.max.x) - double(box.min.x), double(box.max.y) - double(box.min.y),
                               double(box.max.z) - double(box.min.z)};
    std::sort(e.begin(), e.end());
    const double n = static_cast<double>(count);
    return std::max(std::sqrt(AIM * e[2] * e[1] / n), AIM * e[2] / n);
}

BlockGridOptions blocks_of(double side)
{
    BlockGridOptions options;
    options.elements = GridElements::Points, options.voxel_size = side / 4;
    return options;
}
}  // namespace

NearestNeighborIndex::ConstPtr make_block_grid_index(const mrpt::maps::CPointsMap::ConstPtr& points)
{
    const auto box = box_of_finite_points(*points);
    BlockGrid grid;
    if (!box) return std::make_shared<BlockGridIndex>(points, std::move(grid));
    double side = first_block_side(*box, points->size());
    if (!(side > 0)) return nullptr;
    for (int attempt = 0; attempt < 3; attempt++)
    {
        grid.rebuild(*points, blocks_of(side));
        const double companions = grid.mean_companions();
        if (companions >= FEWEST && companions <= MOST) break;
        side *= std::clamp(std::sqrt(AIM / companions), 0.1, 10.0);
    }
    if (grid.mean_companions() > TOO_MANY) return nullptr;
    return std::make_shared<BlockGridIndex>(points, BlockGrid(std::move(grid)));
}

NearestNeighborIndex::ConstPtr make_nn_index(const mrpt::maps::CPointsMap::ConstPtr& points,
                                             uint32_t leaf_max_points)
{
    const auto grid = leaf_max_points == 0 ? make_block_grid_index(points) : nullptr;
    return grid ? grid : make_kdtree_index(points, leaf_max_points);
}

}  // namespace mp2p_icp
