#pragma once

#include <mp2p_icp/block_grid.h>

#include <array>

#include "block_grid_boxes.h"
#include "block_grid_cells.h"
#include "block_grid_table.h"

namespace mp2p_icp
{
/// Slots are scanned so many at a time; each block has a multiple of it.
constexpr uint32_t SLOT_GROUP = 4;

/// Numbers of slots are int32_t.
constexpr size_t MAX_POINTS = (size_t(1) << 31) / SLOT_GROUP;

/// Elements in the order of the blocks, within a block by increasing index. Groups are filled up with
/// infinite coordinates, which are nearest to nothing.
struct ElementSlots
{
    std::vector<float> x, y, z;
    std::vector<uint32_t> id;
    std::vector<uint32_t> first;  ///< of each block, and the end
};

/** Sums over the points of a voxel, in metres from the middle of the frame: number, x, y, z, and with moments
 * xx, xy, xz, yy, yz, zz. Far from the middle, too, a covariance loses less by them than by the rounding of
 * the points, which are float: 2^-53 x^2 against (2^-24 x)^2 / 12.
 */
constexpr size_t SUMS_WITHOUT_MOMENTS = 4, SUMS_WITH_MOMENTS = 10;

/// Of the occupied cells of a block, by cell (x + 4 y + 16 z), which voxel of the block each is.
using VoxelOrder = std::array<uint8_t, 64>;

/// What rebuild() needs meanwhile; kept for the next time.
struct BuildScratch
{
    std::vector<uint8_t> cell_in_block;  ///< of each point
    std::vector<uint64_t> masks;         ///< of each block, as numbered at first
    std::vector<uint32_t> new_numbers;   ///< of each block, as numbered at first
    std::vector<uint32_t> next_slot;
    std::vector<ElementBox> block_boxes;
};

struct BlockGridData
{
    BlockGridOptions options;
    size_t size = 0, skipped_points = 0;
    CellFrame frame;
    BlockTable table;

    std::vector<uint64_t> voxel_masks;  ///< of each block: its occupied cells
    std::vector<uint32_t> first_voxel;  ///< of each block, and the end
    std::vector<VoxelOrder> orders;     ///< of each block
    std::vector<double> sums;           ///< of each voxel
    PointArrays means;                  ///< of each voxel, as is the next one
    std::vector<uint32_t> point_counts;
    std::vector<uint32_t> voxel_of_point;

    ElementSlots slots;
    BoxTree boxes;

    BuildScratch scratch;

    bool has_voxels() const { return options.elements != GridElements::Points || options.moments; }
    void clear();
    void build(const PointView& points, const BlockGridOptions& new_options);
};

}  // namespace mp2p_icp
