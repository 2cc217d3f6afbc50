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

/// For a block that is `step` away: those of its cells that touch the block in the middle.
uint64_t touching_cells(const int step[3])
{
    uint64_t cells = 0;
    for (int c = 0; c < 64; c++)
    {
        const int at[3] = {c & 3, c >> 2 & 3, c >> 4};
        bool touches = true;
        for (int a = 0; a < 3; a++) touches &= step[a] == 0 || at[a] == (step[a] > 0 ? 0 : 3);
        if (touches) cells |= uint64_t(1) << c;
    }
    return cells;
}

struct TouchingCells
{
    std::array<uint64_t, 27> of_step;
    TouchingCells()
    {
        for (int n = 0; n < 27; n++)
        {
            const int step[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
            of_step[static_cast<size_t>(n)] = touching_cells(step);
        }
    }
};

/// A block and the voxels that touch it, with sums from the centre of the block.
class BlockWithBorder
{
 public:
    void fill(const BlockGridData& d, uint32_t block)
    {
        static const TouchingCells touching;
        place_.fill(0);
        count_ = 1;  // number 0 stands for voxels without points
        const BlockCoord& own = d.table[block];
        for (size_t n = 0; n < 27; n++)
        {
            // Cells of this block that touch the other one: those of the other are on the opposite side.
            if ((d.voxel_masks[block] & touching.of_step[26 - n]) == 0) continue;
            const int step[3] = {int(n) % 3 - 1, int(n) / 3 % 3 - 1, int(n) / 9 - 1};
            const uint32_t other =
                n == 13 ? block : d.table.find({own.x + step[0], own.y + step[1], own.z + step[2]});
            if (other != NO_BLOCK) add_voxels(d, other, step, touching.of_step[n]);
        }
    }

    /// Over the 3x3x3 voxels around a cell of the block. \param voxels how many of them have points
    VoxelSums sum_around(int cell, uint32_t& voxels) const
    {
        std::array<uint8_t, 28> found;
        size_t count = 0;
        const uint8_t* corner = &place_[place_of(cell & 3, cell >> 2 & 3, cell >> 4) - place_of(0, 0, 0)];
        for (size_t z = 0; z < 3; z++)
            for (size_t y = 0; y < 3; y++)
                for (size_t x = 0; x < 3; x++)
                {
                    const uint8_t number = corner[x + 6 * y + 36 * z];
                    found[count] = number;
                    count += number != 0;
                }
        voxels = static_cast<uint32_t>(count);
        VoxelSums sum{};
        for (size_t f = 0; f < count; f++)
            for (size_t k = 0; k < SUMS_WITH_MOMENTS; k++) sum[k] += sums_[found[f]][k];
        return sum;
    }

 private:
    /// Of a cell of the block (0...3) or of its border (-1 and 4), among 6x6x6.
    static size_t place_of(int x, int y, int z)
    {
        return static_cast<size_t>(x + 1 + 6 * (y + 1) + 36 * (z + 1));
    }

    void add_voxels(const BlockGridData& d, uint32_t block, const int step[3], uint64_t wanted)
    {
        const uint64_t occupied = d.voxel_masks[block];
        for (uint64_t left = occupied & wanted; left; left &= left - 1)
        {
            const int cell = __builtin_ctzll(left);
            const uint64_t below = (uint64_t(1) << cell) - 1;
            const size_t voxel = d.first_voxel[block] + count_bits(occupied & below);
            sums_[count_] =
                moved_sums(&d.sums[voxel * SUMS_WITH_MOMENTS], 4 * step[0], 4 * step[1], 4 * step[2]);
            place_[place_of((cell & 3) + 4 * step[0], (cell >> 2 & 3) + 4 * step[1],
                            (cell >> 4) + 4 * step[2])] = count_++;
        }
    }

    std::array<uint8_t, 216> place_;  ///< number of the voxel there; 0: no points
    std::array<VoxelSums, 217> sums_;
    uint8_t count_ = 1;
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
    BlockWithBorder around;
    SurfaceWriter writer(out + d.first_voxel[first], d.frame.side, min_spread);
    for (size_t b = first; b < last; b++)
    {
        around.fill(d, static_cast<uint32_t>(b));
        const auto centre = block_centre(d.frame, d.table[static_cast<uint32_t>(b)]);
        for (uint64_t left = d.voxel_masks[b]; left; left &= left - 1)
        {
            uint32_t voxels = 0;
            const VoxelSums sums = around.sum_around(__builtin_ctzll(left), voxels);
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
