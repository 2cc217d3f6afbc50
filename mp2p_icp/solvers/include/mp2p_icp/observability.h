#pragma once

#include <mp2p_icp/FreeTwist.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/PoseQuadratic.h>
#include <mp2p_icp/WeightParameters.h>
#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>

#include <limits>
#include <optional>
#include <vector>

namespace mp2p_icp
{
/// What pairings say on the pose at which they were made.
struct Observability
{
    int rank = 0;                 ///< how many of the 6 degrees of freedom the pairings determine
    std::vector<FreeTwist> free;  ///< 6 - rank motions that they do not
    /** The six principal motions, the least determined first: how well each one is known (information_ratio,
     * and sigma as predicted). The weak ones, say below a ratio of 1e-3, deserve a look although they are not
     * free.
     */
    std::vector<FreeTwist> motions;
    double residual_rms = 0;  ///< of the distances point to point, line or plane, m; 0 without pairings
    double sigma = 0;         ///< the standard deviation of one residual coordinate that was used, m

    /// Order x y z yaw pitch roll; 1/m^2, 1/(m rad), 1/rad^2. Exact also where the covariance is infinite.
    /// Zero if sigma is infinite.
    mrpt::math::CMatrixDouble66 information;
    /** Same order; m^2, m rad, rad^2. A coordinate with a component along a free motion has infinite
     * variance, and zeros beside it.
     */
    mrpt::math::CMatrixDouble66 covariance;
    /** The same on the tangent of SE(3) at the pose, which has no singular angles: order x y z and the
     * rotation vector (wx wy wz), in the global frame; a pose T' near T is R' = exp([w]x) R, t' = t + (x y
     * z).
     */
    mrpt::math::CMatrixDouble66 covariance_twist;
};

/// How observability() counts.
struct ObservabilityParameters
{
    /** Standard deviation of a residual coordinate of weight 1, m. Empty: estimated from the residuals,
     * sqrt(SS / (rows - rank)), and at least the rounding of coordinates; infinite when there are no more
     * rows than unknowns. With weights that are inverse variances it is 1.
     */
    std::optional<double> sigma;
    /// Standard deviation of the rounding of coordinates, m. Empty: that of float at the largest coordinate.
    std::optional<double> coordinate_rounding;
    PairWeights pair_weights;
    /// Motions that rotate are free if their predicted deviation is above this, rad.
    double largest_deviation = 0.5;

    /** What the pairings' own errors look like: pairings of points with planes along whose normals the
     * primitives of the pairings above are uncertain, weighted by the variances of that (rad^2, times the
     * weight of the pairing). Normals of a corridor's walls that are fitted to noisy points have components
     * along the corridor, whose squares add up; a motion is free unless its information is more than
     * `feigned_factor` times what they add up to. Null: none. Not for sums.
     */
    const Pairings* feigned = nullptr;
    double feigned_factor = 4;  ///< 1 is the mean; above it lies what few independent normals may give

    /** What else is known of the pose. It is added to the information, and a motion is not free if the prior
     * alone knows it to within `prior_deviation` (m; a rotation counts as the rms motion of the positions).
     */
    std::optional<mrpt::poses::CPose3DPDFGaussianInf> prior;
    double prior_deviation = std::numeric_limits<double>::infinity();
};

/** First-order analysis of all five kinds of pairings at `pose`: the information matrix J' W J / sigma^2 of
 * their residuals (a point on a point has 3 rows, on a line 2, on a plane 1; a line or plane also 2 of
 * direction), W being the weights of the kinds times those of the pairings, and its inverse, which is the
 * Cramer-Rao bound when the weights are inverse variances.
 *
 * A motion is free when, in units where a rotation of 1 rad counts as the rms distance of the positions from
 * their mean, its information is below 1e-10 of the largest (or below what the rounding of coordinates
 * or the errors of the primitives produce), or when its predicted deviation exceeds largest_deviation.
 *
 * Pairings with non-finite numbers are left out. \exception std::invalid_argument for negative weights. O(N);
 * the same bits on any number of threads.
 */
Observability observability(const Pairings& pairings, const mrpt::poses::CPose3D& pose,
                            const ObservabilityParameters& parameters = {});

/** The same of sums, whatever made them, in O(1). residual_rms is that of all rows then, weighted;
 * `pair_weights` has no effect, and coordinates are taken as no larger than the centroid's plus the scene's
 * radius.
 */
Observability observability(const PoseQuadratic& sums, const mrpt::poses::CPose3D& pose,
                            const ObservabilityParameters& parameters = {});

/// observability().residual_rms alone, in a fifth of the time.
double residual_rms(const Pairings& pairings, const mrpt::poses::CPose3D& pose,
                    const PairWeights& pair_weights = {});

/// observability().covariance: the covariance (x y z yaw pitch roll; m, rad) of the pose given its pairings.
mrpt::math::CMatrixDouble66 covariance(const Pairings& pairings, const mrpt::poses::CPose3D& pose,
                                       const ObservabilityParameters& parameters = {});

}  // namespace mp2p_icp
