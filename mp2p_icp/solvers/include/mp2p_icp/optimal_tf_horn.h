#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>

namespace mp2p_icp
{
/** The pose that minimises sum w_i |a_i - (R b_i + t)|^2 over the point pairings (a_i global, b_i local), in
 * closed form: B. K. P. Horn, "Closed-form solution of absolute orientation using unit quaternions", JOSA A
 * 4(4), 1987. The optimal quaternion is the eigenvector of the largest eigenvalue of a 4x4 matrix of the
 * centred second moments; t = a_mean - R b_mean with weighted means.
 *
 * When the points leave the rotation partly free (one point, coincident or collinear points), the result is,
 * among all poses of least cost, the one whose rotation is nearest to `guess`'s.
 *
 * \param guess Where to stay along free directions; also the estimate for a robust kernel if WeightParameters
 * has none. \return false (result unchanged) if there is nothing to solve with: no pairing with a positive
 * weight, or sums that are not finite (a NaN in a pairing). \exception std::invalid_argument for pairings
 * other than point-point, which this solver cannot use; a negative weight; a scale of a robust kernel that is
 * not positive. Sums run in fixed blocks: the same bits on any number of threads. Cost: O(N), two passes
 * (about twice as much with outlier test).
 */
bool optimal_tf_horn(const Pairings& in, const WeightParameters& wp, OptimalTF_Result& result,
                     const mrpt::poses::CPose3D& guess = mrpt::poses::CPose3D());

}  // namespace mp2p_icp
