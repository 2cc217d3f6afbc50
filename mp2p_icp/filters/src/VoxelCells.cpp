#include "VoxelCells.h"

#include <cmath>

namespace mp2p_icp_filters
{
namespace
{
uint64_t hash_of(const CellIndex& c)
{
    uint64_t h = static_cast<uint64_t>(c.x) * 0x9E3779B97F4A7C15u;
    h = (h ^ (h >> 32)) + static_cast<uint64_t>(c.y) * 0xC2B2AE3D27D4EB4Fu;
    h = (h ^ (h >> 29)) + static_cast<uint64_t>(c.z) * 0x165667B19E3779F9u;
    h = (h ^ (h >> 32)) * 0xD6E8FEB86659FD93u;
    return h ^ (h >> 32);
}
}  // namespace

std::optional<CellIndex> cell_of(float x, float y, float z, double side)
{
    const double cx = std::floor(static_cast<double>(x) / side),
                 cy = std::floor(static_cast<double>(y) / side),
                 cz = std::floor(static_cast<double>(z) / side);
    constexpr double LIMIT = 0x1.0p62;
    if (!(std::abs(cx) < LIMIT && std::abs(cy) < LIMIT && std::abs(cz) < LIMIT)) return {};
    return CellIndex{static_cast<int64_t>(cx), static_cast<int64_t>(cy), static_cast<int64_t>(cz)};
}

VoxelCells::VoxelCells() : slots_(1024, NO_CELL) {}

size_t VoxelCells::slot_of(const CellIndex& cell) const
{
    const size_t mask = slots_.size() - 1;
    size_t slot = hash_of(cell) & mask;
    while (slots_[slot] != NO_CELL && !(cells_[slots_[slot]] == cell)) slot = (slot + 1) & mask;
    return slot;
}

void VoxelCells::grow()
{
    slots_.assign(slots_.size() * 2, NO_CELL);
    for (uint32_t n = 0; n < size(); n++) slots_[slot_of(cells_[n])] = n;
}

uint32_t VoxelCells::number_of(const CellIndex& cell)
{
    if (cells_.size() * 2 >= slots_.size()) grow();
    const size_t slot = slot_of(cell);
    if (slots_[slot] == NO_CELL)
    {
        slots_[slot] = size();
        cells_.push_back(cell);
    }
    return slots_[slot];
}

}  // namespace mp2p_icp_filters
