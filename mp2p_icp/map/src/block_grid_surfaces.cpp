#include <mp2p_icp/parallel.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>

#include "block_grid_data.h"
#include "block_grid_eigen.h"

namespace mp2p_icp
{
float VoxelSurface::curvature() const
{
    const float sum = eigenvalues[0] + eigenvalues[1] + eigenvalues[2];
    return sum > 0 ? eigenvalues[0] / sum : 0;
}

namespace
{
using VoxelSums = std::array<double, SUMS_WITH_MOMENTS>;

uint32_t count_bits(uint64_t v)
{
    v -= v >> 1 & 0x5555555555555555u;
    v = (v & 0x3333333333333333u) + (v >> 2 & 0x3333333333333333u);
    v = (v + (v >> 4)) & 0x0F0F0F0F0F0F0F0Fu;
    return static_cast<uint32_t>(v * 0x0101010101010101u >> 56);
}

/// The sums of the same points from a place that is (dx, dy, dz) further down.
VoxelSums moved_sums(const double* s, double dx, double dy, double dz)
{
    const double n = s[0];
    return {n,
            s[1] + n * dx,
            s[2] + n * dy,
            s[3] + n * dz,
            s[4] + dx * (2 * s[1] + n * dx),
            s[5] + dx * s[2] + dy * s[1] + n * dx * dy,
            s[6] + dx * s[3] + dz * s[1] + n * dx * dz,
            s[7] + dy * (2 * s[2] + n * dy),
            s[8] + dy * s[3] + dz * s[2] + n * dy * dz,
            s[9] + dz * (2 * s[3] + n * dz)};
}

/// Some cells of one of the 27 blocks around a block.
struct CellsOfBlock
{
    size_t block = 13;  ///< x + 3 y + 9 z of its steps, each 0 ... 2; 13 is the one in the middle
    uint64_t cells = 0;
};

/// Of each cell of a block: the 3x3x3 cells around it, by the up to eight blocks in which they are.
class CellsAround
{
 public:
    CellsAround()
    {
        for (int c = 0; c < 64; c++) set(c & 3, c >> 2 & 3, c >> 4, of_cell_[static_cast<size_t>(c)]);
    }
    const std::vector<CellsOfBlock>& of_cell(int cell) const { return of_cell_[static_cast<size_t>(cell)]; }

 private:
    static void set(int x, int y, int z, std::vector<CellsOfBlock>& out)
    {
        std::array<uint64_t, 27> cells{};
        for (int n = 0; n < 27; n++)
        {
            // Of the cell, counted from the lowest block around.
            const int at[3] = {x + 3 + n % 3, y + 3 + n / 3 % 3, z + 3 + n / 9};
            cells[static_cast<size_t>(at[0] / 4 + 3 * (at[1] / 4) + 9 * (at[2] / 4))] |=
                uint64_t(1) << (at[0] % 4 + 4 * (at[1] % 4) + 16 * (at[2] % 4));
        }
        for (size_t b = 0; b < 27; b++)
            if (cells[b]) out.push_back({b, cells[b]});
    }

    std::array<std::vector<CellsOfBlock>, 64> of_cell_;
};

/// A block, and those around it as far as they were asked for.
class BlockAmongOthers
{
 public:
    BlockAmongOthers(const BlockGridData& d, uint32_t block) : d_(d), own_(d.table[block])
    {
        others_.fill(NOT_ASKED);
        others_[13] = block;
    }

    /// Over the 3x3x3 voxels around a cell of the block, from the block's centre. \param voxels how many of
    /// them have points
    VoxelSums sum_around(int cell, uint32_t& voxels)
    {
        static const CellsAround around;
        voxels = 0;
        VoxelSums sum{};
        for (const CellsOfBlock& part : around.of_cell(cell))
        {
            const uint32_t block = other(part.block);
            if (block == NO_BLOCK) continue;
            const uint64_t wanted = d_.voxel_masks[block] & part.cells;
            if (!wanted) continue;
            voxels += count_bits(wanted);
            const VoxelSums there = sum_of(block, wanted);
            add(sum, (part.block == 13 ? there : moved(there, part.block)).data());
        }
        return sum;
    }

 private:
    static constexpr uint32_t NOT_ASKED = NO_BLOCK - 1;

    static std::array<int, 3> step_to(size_t n)
    {
        const int k = static_cast<int>(n);
        return {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
    }

    uint32_t other(size_t n)
    {
        if (others_[n] == NOT_ASKED)
        {
            const auto step = step_to(n);
            others_[n] = d_.table.find({own_.x + step[0], own_.y + step[1], own_.z + step[2]});
        }
        return others_[n];
    }

    static void add(VoxelSums& to, const double* from)
    {
        for (size_t k = 0; k < SUMS_WITH_MOMENTS; k++) to[k] += from[k];
    }

    /// From the centre of the block they are in.
    VoxelSums sum_of(uint32_t block, uint64_t cells) const
    {
        VoxelSums sum{};
        const uint64_t occupied = d_.voxel_masks[block];
        for (; cells; cells &= cells - 1)
        {
            const uint64_t below = (cells & -cells) - 1;
            const size_t voxel = d_.first_voxel[block] + count_bits(occupied & below);
            add(sum, &d_.sums[voxel * SUMS_WITH_MOMENTS]);
        }
        return sum;
    }

    static VoxelSums moved(const VoxelSums& sums, size_t n)
    {
        const auto step = step_to(n);
        return moved_sums(sums.data(), 4 * step[0], 4 * step[1], 4 * step[2]);
    }

    const BlockGridData& d_;
    BlockCoord own_;
    std::array<uint32_t, 27> others_;
};

/// Surfaces of consecutive voxels, a batch at a time.
class SurfaceWriter
{
 public:
    SurfaceWriter(VoxelSurface* out, double side, double min_spread)
        : out_(out), side_(side), side_sq_(side * side), min_spread_(min_spread * side * side)
    {
    }
    /// \param centre from which the sums count, in cells from zero
    void add(const VoxelSums& s, uint32_t voxels, const std::array<double, 3>& centre)
    {
        const double n = s[0], share = 1 / n, x = s[1] * share, y = s[2] * share, z = s[3] * share;
        const size_t i = batch_.size++;
        batch_.xx.set(i, s[4] * share - x * x), batch_.xy.set(i, s[5] * share - x * y);
        batch_.xz.set(i, s[6] * share - x * z), batch_.yy.set(i, s[7] * share - y * y);
        batch_.yz.set(i, s[8] * share - y * z), batch_.zz.set(i, s[9] * share - z * z);
        count_[i] = static_cast<uint32_t>(n), voxels_[i] = voxels;
        mean_[0][i] = centre[0] + x, mean_[1][i] = centre[1] + y, mean_[2][i] = centre[2] + z;
        if (batch_.size == BatchNumbers::MAX) flush();
    }
    void flush()
    {
        outer_eigenvectors(batch_, eigen_);
        for (size_t i = 0; i < batch_.size; i++) *out_++ = surface(i);
        batch_.size = 0;
    }

