#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace mp2p_icp_filters
{
constexpr uint32_t NO_CELL = UINT32_MAX;

/// The cell [x,x+1) * [y,y+1) * [z,z+1), times the side of the cells.
struct CellIndex
{
    int64_t x = 0, y = 0, z = 0;
    bool operator==(const CellIndex& o) const { return x == o.x && y == o.y && z == o.z; }
};

/** The cell of a point: coordinates divided by the side and rounded down, so that cells around the origin are
 * as wide as any other. Empty if an index does not fit in 63 bits (or the point is not finite).
 */
std::optional<CellIndex> cell_of(float x, float y, float z, double side);

/** Numbers cells 0, 1, 2... in the order in which they are first seen. A hash table with open addressing, in
 * 4 bytes per slot (std::unordered_map allocates a node per cell, which takes most of the time of a
 * decimation).
 */
class VoxelCells
{
 public:
    VoxelCells();
    /// The number of the cell, a new one if it was not seen before. O(1) on average.
    uint32_t number_of(const CellIndex& cell);
    /// The number of the cell, NO_CELL if it was not seen. O(1) on average.
    uint32_t find(const CellIndex& cell) const { return slots_[slot_of(cell)]; }
    uint32_t size() const { return static_cast<uint32_t>(cells_.size()); }
    const CellIndex& cell(uint32_t number) const { return cells_[number]; }

 private:
    /// The slot that holds the cell, or the empty one where it belongs.
    size_t slot_of(const CellIndex& cell) const;
    void grow();

    std::vector<CellIndex> cells_;
    std::vector<uint32_t>
        slots_;  ///< numbers of cells, or NO_CELL; the length is a power of two, at most half of them in use
};

}  // namespace mp2p_icp_filters
