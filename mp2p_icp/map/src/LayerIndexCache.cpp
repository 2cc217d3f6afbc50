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

// ---- Beside the layers ------------------------------------------------------------------------------------

NearestNeighborIndex::ConstPtr metric_map_t::nn_index(const layer_name_t& name,
                                                      uint32_t leaf_max_points) const
{
    const auto points = point_layer(name);
    return indexes_->indexes.get(name, *points, leaf_max_points,
                                 [&]() { return make_nn_index(points, leaf_max_points); });
}

std::shared_ptr<const BlockGrid> metric_map_t::voxels(const layer_name_t& name, double side) const
{
    const auto points = point_layer(name);
    return indexes_->voxels.get(name, *points, side,
                                [&]()
                                { return std::make_shared<BlockGrid>(voxels_with_moments(*points, side)); });
}

LocalSurfaces::ConstPtr metric_map_t::local_surfaces(const layer_name_t& name,
                                                     const LocalSurfaceOptions& options,
                                                     uint32_t leaf_max_points) const
{
    const auto points = point_layer(name);
    const auto make = [&]()
    {
        const auto index = options.voxel > 0 ? nullptr : nn_index(name, leaf_max_points);
        return compute_local_surfaces(*points, index.get(), options);
    };
    return indexes_->surfaces.get(name, *points, options, make);
}

}  // namespace mp2p_icp
