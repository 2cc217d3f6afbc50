#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/WeightParameters.h>

#include <functional>

#include "prepared_pairings.h"

namespace mp2p_icp
{
/// Solves pairings with their present weights. \return false if there is nothing to solve with.
using WeightedSolver = std::function<bool(PreparedPairings&, OptimalTF_Result&)>;

/** Graduated non-convexity around `solve`: OutlierRejection::GncGemanMcClure or GncTruncated. Residuals up to
 * `threshold` m are inliers; all others are listed in `result.outliers`. Needs pairings that are all finite.
 */
bool solve_gnc(const PreparedPairings& in, OutlierRejection loss, double threshold,
               const WeightedSolver& solve, OptimalTF_Result& result);

}  // namespace mp2p_icp
