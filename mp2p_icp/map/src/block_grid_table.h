#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mp2p_icp
{
constexpr uint32_t NO_BLOCK = UINT32_MAX;

/// A block of 4x4x4 cells: the numbers of its cells, divided by four and rounded down.
struct BlockCoord
{
    int32_t x = 0, y = 0, z = 0;
    bool operator==(const BlockCoord& o) const { return ((x ^ o.x) | (y ^ o.y) | (z ^ o.z)) == 0; }
};

/** Numbers the occupied blocks. A hash table with open addressing, at most a quarter full, so that a search
 * ends at once nearly always, for blocks that are not there too.
 */
class BlockTable
{
 public:
    BlockTable() { clear(); }
    void clear();
    size_t size() const { return blocks_.size(); }
    const BlockCoord& operator[](uint32_t block) const { return blocks_[block]; }

    /// The number of the block; NO_BLOCK if it is not there.
    uint32_t find(const BlockCoord& block) const { return slots_[slot_of(block)].block; }

    /// The number of the block; the next free one if it was not there.
    uint32_t find_or_add(const BlockCoord& block)
    {
        const size_t slot = slot_of(block);
        return slots_[slot].block != NO_BLOCK ? slots_[slot].block : add(block, slot);
    }

    /** Renumbers the blocks along a Morton curve (those that differ only in bits that its 63 do not hold: in
     * the old order). \param old_numbers for each new number the old one
     */
    void sort_along_curve(std::vector<uint32_t>& old_numbers);

 private:
    struct Slot
    {
        BlockCoord coord = {INT32_MIN, INT32_MIN, INT32_MIN};
        uint32_t block = NO_BLOCK;
    };

    static uint64_t hash_of(const BlockCoord& b)
    {
        return static_cast<uint64_t>(b.x) * 0x9E3779B97F4A7C15u +
               static_cast<uint64_t>(b.y) * 0xC2B2AE3D27D4EB4Fu +
               static_cast<uint64_t>(b.z) * 0x165667B19E3779F9u;
    }
    /// The slot that holds the block, or the empty one where it belongs.
    size_t slot_of(const BlockCoord& block) const
    {
        const size_t mask = slots_.size() - 1;
        size_t slot = hash_of(block) >> shift_;
        while (!(slots_[slot].coord == block) && slots_[slot].block != NO_BLOCK) slot = (slot + 1) & mask;
        return slot;
    }
    uint32_t add(const BlockCoord& block, size_t slot);
    void fill_slots(size_t count);

    std::vector<BlockCoord> blocks_;
    std::vector<Slot> slots_;  ///< their number is a power of two
    int shift_ = 0;            ///< the upper bits of a hash are its slot
};

}  // namespace mp2p_icp
