#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "block_grid_data.h"

namespace mp2p_icp
{
namespace
{
using Double2 = double __attribute__((vector_size(16)));
constexpr float INF = std::numeric_limits<float>::infinity();

template <class Work>
void for_chunks(size_t count, const Work& work)
{
    for (size_t first = 0; first < count; first += CELL_CHUNK)
        work(first, std::min(CELL_CHUNK, count - first));
}

/// Where in its block each cell is: x + 4 y + 16 z.
void find_cells_in_blocks(const ChunkCells& c, size_t count, uint8_t* cell_in_block)
{
    for (size_t k = 0; k < count; k++)
        cell_in_block[k] =
            static_cast<uint8_t>((c.cell[0][k] & 3) | (c.cell[1][k] & 3) << 2 | (c.cell[2][k] & 3) << 4);
}

/// The blocks of the points of a chunk.
struct ChunkBlocks
{
    int32_t x[CELL_CHUNK], y[CELL_CHUNK], z[CELL_CHUNK];
    uint32_t hash[CELL_CHUNK];
};

/// Finds the block of each point of a chunk, and marks its voxel there. \return how many have one
size_t find_blocks(const ChunkCells& c, size_t count, const uint8_t* cell_in_block, BlockTable& table,
                   std::vector<uint64_t>& masks, uint32_t* block_of_point)
{
    ChunkBlocks blocks;
    for (size_t k = 0; k < count; k++)
    {
        blocks.x[k] = c.cell[0][k] >> 2, blocks.y[k] = c.cell[1][k] >> 2, blocks.z[k] = c.cell[2][k] >> 2;
        blocks.hash[k] = BlockTable::hash_of(blocks.x[k], blocks.y[k], blocks.z[k]);
    }
    size_t left_out = 0;
    BlockTable::Finder finder(table);
    uint64_t* masks_now = masks.data();
    for (size_t k = 0; k < count; k++)
    {
        const BlockCoord coord{blocks.x[k], blocks.y[k], blocks.z[k]};
        uint32_t block = finder.find(coord, blocks.hash[k]);
        if (block == NO_BLOCK)
        {
            block_of_point[k] = NO_BLOCK;
            left_out += c.cell[0][k] == NO_CELL;
            if (c.cell[0][k] == NO_CELL) continue;
            block = table.add(coord), masks.push_back(0);
            finder = BlockTable::Finder(table), masks_now = masks.data();
        }
        block_of_point[k] = block;
        masks_now[block] |= uint64_t(1) << cell_in_block[k];
    }
    return count - left_out;
}

/// Finds the block of each point (into voxel_of_point, for now) and its cell there. A chunk at a time, in
/// steps that do one thing: several times faster than all of it point by point.
void assign_blocks(const PointView& points, BlockGridData& d)
{
    d.voxel_of_point.resize(points.size);
    d.scratch.cell_in_block.resize(points.size);
    d.scratch.masks.clear();
    const FarPoints far_points = d.has_voxels() ? FarPoints::Refuse : FarPoints::InOutermostCell;
    ChunkCells c;
    for_chunks(points.size,
               [&](size_t first, size_t count)
               {
                   uint8_t* const cells = &d.scratch.cell_in_block[first];
                   uint32_t* const blocks = &d.voxel_of_point[first];
                   find_cells(d.frame, points, first, count, far_points, c);
                   find_cells_in_blocks(c, count, cells);
                   d.skipped_points += count - find_blocks(c, count, cells, d.table, d.scratch.masks, blocks);
               });
}

/// Numbers the voxels: by block, in a block by cell.
void number_voxels(BlockGridData& d)
{
    const size_t blocks = d.table.size();
    d.voxel_masks.resize(blocks), d.first_voxel.resize(blocks + 1), d.orders.resize(blocks);
    for (size_t b = 0; b < blocks; b++) d.voxel_masks[d.scratch.new_numbers[b]] = d.scratch.masks[b];
    uint32_t voxel = 0;
    for (size_t b = 0; b < blocks; b++)
    {
        d.first_voxel[b] = voxel;
        uint8_t order = 0;
        for (uint64_t left = d.voxel_masks[b]; left; left &= left - 1)
            d.orders[b][static_cast<size_t>(__builtin_ctzll(left))] = order++;
        voxel += order;
    }
    d.first_voxel[blocks] = voxel;
}

/// Adds one point to the sums of its voxel.
template <size_t SUMS>
void add_point(double* sums, double x, double y, double z)
{
    const auto add = [sums](size_t k, const Double2& v)
    {
        Double2 sum;
        std::memcpy(&sum, sums + k, sizeof(sum));
        sum += v;
        std::memcpy(sums + k, &sum, sizeof(sum));
    };
    const Double2 yz{y, z};
    add(0, Double2{1, x}), add(2, yz);
    if (SUMS == SUMS_WITHOUT_MOMENTS) return;
    add(4, Double2{x, x} * Double2{x, y}), add(6, Double2{x, y} * Double2{z, y}), add(8, yz * Double2{z, z});
}

/// The voxel of each point, and the sums of each voxel.
template <size_t SUMS>
void sum_voxels(const PointView& points, BlockGridData& d)
{
    d.sums.assign(d.first_voxel.back() * SUMS, 0.0);
    // Copies, of which the compiler knows that nothing that is written changes them.
    const PointView p = points;
    double* const sums = d.sums.data();
    uint32_t* const voxel_of_point = d.voxel_of_point.data();
    const uint8_t* const cell_in_block = d.scratch.cell_in_block.data();
    const uint32_t* const new_numbers = d.scratch.new_numbers.data();
    const uint32_t* const first_voxel = d.first_voxel.data();
    const VoxelOrder* const orders = d.orders.data();
    const double middle[3] = {d.frame.middle(0), d.frame.middle(1), d.frame.middle(2)};
    for (size_t i = 0; i < p.size; i++)
    {
        const uint32_t at_first = voxel_of_point[i];
        if (at_first == NO_BLOCK) continue;  // and stays NO_NEIGHBOR
        const uint32_t block = new_numbers[at_first];
        const uint32_t voxel = first_voxel[block] + orders[block][cell_in_block[i]];
        voxel_of_point[i] = voxel;
        add_point<SUMS>(sums + voxel * SUMS, double(p.x[i]) - middle[0], double(p.y[i]) - middle[1],
                        double(p.z[i]) - middle[2]);
    }
}
static_assert(NO_BLOCK == NO_NEIGHBOR, "left out points keep it");

size_t sums_per_voxel(const BlockGridOptions& o)
{
    return o.moments ? SUMS_WITH_MOMENTS : SUMS_WITHOUT_MOMENTS;
}

void count_points(BlockGridData& d)
{
    const size_t stride = sums_per_voxel(d.options);
    d.point_counts.resize(d.first_voxel.back());
    for (size_t v = 0; v < d.point_counts.size(); v++)
        d.point_counts[v] = static_cast<uint32_t>(d.sums[v * stride]);
}

void compute_means(BlockGridData& d)
{
    const size_t stride = sums_per_voxel(d.options);
    d.means.resize(d.first_voxel.back());
    float* const mean[3] = {d.means.x.data(), d.means.y.data(), d.means.z.data()};
    for (size_t v = 0; v < d.means.size(); v++)
        for (int a = 0; a < 3; a++)
        {
            const double from_middle = d.sums[v * stride + 1 + static_cast<size_t>(a)] / d.sums[v * stride];
            mean[a][v] = static_cast<float>(from_middle + d.frame.middle(a));
        }
}

/// Room for `count(block)` elements in each block.
template <class Count>
void open_slots(BlockGridData& d, const Count& count)
{
    const size_t blocks = d.table.size();
    d.slots.first.resize(blocks + 1);
    uint32_t slot = 0;
    for (uint32_t b = 0; b < blocks; b++)
    {
        d.slots.first[b] = slot;
        slot += (count(b) + SLOT_GROUP - 1) / SLOT_GROUP * SLOT_GROUP;
    }
    d.slots.first[blocks] = slot;
    for (auto* v : {&d.slots.x, &d.slots.y, &d.slots.z}) v->resize(slot);
    d.slots.id.resize(slot);
    d.scratch.block_boxes.assign(blocks, ElementBox());
}

void fill_up(ElementSlots& slots, size_t first, size_t last)
{
    for (size_t s = first; s < last; s++)
    {
        slots.x[s] = slots.y[s] = slots.z[s] = INF;
        slots.id[s] = NO_NEIGHBOR;
    }
}

void put_element(BlockGridData& d, uint32_t block, size_t slot, const PointView& elements, uint32_t id)
{
    const float x = elements.x[id], y = elements.y[id], z = elements.z[id];
    d.slots.x[slot] = x, d.slots.y[slot] = y, d.slots.z[slot] = z;
    d.slots.id[slot] = id;
    d.scratch.block_boxes[block].add(x, y, z);
}

void put_means_into_slots(BlockGridData& d)
{
    open_slots(d, [&](uint32_t b) { return d.first_voxel[b + 1] - d.first_voxel[b]; });
    for (uint32_t b = 0; b < d.table.size(); b++)
    {
        size_t slot = d.slots.first[b];
        for (uint32_t v = d.first_voxel[b]; v < d.first_voxel[b + 1]; v++)
            put_element(d, b, slot++, d.means, v);
        fill_up(d.slots, slot, d.slots.first[b + 1]);
    }
}

/// voxel_of_point still holds the blocks, as numbered at first.
void put_points_into_slots(const PointView& points, BlockGridData& d)
{
    const size_t blocks = d.table.size();
    const auto& new_numbers = d.scratch.new_numbers;
    std::vector<uint32_t> counts(blocks, 0);
    for (const uint32_t b : d.voxel_of_point)
        if (b != NO_BLOCK) counts[new_numbers[b]]++;
    open_slots(d, [&](uint32_t b) { return counts[b]; });
    auto& next = d.scratch.next_slot;
    next.assign(d.slots.first.begin(), d.slots.first.end() - 1);
    for (uint32_t i = 0; i < points.size; i++)
        if (const uint32_t old = d.voxel_of_point[i]; old != NO_BLOCK)
            put_element(d, new_numbers[old], next[new_numbers[old]]++, points, i);
    for (uint32_t b = 0; b < blocks; b++) fill_up(d.slots, next[b], d.slots.first[b + 1]);
}

void sum_all_voxels(const PointView& points, BlockGridData& d)
{
    number_voxels(d);
    if (d.options.moments)
        sum_voxels<SUMS_WITH_MOMENTS>(points, d);
    else
        sum_voxels<SUMS_WITHOUT_MOMENTS>(points, d);
    count_points(d);
}
}  // namespace

void BlockGridData::clear()
{
    size = skipped_points = 0;
    table.clear();
    voxel_masks.clear(), first_voxel.assign(1, 0), orders.clear(), sums.clear();
    means.resize(0);
    point_counts.clear(), voxel_of_point.clear();
    for (auto* v : {&slots.x, &slots.y, &slots.z}) v->clear();
    slots.id.clear(), slots.first.assign(1, 0);
    boxes.build({});
}

void BlockGridData::build(const PointView& points, const BlockGridOptions& new_options)
{
    options = new_options;
    if (points.size >= MAX_POINTS)
        throw std::invalid_argument("BlockGrid: can hold fewer than 2^29 points, not " +
                                    std::to_string(points.size));
    frame = CellFrame(options.voxel_size, points);
    assign_blocks(points, *this);
    table.sort_along_curve(scratch.new_numbers);
    if (options.elements == GridElements::Points) put_points_into_slots(points, *this);
    if (has_voxels()) sum_all_voxels(points, *this);
    if (options.elements != GridElements::Points) compute_means(*this);
    if (options.elements == GridElements::VoxelMeans) put_means_into_slots(*this);
    if (options.elements == GridElements::None) open_slots(*this, [](uint32_t) { return 0u; });
    size = options.elements == GridElements::Points       ? points.size
           : options.elements == GridElements::VoxelMeans ? means.size()
                                                          : 0;
    if (!has_voxels()) voxel_of_point.clear();
    if (!options.moments) sums.clear();
    boxes.build(options.elements == GridElements::None ? std::vector<ElementBox>() : scratch.block_boxes);
}

}  // namespace mp2p_icp
