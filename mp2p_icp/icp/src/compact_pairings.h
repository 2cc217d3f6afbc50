#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/metricmap.h>
#include <mrpt/serialization/CArchive.h>

namespace mp2p_icp
{
/** Pairings, to the bit, in few bytes: points that are those of the maps' layers are written as their
 * numbers, without coordinates (some 8 bytes for a pair of points instead of 64). O(size).
 */
void write_compact(mrpt::serialization::CArchive& out, const Pairings& pairings, const metric_map_t& global,
                   const metric_map_t& local);

/// With the same maps. \exception std::runtime_error for bytes that nobody has written.
Pairings read_compact(mrpt::serialization::CArchive& in, const metric_map_t& global,
                      const metric_map_t& local);

}  // namespace mp2p_icp
