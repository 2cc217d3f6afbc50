#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>

#include <optional>

namespace mp2p_icp
{
/** The pose by Horn's closed form: B. K. P. Horn, "Closed-form solution of absolute orientation using unit
 * quaternions", JOSA A 4(4), 1987, with directions added as in the OLAE-ICP report. The rotation minimises
 * sum w |v_a - R v_b|^2 over vectors of the global (a) and local (b) frame: the point pairings relative to
 * their weighted centroids, in m; directions of lines and normals of planes, of unit length, with the weights
 * of PairWeights. Given the rotation, the translation solves linear least squares over the position rows of
 * all kinds; for points alone that is a_mean - R b_mean.
 *
 * - Free directions (lines, by default) get the sign that fits the guess; without one, that of the rotation
 *   that fits all pairings best without any sign rule.
 * - Point-line and point-plane pairings: with a guess, each is used for the rotation, beside the point
 * pairings, as the pair of the local point and its projection at the guess. Without, for the translation
 * only.
 * - Where the vectors leave the rotation partly free, the position rows of all kinds decide, with a search
 * over the rotations on sums (no signs, no guess needed).
 *
 * Among all poses of least cost the result has the rotation nearest to the guess's (the identity's without
 * one), and puts the centroid of the local positions nearest to where the guess does.
 *
 * \param guess Also the estimate for a robust kernel if WeightParameters has none. \return false (pose
 * unchanged, SolveStatus::NoPairings) if there is nothing to solve with. Pairings whose numbers are not
 * finite are skipped and counted. \exception std::invalid_argument for a weight that is not from 0 to
 * 1e20, a guess that is not finite, a scale or threshold that is not positive, a robust kernel without an
 * estimate. Sums run in fixed blocks: the same bits on any number of threads. Cost: one pass over the points,
 * and some 0.2 us. Thread-safe.
 */
bool optimal_tf_horn(const Pairings& in, const WeightParameters& wp, OptimalTF_Result& result,
                     const std::optional<mrpt::poses::CPose3D>& guess = std::nullopt);

}  // namespace mp2p_icp