 private:
    VoxelSurface surface(size_t i) const
    {
        VoxelSurface s;
        s.count = count_[i], s.voxels = voxels_[i];
        double values[3];
        for (size_t v = 0; v < 3; v++)
        {
            values[v] = eigen_.values[v][i] * side_sq_;
            s.eigenvalues[v] = static_cast<float>(values[v]);
        }
        s.mean_x = static_cast<float>(mean_[0][i] * side_);
        s.mean_y = static_cast<float>(mean_[1][i] * side_);
        s.mean_z = static_cast<float>(mean_[2][i] * side_);
        s.dx = static_cast<float>(eigen_.direction[0][i]);
        s.dy = static_cast<float>(eigen_.direction[1][i]);
        s.dz = static_cast<float>(eigen_.direction[2][i]);
        if (s.count < 3 || !(values[1] >= min_spread_)) return s;
        s.nx = static_cast<float>(eigen_.normal[0][i]);
        s.ny = static_cast<float>(eigen_.normal[1][i]);
        s.nz = static_cast<float>(eigen_.normal[2][i]);
        return s;
    }

    VoxelSurface* out_;
    double side_, side_sq_, min_spread_;
    CovarianceBatch batch_;
    EigenBatch eigen_;
    std::array<uint32_t, BatchNumbers::MAX> count_, voxels_;
    std::array<std::array<double, BatchNumbers::MAX>, 3> mean_;  ///< cells from zero
};

/// Writes the surfaces of all voxels of the blocks first ... last - 1.
void write_surfaces(const BlockGridData& d, size_t first, size_t last, double min_spread, VoxelSurface* out)
{
    SurfaceWriter writer(out + d.first_voxel[first], d.frame.side, min_spread);
    for (size_t b = first; b < last; b++)
    {
        BlockAmongOthers block(d, static_cast<uint32_t>(b));
        const auto centre = block_centre(d.frame, d.table[static_cast<uint32_t>(b)]);
        for (uint64_t left = d.voxel_masks[b]; left; left &= left - 1)
        {
            uint32_t voxels = 0;
            const VoxelSums sums = block.sum_around(__builtin_ctzll(left), voxels);
            writer.add(sums, voxels, centre);
        }
    }
    writer.flush();
}

/// The first block whose first voxel is not below `voxel`.
size_t block_from(const BlockGridData& d, size_t voxel)
{
    return static_cast<size_t>(std::lower_bound(d.first_voxel.begin(), d.first_voxel.end() - 1, voxel) -
                               d.first_voxel.begin());
}

uint32_t block_of_voxel(const BlockGridData& d, uint32_t voxel)
{
    const auto after = std::upper_bound(d.first_voxel.begin(), d.first_voxel.end(), voxel);
    return static_cast<uint32_t>(after - d.first_voxel.begin() - 1);
}
}  // namespace

void BlockGrid::surfaces(std::vector<VoxelSurface>& out, double min_spread) const
{
    const BlockGridData& d = *data_;
    if (!d.options.moments)
        throw std::invalid_argument("BlockGrid::surfaces(): the grid was built without moments");
    out.resize(voxel_count());
    // Work is shared out by voxels: blocks are too few, and differ.
    parallel_for_blocks(voxel_count(),
                        [&](size_t first, size_t last)
                        {
                            const size_t b0 = block_from(d, first), b1 = block_from(d, last);
                            if (b0 < b1) write_surfaces(d, b0, b1, min_spread, out.data());
                        });
}

VoxelSurface BlockGrid::surface(uint32_t voxel, double min_spread) const
{
    const BlockGridData& d = *data_;
    if (!d.options.moments)
        throw std::invalid_argument("BlockGrid::surface(): the grid was built without moments");
    if (voxel >= voxel_count())
        throw std::invalid_argument("BlockGrid::surface(): there is no voxel " + std::to_string(voxel));
    const uint32_t b = block_of_voxel(d, voxel);
    uint64_t cells = d.voxel_masks[b];
    for (uint32_t before = d.first_voxel[b]; before < voxel; before++) cells &= cells - 1;
    VoxelSurface out;
    SurfaceWriter writer(&out, d.frame.side, min_spread);
    uint32_t voxels = 0;
    const VoxelSums sums = BlockAmongOthers(d, b).sum_around(__builtin_ctzll(cells), voxels);
    writer.add(sums, voxels, block_centre(d.frame, d.table[b]));
    writer.flush();
    return out;
}

}  // namespace mp2p_icp
