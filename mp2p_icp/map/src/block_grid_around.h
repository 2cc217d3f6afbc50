#pragma once

#include <cfloat>
#include <cmath>

#include "block_grid_data.h"

namespace mp2p_icp
{
/** The eight blocks around a query: its own, and on each axis the nearer one of the two beside it. All
 * distances are lower bounds of those of the elements in there.
 */
struct BlocksAround
{
    BlockCoord own;
    int32_t near_step[3];  ///< +1 or -1: to the nearer one
    float near_sq[3];
    float beyond_sq;  ///< of everything that is in none of the eight

    BlocksAround(const BlockGridData& d, const float q[3])
    {
        int32_t block[3];
        double least_off = 2;  // cells
        for (int a = 0; a < 3; a++)
        {
            const double position = d.frame.position(q[a], a);
            block[a] = static_cast<int32_t>(position) >> 2;
            const double off_centre = position - (4.0 * block[a] + 2);
            near_step[a] =
                1 - 2 * int32_t(off_centre < 0);  // without a branch, which would often be mispredicted
            near_sq[a] = lower_bound_sq(d, 2 - std::abs(off_centre));
            least_off = smaller(least_off, std::abs(off_centre));
        }
        own = {block[0], block[1], block[2]};
        beyond_sq = lower_bound_sq(d, 2 + least_off);
    }

    /// Is the block one of the eight?
    bool has(const BlockCoord& b) const
    {
        const int32_t step[3] = {b.x - own.x, b.y - own.y, b.z - own.z};
        bool is_one = true;
        for (int a = 0; a < 3; a++) is_one &= step[a] == 0 || step[a] == near_step[a];
        return is_one;
    }

 private:
    /** For elements at least so many cells away, but for the rounding of positions. (That of means does not
     * carry them out of their voxel: rounding is monotonic, and the floats that they are means of lie in
     * there.) Squared distances in float are off by less than 1e-6 of themselves, where they do not
     * underflow.
     */
    static float lower_bound_sq(const BlockGridData& d, double cells)
    {
        const double gap = larger(cells - 2 * d.frame.tolerance, 0) * d.frame.side;
        const double squared = smaller(gap * gap * (1 - 2e-6), double(FLT_MAX));
        return squared < 2 * double(FLT_MIN) ? 0 : static_cast<float>(squared);
    }
};

}  // namespace mp2p_icp
