#pragma once

#include <mp2p_icp/Pairings.h>

#include "compact_layers.h"

namespace mp2p_icp
{
/// Pairs of points, of the layers of both maps where they can be.
void write_compact_points(mrpt::serialization::CArchive& out, const MatchedPointList& pairs,
                          const CompactLayers& global, const CompactLayers& local);
void read_compact_points(mrpt::serialization::CArchive& in, MatchedPointList& pairs,
                         const CompactLayers& global, const CompactLayers& local);
}  // namespace mp2p_icp
