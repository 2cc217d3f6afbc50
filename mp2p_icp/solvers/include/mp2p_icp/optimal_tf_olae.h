#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>

#include <optional>

namespace mp2p_icp
{
/// Which 3x3 system of the Gibbs vector g is solved. All agree on data without noise.
enum class OlaeSystem : uint8_t
{
    /** The OLAE-ICP report's: ((W + tr B) I - S) g = z, W = sum w (for vectors of any
     * length: half of sum w (|a|^2 + |b|^2)), S = B + B', z = sum w b x a. It is QUEST
     * with its eigenvalue frozen at W. (The report's 1 in place of W is right only for weights that sum
     * to 1.)
     */
    Report,
    /** OLAE's own least squares, min sum w |d - g x s|^2, s = a + b, d = a - b: M g = 2 z,
     * M = sum w (|s|^2 I - s s'). D. Mortari, F. L. Markley, P. Singla, "Optimal linear attitude estimator",
     * JGCD 30(6), 2007.
     */
    LeastSquares,
    /// The report's with Newton steps on the eigenvalue: the optimum of Wahba's problem, as Horn's, for the
    /// same vectors. M. D. Shuster, S. D. Oh, "Three-axis attitude determination from vector observations",
    /// 1981.
    Newton
};

struct OlaeParameters
{
    OlaeSystem system = OlaeSystem::Report;
    /// true: points count by their directions from the centroid, as in the report. false: with their lengths,
    /// as in optimal_tf_horn(), and one pass over the points less.
    bool normalize_points = true;
};

/** The pose by OLAE: no iteration, no guess needed. Vectors are the point pairings relative to their
 * centroids, the directions of lines and the normals of planes; the rotation is the Gibbs vector of a linear
 * system (OlaeSystem), solved in the one of four frames (turned by 180 degrees about an axis or not: the
 * method of sequential rotations, all from one accumulation) that is farthest from the singularity at 180
 * degrees. Given the rotation, the translation solves linear least squares over the position rows of all
 * kinds.
 *
 * Weights, signs of directions, projection of points on lines and planes, degenerate sets, errors and
 * threads: as optimal_tf_horn(). Unit vectors weigh w L^2, like directions. Points nearer to the centroid
 * than 1e-4 L have no direction and do not count for the rotation. Normalising throws the points' lengths
 * away, so that it is less accurate than Horn's on noisy points.
 *
 * \return false (pose unchanged, SolveStatus::NoPairings) if there is nothing to solve with.
 */
bool optimal_tf_olae(const Pairings& in, const WeightParameters& wp, OptimalTF_Result& result,
                     const std::optional<mrpt::poses::CPose3D>& guess = std::nullopt,
                     const OlaeParameters& parameters = {});

}  // namespace mp2p_icp
