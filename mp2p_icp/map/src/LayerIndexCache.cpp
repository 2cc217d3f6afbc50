#include "LayerIndexCache.h"

#include <mp2p_icp/metricmap.h>

#include <cstring>

namespace mp2p_icp
{
namespace
{
uint64_t mix(uint64_t hash, const mrpt::aligned_std_vector<float>& values)
{
    for (const float v : values)
    {
        uint32_t bits = 0;
        std::memcpy(&bits, &v, sizeof(bits));
        hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;
        hash ^= hash >> 29;
    }
    return hash;
}
}  // namespace

uint64_t coordinates_fingerprint(const mrpt::maps::CPointsMap& points)
{
    // Also where the buffers stand: an index reads them in place.
    const auto& x = points.getPointsBufferRef_x();
    uint64_t hash = x.size() ^ reinterpret_cast<uintptr_t>(x.data());
    hash = mix(hash, x);
    hash = mix(hash, points.getPointsBufferRef_y());
    return mix(hash, points.getPointsBufferRef_z());
}

NearestNeighborIndex::ConstPtr LayerIndexCache::get(const std::string& layer,
                                                    const mrpt::maps::CPointsMap::ConstPtr& points,
                                                    uint32_t leaf_max_points)
{
    const uint64_t fingerprint = coordinates_fingerprint(*points);
    const std::lock_guard<std::mutex> lock(mutex_);
    Entry& e = entries_[layer];
    if (!e.index || e.points != points.get() || e.fingerprint != fingerprint ||
        e.leaf_max_points != leaf_max_points)
        e = {points.get(), fingerprint, leaf_max_points, make_nn_index(points, leaf_max_points)};
    return e.index;
}

}  // namespace mp2p_icp
