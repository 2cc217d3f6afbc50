#pragma once

#include <mp2p_icp/WeightParameters.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>

#include "closed_form.h"
#include "gnc.h"

namespace mp2p_icp
{
/** `solve` with the robust weights and the rejection of outliers that WeightParameters ask for; the guess is
 * where residuals are measured if they do not say it. With graduated non-convexity `solve` runs many times,
 * the last time for the result. \exception std::invalid_argument
 */
bool solve_weighted(const Pairings& in, const WeightParameters& wp,
                    const std::optional<mrpt::poses::CPose3D>& guess, const WeightedSolver& solve,
                    OptimalTF_Result& result);

/// A closed form with the robust weights and the rejection of outliers that WeightParameters ask for.
/// \exception std::invalid_argument
bool solve_weighted(const Pairings& in, const WeightParameters& wp, const ClosedForm& how,
                    OptimalTF_Result& result);

/** From the pose of solve_weighted(), to the minimum of the sum of squares of all rows (less the outliers
 * found) plus the prior's cost, by Gauss-Newton steps.
 */
void refine_with_prior(const Pairings& in, const WeightParameters& wp,
                       const mrpt::poses::CPose3DPDFGaussianInf& prior, OptimalTF_Result& result);

}  // namespace mp2p_icp
