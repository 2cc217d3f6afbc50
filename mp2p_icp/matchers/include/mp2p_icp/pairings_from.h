#pragma once

#include <mp2p_icp/Pairings.h>
#include <mrpt/maps/CPointsMap.h>

#include <utility>
#include <vector>

namespace mp2p_icp
{
/** Solver input from two clouds and known correspondences.
 * \param indices (global index, local index) of each pair.
 * \exception std::invalid_argument naming the first index that is out of range.
 */
Pairings pairings_from(const mrpt::maps::CPointsMap& global, const mrpt::maps::CPointsMap& local,
                       const std::vector<std::pair<size_t, size_t>>& indices);

}  // namespace mp2p_icp
