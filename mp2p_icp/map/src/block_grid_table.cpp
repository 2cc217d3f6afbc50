#include "block_grid_table.h"

#include <algorithm>
#include <array>

namespace mp2p_icp
{
namespace
{
constexpr size_t FIRST_SLOTS = 4096;
constexpr int CURVE_BITS = 21;  ///< per axis

/// Bit i of the result at 3 i.
uint64_t spread_bits(uint64_t v)
{
    v = (v | v << 32) & 0x001F00000000FFFFu;
    v = (v | v << 16) & 0x001F0000FF0000FFu;
    v = (v | v << 8) & 0x100F00F00F00F00Fu;
    v = (v | v << 4) & 0x10C30C30C30C30C3u;
    return (v | v << 2) & 0x1249249249249249u;
}

struct CurvePlace
{
    uint64_t key;
    uint32_t block;
};

/// The place of each block on the curve, which starts at the lowest corner of all blocks.
std::vector<CurvePlace> curve_places(const std::vector<BlockCoord>& blocks)
{
    BlockCoord low = blocks[0], high = blocks[0];
    for (const BlockCoord& b : blocks)
    {
        low = {std::min(low.x, b.x), std::min(low.y, b.y), std::min(low.z, b.z)};
        high = {std::max(high.x, b.x), std::max(high.y, b.y), std::max(high.z, b.z)};
    }
    const int64_t widest =
        std::max({int64_t(high.x) - low.x, int64_t(high.y) - low.y, int64_t(high.z) - low.z});
    int drop = 0;
    while (widest >> drop >> CURVE_BITS) drop++;
    const auto bits = [&](int32_t v, int32_t lowest)
    { return spread_bits(static_cast<uint64_t>(int64_t(v) - lowest) >> drop); };
    std::vector<CurvePlace> places(blocks.size());
    for (uint32_t n = 0; n < blocks.size(); n++)
        places[n] = {bits(blocks[n].x, low.x) | bits(blocks[n].y, low.y) << 1 | bits(blocks[n].z, low.z) << 2,
                     n};
    return places;
}

/// Stable, by key, byte after byte.
void sort_places(std::vector<CurvePlace>& places)
{
    uint64_t used_bits = 0;
    for (const auto& p : places) used_bits |= p.key;
    std::vector<CurvePlace> sorted(places.size());
    for (int shift = 0; shift < 64 && used_bits >> shift; shift += 8)
    {
        std::array<size_t, 257> start{};
        for (const auto& p : places) start[(p.key >> shift & 255) + 1]++;
        for (size_t d = 0; d < 256; d++) start[d + 1] += start[d];
        for (const auto& p : places) sorted[start[p.key >> shift & 255]++] = p;
        places.swap(sorted);
    }
}
}  // namespace

void BlockTable::clear()
{
    blocks_.clear();
    fill_slots(FIRST_SLOTS);
}

void BlockTable::fill_slots(size_t count)
{
    slots_.assign(count, NO_BLOCK);
    shift_ = 32;
    while (size_t(1) << (32 - shift_) < count) shift_--;
    for (uint32_t n = 0; n < blocks_.size(); n++) slots_[slot_of(blocks_[n])] = n;
}

uint32_t BlockTable::add(const BlockCoord& block)
{
    const auto number = static_cast<uint32_t>(blocks_.size());
    if (4 * (blocks_.size() + 1) > slots_.size()) fill_slots(2 * slots_.size());
    slots_[slot_of(block)] = number;
    blocks_.push_back(block);
    return number;
}

void BlockTable::sort_along_curve(std::vector<uint32_t>& new_numbers)
{
    new_numbers.resize(blocks_.size());
    if (blocks_.empty()) return;
    std::vector<CurvePlace> places = curve_places(blocks_);
    sort_places(places);
    const std::vector<BlockCoord> old = blocks_;
    for (uint32_t n = 0; n < blocks_.size(); n++)
    {
        new_numbers[places[n].block] = n;
        blocks_[n] = old[places[n].block];
    }
    for (uint32_t& number : slots_)
        if (number != NO_BLOCK) number = new_numbers[number];
}

}  // namespace mp2p_icp
