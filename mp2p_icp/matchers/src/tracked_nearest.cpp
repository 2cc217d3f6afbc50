#include "tracked_nearest.h"

#include <mp2p_icp/parallel.h>

#include <cmath>
#include <limits>

namespace mp2p_icp
{
struct TrackedNearest::Point
{
    float x, y, z;

    /// As the indexes compute it.
    float distance_sq_to(float ox, float oy, float oz) const
    {
        const float dx = x - ox, dy = y - oy, dz = z - oz;
        return dx * dx + dy * dy + dz * dz;
    }
};

bool TrackedNearest::knows(const Memory& memory, const Point& now, const PointView& points, float max_dist_sq,
                           uint32_t& id, float& dist_sq)
{
    const float moved = std::sqrt(now.distance_sq_to(memory.x, memory.y, memory.z));
    BoundedNeighbor before;
    before.id = memory.nearest, before.others = memory.others;
    id = NO_NEIGHBOR, dist_sq = std::numeric_limits<float>::infinity();
    if (before.id == NO_NEIGHBOR) return before.is_still_alone(moved, std::sqrt(max_dist_sq) * (1 + 1e-6f));
    const float now_sq = now.distance_sq_to(points.x[before.id], points.y[before.id], points.z[before.id]);
    if (!before.is_still_nearest(moved, now_sq)) return false;
    if (now_sq < max_dist_sq) id = before.id, dist_sq = now_sq;
    return true;
}

void TrackedNearest::search(const NearestNeighborIndex& index, const std::vector<uint32_t>& which,
                            const PointArrays& now, const float* max_dist_sq, std::vector<uint32_t>& ids,
                            std::vector<float>& dist_sq)
{
    const size_t n = which.size();
    PointArrays queries;
    queries.resize(n);
    std::vector<float> limits(n), found_sq(n), others(n);
    std::vector<uint32_t> found(n);
    for (size_t k = 0; k < n; k++)
    {
        const uint32_t i = which[k];
        queries.x[k] = now.x[i], queries.y[k] = now.y[i], queries.z[k] = now.z[i], limits[k] = max_dist_sq[i];
    }
    index.nearest_and_bound(queries, 0, n, limits.data(), found.data(), found_sq.data(), others.data());
    for (size_t k = 0; k < n; k++)
    {
        const uint32_t i = which[k];
        ids[i] = found[k], dist_sq[i] = found_sq[k];
        last_[i] = {now.x[i], now.y[i], now.z[i], found[k], others[k]};
    }
}

void TrackedNearest::find(const NearestNeighborIndex& index, const PointView& points,
                          const LocalPoints& local, const float* max_dist_sq, std::vector<uint32_t>& ids,
                          std::vector<float>& dist_sq)
{
    const size_t n = local.ids.size();
    ids.resize(n), dist_sq.resize(n);
    const bool others_than_before = local_ids_ != local.ids;
    if (others_than_before) local_ids_ = local.ids, last_.resize(n);
    const PointArrays& now = local.in_global;
    const auto find_all = [&, points](size_t first, size_t last)
    {
        std::vector<uint32_t> unknown;
        for (size_t i = first; i < last; i++)
        {
            const Point p{now.x[i], now.y[i], now.z[i]};
            const float limit = max_dist_sq[i];
            if (others_than_before || !(knows(last_[i], p, points, limit, ids[i], dist_sq[i]) ||
                                        knows(first_[i], p, points, limit, ids[i], dist_sq[i])))
                unknown.push_back(static_cast<uint32_t>(i));
        }
        search(index, unknown, now, max_dist_sq, ids, dist_sq);
    };
    parallel_for_blocks(n, find_all);
    if (others_than_before) first_ = last_;
}

}  // namespace mp2p_icp
