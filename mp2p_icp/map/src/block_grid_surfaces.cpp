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

    /// Over the 3x3x3 voxels around a cell of the block. \param voxels how many of them have points
    VoxelSums sum_around(int cell, uint32_t& voxels)
    {
        static const CellsAround around;
        voxels = 0;
        VoxelSums sum{};
        for (const CellsOfBlock& part : around.of_cell(cell))
        {
            const uint32_t block = other(part.block);
            if (block == NO_BLOCK) continue;
            voxels += add_all(block, d_.voxel_masks[block] & part.cells, sum);
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
        static_assert(SUMS_WITH_MOMENTS % 2 == 0, "two at a time");
        for (size_t k = 0; k < SUMS_WITH_MOMENTS; k += 2)
        {
            Double2 sum, more;
            std::memcpy(&sum, &to[k], sizeof(sum)), std::memcpy(&more, from + k, sizeof(more));
            sum += more;
            std::memcpy(&to[k], &sum, sizeof(sum));
        }
    }

    /// \return how many
    uint32_t add_all(uint32_t block, uint64_t cells, VoxelSums& to) const
    {
        uint32_t count = 0;
        const VoxelOrder& order = d_.orders[block];
        const double* const sums = &d_.sums[d_.first_voxel[block] * SUMS_WITH_MOMENTS];
        for (; cells; cells &= cells - 1, count++)
            add(to, sums + order[static_cast<size_t>(__builtin_ctzll(cells))] * SUMS_WITH_MOMENTS);
        return count;
    }

    const BlockGridData& d_;
    BlockCoord own_;
    std::array<uint32_t, 27> others_;
};

/// Surfaces of consecutive voxels, a batch at a time.
class SurfaceWriter
{
 public:
    SurfaceWriter(VoxelSurface* out, const CellFrame& frame, double min_spread)
        : out_(out),
          middle_{frame.middle(0), frame.middle(1), frame.middle(2)},
          min_spread_(min_spread * frame.side * frame.side)
    {
    }
    void add(const VoxelSums& s, uint32_t voxels)
    {
        const double n = s[0], share = 1 / n, x = s[1] * share, y = s[2] * share, z = s[3] * share;
        const size_t i = batch_.size++;
        batch_.xx.set(i, s[4] * share - x * x), batch_.xy.set(i, s[5] * share - x * y);
        batch_.xz.set(i, s[6] * share - x * z), batch_.yy.set(i, s[7] * share - y * y);
        batch_.yz.set(i, s[8] * share - y * z), batch_.zz.set(i, s[9] * share - z * z);
        count_[i] = static_cast<uint32_t>(n), voxels_[i] = voxels;
        mean_[0][i] = middle_[0] + x, mean_[1][i] = middle_[1] + y, mean_[2][i] = middle_[2] + z;
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
        for (size_t v = 0; v < 3; v++) s.eigenvalues[v] = static_cast<float>(eigen_.values[v][i]);
        s.mean_x = static_cast<float>(mean_[0][i]);
        s.mean_y = static_cast<float>(mean_[1][i]);
        s.mean_z = static_cast<float>(mean_[2][i]);
        s.dx = static_cast<float>(eigen_.direction[0][i]);
        s.dy = static_cast<float>(eigen_.direction[1][i]);
        s.dz = static_cast<float>(eigen_.direction[2][i]);
        if (s.count < 3 || !(eigen_.values[1][i] >= min_spread_)) return s;
        s.nx = static_cast<float>(eigen_.normal[0][i]);
        s.ny = static_cast<float>(eigen_.normal[1][i]);
        s.nz = static_cast<float>(eigen_.normal[2][i]);
        return s;
    }

    VoxelSurface* out_;
    std::array<double, 3> middle_;  ///< from which sums count, m
    double min_spread_;             ///< m^2
    CovarianceBatch batch_;
    EigenBatch eigen_;
    std::array<uint32_t, BatchNumbers::MAX> count_, voxels_;
    std::array<std::array<double, BatchNumbers::MAX>, 3> mean_;  ///< m
};

/// Writes the surfaces of all voxels of the blocks first ... last - 1.
void write_surfaces(const BlockGridData& d, size_t first, size_t last, double min_spread, VoxelSurface* out)
{
    SurfaceWriter writer(out + d.first_voxel[first], d.frame, min_spread);
    for (size_t b = first; b < last; b++)
    {
        BlockAmongOthers block(d, static_cast<uint32_t>(b));
        for (uint64_t left = d.voxel_masks[b]; left; left &= left - 1)
        {
            uint32_t voxels = 0;
            const VoxelSums sums = block.sum_around(__builtin_ctzll(left), voxels);
            writer.add(sums, voxels);
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

}  // namespace mp2p_icp
