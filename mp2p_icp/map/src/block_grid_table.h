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

    /// In 32 bits, which vector instructions do for several blocks at a time; and with few multiplications,
    /// which take them most. Blocks that differ by 2^16 on x or y may always have the same one.
    static uint32_t hash_of(int32_t x, int32_t y, int32_t z)
    {
        const uint32_t packed = static_cast<uint32_t>(x) + (static_cast<uint32_t>(y) << 16);
        return packed * 0x9E3779B1u + static_cast<uint32_t>(z) * 0x85EBCA77u;
    }

    /// Finds, until something is added. A copy of what that needs: compilers keep it in registers.
    class Finder
    {
     public:
        explicit Finder(const BlockTable& table)
            : slots_(table.slots_.data()),
              blocks_(table.blocks_.data()),
              mask_(static_cast<uint32_t>(table.slots_.size() - 1)),
              shift_(table.shift_)
        {
        }
        /// The slot that holds the block, or the empty one where it belongs.
        uint32_t slot_of(const BlockCoord& block, uint32_t hash) const
        {
            uint32_t slot = hash >> shift_;
            while (slots_[slot] != NO_BLOCK && !(blocks_[slots_[slot]] == block)) slot = (slot + 1) & mask_;
            return slot;
        }
        /// The number of the block; NO_BLOCK if it is not there.
        uint32_t find(const BlockCoord& block, uint32_t hash) const { return slots_[slot_of(block, hash)]; }

     private:
        const uint32_t* slots_;
        const BlockCoord* blocks_;
        uint32_t mask_;
        int shift_;
    };

    /// The number of the block; NO_BLOCK if it is not there.
    uint32_t find(const BlockCoord& block) const { return slots_[slot_of(block)]; }

    /// Adds a block that is not there. \return its number, the next free one
    uint32_t add(const BlockCoord& block);

    /** Renumbers the blocks along a Morton curve (those that differ only in bits that its 63 do not hold: in
     * the old order). \param new_numbers for each old number the new one
     */
    void sort_along_curve(std::vector<uint32_t>& new_numbers);

 private:
    uint32_t slot_of(const BlockCoord& block) const
    {
        return Finder(*this).slot_of(block, hash_of(block.x, block.y, block.z));
    }
    void fill_slots(size_t count);

    std::vector<BlockCoord> blocks_;
    /// Their number is a power of two. Only numbers: so they stay in the first-level cache.
    std::vector<uint32_t> slots_;
    int shift_ = 0;  ///< the upper bits of a hash are its slot
};

}  // namespace mp2p_icp
