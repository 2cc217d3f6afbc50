#pragma once

#include <mp2p_icp/block_grid.h>

#include <cfloat>
#include <cstdint>

namespace mp2p_icp
{
/// Cells are worked on so many at a time: their coordinates stay in the first-level cache.
constexpr size_t CELL_CHUNK = 128;

/// Cells per axis. Fits int32_t.
constexpr double CELL_COUNT = 0x1.0p31;

/// By value: GCC keeps these in registers, and std::min() and std::max() often not. A NaN loses if it stands
/// first.
inline double smaller(double a, double b)
{
    return a < b ? a : b;
}
inline double larger(double a, double b)
{
    return a > b ? a : b;
}

/** Numbers the cells of a cubic lattice on each axis 0 ... 2^31-1, from a corner that is a multiple of four
 * cells away from zero, far below the middle of the cloud. The cell of a coordinate is coordinate / side,
 * rounded down.
 */
struct CellFrame
{
    double side = 1, inverse_side = 1;
    double corner[3] = {0, 0, 0};  ///< cells from zero; whole numbers

    /// Is coordinate * inverse_side exactly coordinate / side, in float too?
    bool is_power_of_two = true;

    /// Up to so many cells position() may be off.
    double tolerance = 0;

    CellFrame() = default;
    CellFrame(double side, const PointView& points);

    /// Near the middle of the cloud, m; a float, so that the way to a point from there is exact.
    double middle(int axis) const
    {
        const double metres = (corner[axis] + CELL_COUNT / 2) * side;
        return double(static_cast<float>(smaller(larger(metres, -double(FLT_MAX)), double(FLT_MAX))));
    }

    /// The coordinate in cells from the corner, limited to the numbered cells.
    double position(float coordinate, int axis) const
    {
        const double p = double(coordinate) * inverse_side - corner[axis];
        return smaller(larger(p, 0), CELL_COUNT - 1);  // NaN: 0
    }
};

/// What becomes of a point beyond the numbered cells.
enum class FarPoints : uint8_t
{
    Refuse,  ///< std::invalid_argument
    InOutermostCell
};

constexpr int32_t NO_CELL = -1;

/// The cells of up to CELL_CHUNK points.
struct ChunkCells
{
    int32_t cell[3][CELL_CHUNK];  ///< [0] is NO_CELL for a point that is not finite
};

/// The cells of the points first ... first + count - 1.
void find_cells(const CellFrame& frame, const PointView& points, size_t first, size_t count,
                FarPoints far_points, ChunkCells& out);

}  // namespace mp2p_icp
