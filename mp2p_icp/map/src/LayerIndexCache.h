#pragma once

#include <mp2p_icp/metricmap.h>

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace mp2p_icp
{
/// What was made from a map's cloud layers, with some options: kept until the coordinates change.
template <class Options, class Value>
class KeptBesideLayers
{
 public:
    using ConstPtr = std::shared_ptr<const Value>;

    /// That of the layer with these options: the one that is kept, or what make() returns.
    template <class Make>
    ConstPtr get(const std::string& layer, const mrpt::maps::CPointsMap& points, const Options& options,
                 const Make& make)
    {
        const uint64_t fingerprint = coordinates_fingerprint(points);
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            if (const auto found = find(layer, points, fingerprint, options)) return found;
        }
        // Not under the lock: a thread that waits for the others' blocks may be given work that wants the
        // lock. Two that come at once make the same; the first result stays.
        const ConstPtr made = make();
        const std::lock_guard<std::mutex> lock(mutex_);
        if (const auto found = find(layer, points, fingerprint, options)) return found;
        auto& kept = entries_[layer].kept;
        if (kept.size() == MOST_PER_LAYER) kept.erase(kept.begin());
        kept.emplace_back(options, made);
        return made;
    }

 private:
    static constexpr size_t MOST_PER_LAYER = 8;
    struct Entry
    {
        const mrpt::maps::CPointsMap* points = nullptr;
        uint64_t fingerprint = 0;
        std::vector<std::pair<Options, ConstPtr>> kept;  ///< the oldest first
    };

    /// Forgets what was made from other coordinates.
    ConstPtr find(const std::string& layer, const mrpt::maps::CPointsMap& points, uint64_t fingerprint,
                  const Options& options)
    {
        Entry& e = entries_[layer];
        if (e.points != &points || e.fingerprint != fingerprint) e = {&points, fingerprint, {}};
        for (const auto& [of, value] : e.kept)
            if (of == options) return value;
        return nullptr;
    }

    std::mutex mutex_;
    std::map<std::string, Entry> entries_;
};

/// All that a map keeps beside its layers.
struct LayerIndexCache
{
    KeptBesideLayers<uint32_t, NearestNeighborIndex> indexes;  ///< by leaf size
    KeptBesideLayers<LocalSurfaceOptions, LocalSurfaces> surfaces;
    KeptBesideLayers<double, SurfacesOfVoxels> voxel_surfaces;  ///< by the voxels' side, m
};

}  // namespace mp2p_icp
