#pragma once

#include <mp2p_icp/block_grid.h>

#include <cstring>
#include <limits>

#include "block_grid_data.h"

namespace mp2p_icp
{
/// Is an element at that distance before the best one so far? Ties: the lower index.
inline bool is_before(float dist_sq, uint32_t id, const GridNeighbor& best)
{
    return dist_sq < best.dist_sq || (dist_sq == best.dist_sq && id < best.id);
}

/// The next larger float. \param v not negative
inline float next_above(float v)
{
    uint32_t bits = 0;
    std::memcpy(&bits, &v, sizeof(bits));
    bits++;
    std::memcpy(&v, &bits, sizeof(bits));
    return v;
}

/// The next smaller float. \param v positive
inline float next_below(float v)
{
    uint32_t bits = 0;
    std::memcpy(&bits, &v, sizeof(bits));
    bits--;
    std::memcpy(&v, &bits, sizeof(bits));
    return v;
}

/** \name Four slots at a time. Which lane has the best is not predictable: no branches.
 * @{ */
using Float4 = float __attribute__((vector_size(16)));
using Int4 = int32_t __attribute__((vector_size(16)));

inline Float4 load4(const float* p)
{
    Float4 v;
    std::memcpy(&v, p, sizeof(v));
    return v;
}

inline Float4 dist_sq4(const ElementSlots& slots, size_t slot, const float q[3])
{
    const Float4 dx = q[0] - load4(&slots.x[slot]), dy = q[1] - load4(&slots.y[slot]),
                 dz = q[2] - load4(&slots.z[slot]);
    return dx * dx + dy * dy + dz * dz;
}

inline float smallest(const Float4& v)
{
    const Float4 swapped = __builtin_shuffle(v, Int4{2, 3, 0, 1});
    const Float4 pairs = v < swapped ? v : swapped;
    return pairs[0] < pairs[1] ? pairs[0] : pairs[1];
}

inline int32_t smallest(const Int4& v)
{
    const Int4 swapped = __builtin_shuffle(v, Int4{2, 3, 0, 1});
    const Int4 pairs = v < swapped ? v : swapped;
    return pairs[0] < pairs[1] ? pairs[0] : pairs[1];
}

constexpr int32_t NO_SLOT = std::numeric_limits<int32_t>::max();

/// The best of each lane: its distance and its slot.
struct LaneBests
{
    Float4 dist_sq;
    Int4 slot = Int4{} + NO_SLOT;

    /// Slots farther than `limit` are not taken.
    explicit LaneBests(float limit) : dist_sq(Float4{} + next_above(limit)) {}

    /// \return those that are not best in their lane, now
    Float4 add(const Float4& here, uint32_t first_slot)
    {
        const Int4 nearer = here < dist_sq;
        const Float4 loser = nearer ? dist_sq : here;
        dist_sq = nearer ? here : dist_sq;
        slot = nearer ? Int4{0, 1, 2, 3} + static_cast<int32_t>(first_slot) : slot;
        return loser;
    }
    bool empty() const { return smallest(slot) == NO_SLOT; }

    /// The slot of the nearest one. Of several, the first: within a block it has the lowest index.
    int32_t best_slot(float best_dist_sq) const
    {
        return smallest(dist_sq == Float4{} + best_dist_sq ? slot : Int4{} + NO_SLOT);
    }
};
/** @} */

}  // namespace mp2p_icp
