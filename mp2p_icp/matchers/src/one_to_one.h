#pragma once

#include <cstddef>
#include <vector>

namespace mp2p_icp
{
/// A pair of primitives and how bad it is.
struct RatedPair
{
    size_t global, local;
    double cost;
};

/// Of the pairs of one global primitive the best stays (the first among equals), in the given order.
std::vector<RatedPair> best_per_global(const std::vector<RatedPair>& pairs);

}  // namespace mp2p_icp
