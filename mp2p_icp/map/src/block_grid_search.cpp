#include <cmath>

#include "block_grid_around.h"
#include "block_grid_scan.h"

namespace mp2p_icp
{
namespace
{
/// The nearest element. Starts with the largest distance that is allowed and the highest index.
struct NearestFound
{
    GridNeighbor best;

    explicit NearestFound(float max_dist_sq) : best{NO_NEIGHBOR, next_below(max_dist_sq)} {}
    float limit() const { return best.dist_sq; }
    void skip(float) {}

    void scan(const ElementSlots& slots, uint32_t first, uint32_t last, const float q[3])
    {
        LaneBests bests(best.dist_sq);
        for (uint32_t s = first; s < last; s += SLOT_GROUP) bests.add(dist_sq4(slots, s, q), s);
        if (bests.empty()) return;
        const float d = smallest(bests.dist_sq);
        const uint32_t id = slots.id[static_cast<size_t>(bests.best_slot(d))];
        if (is_before(d, id, best)) best = {id, d};
    }
};

/// The nearest element, and a lower bound for all others.
struct BoundedFound
{
    GridNeighbor best;
    float others_sq = std::numeric_limits<float>::infinity();

    explicit BoundedFound(float max_dist_sq) : best{NO_NEIGHBOR, next_below(max_dist_sq)} {}
    float limit() const { return best.dist_sq; }
    void skip(float dist_sq) { others_sq = std::min(others_sq, dist_sq); }

    void scan(const ElementSlots& slots, uint32_t first, uint32_t last, const float q[3])
    {
        LaneBests bests(FLT_MAX);
        Float4 others = bests.dist_sq;  // infinite
        for (uint32_t s = first; s < last; s += SLOT_GROUP)
        {
            const Float4 loser = bests.add(dist_sq4(slots, s, q), s);
            others = loser < others ? loser : others;
        }
        const float d = smallest(bests.dist_sq);
        const int32_t slot = bests.best_slot(d);
        others = bests.slot != slot && bests.dist_sq < others ? bests.dist_sq : others;
        skip(smallest(others));
        if (slot != NO_SLOT) take(slots.id[static_cast<size_t>(slot)], d);
    }

    void take(uint32_t id, float dist_sq)
    {
        if (!is_before(dist_sq, id, best)) return skip(dist_sq);
        if (best.id != NO_NEIGHBOR) skip(best.dist_sq);
        best = {id, dist_sq};
    }
};

/// The k nearest, sorted.
struct NearestKFound
{
    uint32_t k, count = 0;
    float largest;
    uint32_t* ids;
    float* dist_sq;

    NearestKFound(float max_dist_sq, uint32_t k_, uint32_t* ids_, float* dist_sq_)
        : k(k_), largest(next_below(max_dist_sq)), ids(ids_), dist_sq(dist_sq_)
    {
    }
    float limit() const { return count == k ? dist_sq[k - 1] : largest; }
    void skip(float) {}

    void scan(const ElementSlots& slots, uint32_t first, uint32_t last, const float q[3])
    {
        for (uint32_t s = first; s < last; s += SLOT_GROUP)
        {
            const Float4 here = dist_sq4(slots, s, q);
            for (uint32_t lane = 0; lane < SLOT_GROUP; lane++)
                if (here[lane] <= limit()) insert(here[lane], slots.id[s + lane]);
        }
    }

