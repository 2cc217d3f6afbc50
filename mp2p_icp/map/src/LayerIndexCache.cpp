#include "LayerIndexCache.h"

#include <mp2p_icp/metricmap.h>

#include <cstring>

namespace mp2p_icp
{
namespace
{
uint64_t mixed(uint64_t hash, uint64_t value)
{
    hash = (hash ^ value) * 0x9E3779B97F4A7C15u;
    return hash ^ hash >> 29;
}

/// Two coordinates, or the last one.
uint64_t two_at(const mrpt::aligned_std_vector<float>& values, size_t i)
{
    uint64_t bits = 0;
    std::memcpy(&bits, &values[i], i + 1 < values.size() ? 8 : 4);
    return bits;
}
}  // namespace

uint64_t coordinates_fingerprint(const mrpt::maps::CPointsMap& points)
{
    const auto &x = points.getPointsBufferRef_x(), &y = points.getPointsBufferRef_y(),
               &z = points.getPointsBufferRef_z();
    // Also where the buffers stand: an index reads them in place.
    uint64_t of_x = x.size() ^ reinterpret_cast<uintptr_t>(x.data()), of_y = 1, of_z = 2;
    // Three chains side by side: each waits for its own multiplications.
    for (size_t i = 0; i < x.size(); i += 2)
        of_x = mixed(of_x, two_at(x, i)), of_y = mixed(of_y, two_at(y, i)), of_z = mixed(of_z, two_at(z, i));
    return mixed(mixed(of_x, of_y), of_z);
}

// ---- Beside the layers ------------------------------------------------------------------------------------

NearestNeighborIndex::ConstPtr metric_map_t::nn_index(const layer_name_t& name,
                                                      uint32_t leaf_max_points) const
{
    const auto points = point_layer(name);
    return indexes_->indexes.get(name, *points, leaf_max_points,
                                 [&]() { return make_nn_index(points, leaf_max_points); });
}

std::shared_ptr<const SurfacesOfVoxels> metric_map_t::voxel_surfaces(const layer_name_t& name,
                                                                     double side) const
{
    const auto points = point_layer(name);
    const auto make = [&]()
    { return std::make_shared<SurfacesOfVoxels>(mp2p_icp::voxel_surfaces(*points, side)); };
    return indexes_->voxel_surfaces.get(name, *points, side, make);
}

LocalSurfaces::ConstPtr metric_map_t::local_surfaces(const layer_name_t& name,
                                                     const LocalSurfaceOptions& options,
                                                     uint32_t leaf_max_points) const
{
    const auto points = point_layer(name);
    const auto make = [&]()
    {
        if (options.voxel > 0)
            return local_surfaces_of(*points, *voxel_surfaces(name, options.voxel), options);
        return compute_local_surfaces(*points, nn_index(name, leaf_max_points).get(), options);
    };
    return indexes_->surfaces.get(name, *points, options, make);
}

}  // namespace mp2p_icp
