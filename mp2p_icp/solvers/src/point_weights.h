#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>

#include <vector>

namespace mp2p_icp
{
/** The weight of each point pairing: kind x pairing x robust kernel, and 0 for those that the scale test
 * rejects (also listed in `outliers`). \exception std::invalid_argument for negative weights, and a kernel
 * without an estimate.
 */
std::vector<double> point_weights(const Pairings& in, const WeightParameters& wp, OutlierIndices& outliers);

}  // namespace mp2p_icp
