#include <mp2p_icp/block_grid.h>

#include "block_grid_data.h"

namespace mp2p_icp
{
BlockGrid::BlockGrid() : data_(std::make_unique<BlockGridData>())
{
    data_->clear();
}

BlockGrid::BlockGrid(const PointView& points, const BlockGridOptions& options) : BlockGrid()
{
    rebuild(points, options);
    data_->scratch = BuildScratch();
}

BlockGrid::~BlockGrid() = default;
BlockGrid::BlockGrid(BlockGrid&&) noexcept = default;
BlockGrid& BlockGrid::operator=(BlockGrid&&) noexcept = default;

void BlockGrid::rebuild(const PointView& points, const BlockGridOptions& options)
{
    data_->clear();
    try
    {
        data_->build(points, options);
    }
    catch (...)
    {
        data_->clear();
        throw;
    }
}

SurfacesOfVoxels voxel_surfaces(const PointView& points, double side)
{
    BlockGridOptions options;
    options.voxel_size = side, options.elements = GridElements::None, options.moments = true;
    const BlockGrid grid(points, options);
    SurfacesOfVoxels out;
    out.voxel_of_point = grid.voxel_of_point();
    grid.surfaces(out.of_voxel);
    return out;
}

const BlockGridOptions& BlockGrid::options() const
{
    return data_->options;
}
size_t BlockGrid::size() const
{
    return data_->size;
}
size_t BlockGrid::skipped_points() const
{
    return data_->skipped_points;
}
size_t BlockGrid::block_count() const
{
    return data_->table.size();
}

double BlockGrid::mean_companions() const
{
    double sum = 0, squares = 0;
    const auto& first = data_->slots.first;
    for (size_t b = 0; b + 1 < first.size(); b++)
    {
        const double count = first[b + 1] - first[b];  // with what fills up the last group
        sum += count, squares += count * count;
    }
    return sum > 0 ? squares / sum : 0;
}

std::optional<mrpt::math::TBoundingBoxf> BlockGrid::bounding_box() const
{
    if (data_->boxes.empty()) return {};
    const ElementBox& b = data_->boxes.root();
    return mrpt::math::TBoundingBoxf({b.low[0], b.low[1], b.low[2]}, {b.high[0], b.high[1], b.high[2]});
}

const PointArrays& BlockGrid::means() const
{
    return data_->means;
}
size_t BlockGrid::voxel_count() const
{
    return data_->point_counts.size();
}
const std::vector<uint32_t>& BlockGrid::point_counts() const
{
    return data_->point_counts;
}
const std::vector<uint32_t>& BlockGrid::voxel_of_point() const
{
    return data_->voxel_of_point;
}

}  // namespace mp2p_icp
