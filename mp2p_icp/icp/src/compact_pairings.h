#pragma once

#include "compact_surfaces.h"

namespace mp2p_icp
{
/** Writes the pairings of the iterations of a run, one after the other, to the bit, in few bytes: points that
 * are those of the maps' layers are written as their numbers, and planes and lines once for all iterations
 * (some 8 bytes for a pair of points instead of 64, and 3 for a point and a plane instead of 80). O(size).
 */
class CompactPairingsWriter
{
 public:
    CompactPairingsWriter(const metric_map_t& global, const metric_map_t& local)
        : global_(global), local_(local)
    {
    }
    void write(mrpt::serialization::CArchive& out, const Pairings& pairings);

 private:
    const CompactLayers global_, local_;
    CompactSurfaceWriter<CompactPlane> planes_{local_};
    CompactSurfaceWriter<CompactLine> lines_{local_};
};

/// Reads them again, with the same maps, in the same order.
class CompactPairingsReader
{
 public:
    CompactPairingsReader(const metric_map_t& global, const metric_map_t& local)
        : global_(global), local_(local)
    {
    }
    /// \exception std::runtime_error for bytes that nobody has written.
    Pairings read(mrpt::serialization::CArchive& in);

 private:
    const CompactLayers global_, local_;
    CompactSurfaceReader<CompactPlane> planes_{local_};
    CompactSurfaceReader<CompactLine> lines_{local_};
};

}  // namespace mp2p_icp