    void insert(float d, uint32_t id)
    {
        const auto before = [&](uint32_t place) { return is_before(d, id, {ids[place], dist_sq[place]}); };
        if (count == k && !before(k - 1)) return;
        uint32_t place = count == k ? k - 1 : count++;
        for (; place > 0 && before(place - 1); place--)
            dist_sq[place] = dist_sq[place - 1], ids[place] = ids[place - 1];
        dist_sq[place] = d, ids[place] = id;
    }
};

template <class Found>
inline __attribute__((always_inline)) void visit_block(const BlockGridData& d, uint32_t block,
                                                       const float q[3], Found& found)
{
    found.scan(d.slots, d.slots.first[block], d.slots.first[block + 1], q);
}

/// The block that many steps away, if its elements may matter.
template <class Found>
void visit_neighbor(const BlockGridData& d, const BlocksAround& around, const int32_t step[3],
                    float lower_bound_sq, const float q[3], Found& found)
{
    if (!(lower_bound_sq <= found.limit())) return found.skip(lower_bound_sq);
    const BlockCoord& own = around.own;
    const uint32_t block = d.table.find({own.x + step[0], own.y + step[1], own.z + step[2]});
    if (block != NO_BLOCK) visit_block(d, block, q, found);
}

/// The 7 blocks that share the corner, the edges and the faces nearest to the query.
template <class Found>
void visit_near_neighbors(const BlockGridData& d, const BlocksAround& around, const float q[3], Found& found)
{
    float lower_bound_sq[8];
    uint32_t wanted = 0;
    for (uint32_t n = 1; n < 8; n++)
    {
        lower_bound_sq[n] = (n & 1 ? around.near_sq[0] : 0) + (n & 2 ? around.near_sq[1] : 0) +
                            (n & 4 ? around.near_sq[2] : 0);
        wanted |= uint32_t(lower_bound_sq[n] <= found.limit()) << n;
    }
    for (uint32_t n = 1; n < 8; n++)
        if (!(wanted >> n & 1)) found.skip(lower_bound_sq[n]);
    for (; wanted; wanted &= wanted - 1)
    {
        const auto n = static_cast<uint32_t>(__builtin_ctz(wanted));
        const int32_t step[3] = {around.near_step[0] * int32_t(n & 1),
                                 around.near_step[1] * int32_t(n >> 1 & 1),
                                 around.near_step[2] * int32_t(n >> 2)};
        visit_neighbor(d, around, step, lower_bound_sq[n], q, found);
    }
}

/// Everything that is in none of the eight blocks around.
template <class Found>
void visit_beyond(const BlockGridData& d, const BlocksAround& around, const float q[3], Found& found)
{
    if (!(around.beyond_sq <= found.limit())) return found.skip(around.beyond_sq);
    d.boxes.visit_near(
        q, [&]() { return found.limit(); },
        [&](uint32_t block)
        {
            if (!around.has(d.table[block])) visit_block(d, block, q, found);
        },
        [&](float dist_sq) { found.skip(dist_sq); });
}

template <class Found>
void search(const BlockGridData& d, const float q[3], Found& found)
{
    if (d.boxes.empty() || !std::isfinite(q[0]) || !std::isfinite(q[1]) || !std::isfinite(q[2])) return;
    const BlocksAround around(d, q);
    if (const uint32_t own = d.table.find(around.own); own != NO_BLOCK) visit_block(d, own, q, found);
    visit_near_neighbors(d, around, q, found);
    visit_beyond(d, around, q, found);
}

GridNeighbor found_or_none(const GridNeighbor& best)
{
    return best.id == NO_NEIGHBOR ? GridNeighbor() : best;
}
}  // namespace

GridNeighbor BlockGrid::nearest(float x, float y, float z, float max_dist_sq) const
{
    if (!(max_dist_sq > 0)) return {};
    const float q[3] = {x, y, z};
    NearestFound found(max_dist_sq);
    search(*data_, q, found);
    return found_or_none(found.best);
}

BoundedNeighbor BlockGrid::nearest_and_bound(float x, float y, float z, float max_dist_sq) const
{
    BoundedNeighbor result;
    if (!(max_dist_sq > 0)) return result;
    const float q[3] = {x, y, z};
    BoundedFound found(max_dist_sq);
    search(*data_, q, found);
    static_cast<GridNeighbor&>(result) = found_or_none(found.best);
    result.others = surely_nearer_than(found.others_sq);
    return result;
}

uint32_t BlockGrid::nearest_k(float x, float y, float z, float max_dist_sq, uint32_t k, uint32_t* ids,
                              float* dist_sq) const
{
    if (!(max_dist_sq > 0) || k == 0) return 0;
    const float q[3] = {x, y, z};
    NearestKFound found(max_dist_sq, k, ids, dist_sq);
    search(*data_, q, found);
    return found.count;
}

}  // namespace mp2p_icp
