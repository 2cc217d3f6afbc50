#pragma once

#include <mp2p_icp/nn_index.h>

#include <map>
#include <mutex>
#include <string>

namespace mp2p_icp
{
/// The nearest-neighbour indexes of a map's layers, each with the fingerprint of what it was made from.
class LayerIndexCache
{
 public:
    NearestNeighborIndex::ConstPtr get(const std::string& layer,
                                       const mrpt::maps::CPointsMap::ConstPtr& points,
                                       uint32_t leaf_max_points);

 private:
    struct Entry
    {
        const mrpt::maps::CPointsMap* points = nullptr;
        uint64_t fingerprint = 0;
        uint32_t leaf_max_points = 0;
        NearestNeighborIndex::ConstPtr index;
    };
    std::mutex mutex_;
    std::map<std::string, Entry> entries_;
};

}  // namespace mp2p_icp
