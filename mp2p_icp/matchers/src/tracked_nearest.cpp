#include "tracked_nearest.h"

#include <mp2p_icp/parallel.h>

#include <cmath>
#include <limits>

namespace mp2p_icp
{
namespace
{
/// Distances as the indexes compute them.
float distance_sq(const PointArrays& a, size_t i, const PointView& b, size_t j)
{
    const float dx = a.x[i] - b.x[j], dy = a.y[i] - b.y[j], dz = a.z[i] - b.z[j];
    return dx * dx + dy * dy + dz * dz;
}
}  // namespace

bool TrackedNearest::Memory::knows(size_t i, const PointView& points, const PointArrays& now,
                                   float max_dist_sq, uint32_t& id, float& dist_sq) const
{
    const float moved = std::sqrt(distance_sq(now, i, at, i));
    BoundedNeighbor before;
    before.id = nearest[i], before.others = others[i];
    id = NO_NEIGHBOR, dist_sq = std::numeric_limits<float>::infinity();
    if (before.id == NO_NEIGHBOR) return before.is_still_alone(moved, std::sqrt(max_dist_sq) * (1 + 1e-6f));
    const float now_sq = distance_sq(now, i, points, before.id);
    if (!before.is_still_nearest(moved, now_sq)) return false;
    if (now_sq < max_dist_sq) id = before.id, dist_sq = now_sq;
    return true;
}

void TrackedNearest::Memory::remember(size_t i, const PointArrays& now, uint32_t found, float others_from)
{
    nearest[i] = found, others[i] = others_from;
    at.x[i] = now.x[i], at.y[i] = now.y[i], at.z[i] = now.z[i];
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
        last_.remember(i, now, found[k], others[k]);
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
    const auto is_known = [&](size_t i)
    {
        return last_.knows(i, points, local.in_global, max_dist_sq[i], ids[i], dist_sq[i]) ||
               first_.knows(i, points, local.in_global, max_dist_sq[i], ids[i], dist_sq[i]);
    };
    parallel_for_blocks(n,
                        [&](size_t first, size_t last)
                        {
                            std::vector<uint32_t> unknown;
                            for (size_t i = first; i < last; i++)
                                if (others_than_before || !is_known(i))
                                    unknown.push_back(static_cast<uint32_t>(i));
                            search(index, unknown, local.in_global, max_dist_sq, ids, dist_sq);
                        });
    if (others_than_before) first_ = last_;
}

}  // namespace mp2p_icp
