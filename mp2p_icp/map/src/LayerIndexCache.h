#pragma once

#include <mp2p_icp/local_surfaces.h>
#include <mp2p_icp/nn_index.h>

#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace mp2p_icp
{
/// The nearest-neighbour indexes and local surfaces of a map's layers, each with the fingerprint of what it
/// was made from.
class LayerIndexCache
{
 public:
    NearestNeighborIndex::ConstPtr get(const std::string& layer,
                                       const mrpt::maps::CPointsMap::ConstPtr& points,
                                       uint32_t leaf_max_points);
    LocalSurfaces::ConstPtr surfaces(const std::string& layer, const mrpt::maps::CPointsMap::ConstPtr& points,
                                     const LocalSurfaceOptions& options, uint32_t leaf_max_points);

 private:
    struct Entry
    {
        const mrpt::maps::CPointsMap* points = nullptr;
        uint64_t fingerprint = 0;
        uint32_t leaf_max_points = 0;
        NearestNeighborIndex::ConstPtr index;
    };
    struct SurfaceEntry
    {
        const mrpt::maps::CPointsMap* points = nullptr;
        uint64_t fingerprint = 0;
        std::vector<LocalSurfaces::ConstPtr> surfaces;  ///< with different options, the oldest first
    };
    std::mutex mutex_;
    std::map<std::string, Entry> entries_;
    std::map<std::string, SurfaceEntry> surface_entries_;
};

}  // namespace mp2p_icp
