#pragma once

#include <mp2p_icp/IterTermReason.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/observability.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp
{
/** What an ICP run found, and how far it can be trusted.
 *
 * `optimal_tf.mean` is the pose that was found for the verdicts `aligned` and `under_constrained`. For all
 * others it is the guess, bit by bit, the pose that was found (if any) is in `rejected_pose`, and the
 * covariance is infinite: nothing was learnt. finalPairings, overlap, quality, residual_rms and unobservable
 * belong to `optimal_tf.mean`: matched once more at the end.
 *
 * What is observable is judged by surfaces, whatever the matchers pair: a point that is paired with one of a
 * cloud counts as lying on the plane or line that the cloud looks like there. Along `unobservable` motions,
 * the pose is that of the guess.
 */
struct Results
{
    /** Pose of local with respect to global; covariance order x y z yaw pitch roll, m and rad, infinite where
     * unobservable. First-order, from the scatter of the final pairings about their surfaces, each taken as
     * an independent measurement, and the prior. Pairings of nearest points of separately sampled surfaces
     * are not independent: there the standard deviations are a lower bound, and the errors measured were 3 to
     * 6 times (2-D yaw: up to 18 times) as large.
     */
    mrpt::poses::CPose3DPDFGaussian optimal_tf;
    /// Same order. Exact also where the covariance is infinite.
    mrpt::math::CMatrixDouble66 information;
    double optimalScale = 1.0;

    Verdict verdict = Verdict::failed;
    std::string verdict_reason;  ///< one sentence
    std::optional<mrpt::poses::CPose3D> rejected_pose;
    /// Motions that neither the surfaces nor the prior determine (a prior does that where it knows a motion
    /// to within the final matching distance).
    std::vector<FreeTwist> unobservable;

    size_t nIterations = 0;  ///< how many times pairings were solved
    IterTermReason terminationReason = IterTermReason::Undefined;
    double quality = 0;       ///< 0..1
    double overlap = 0;       ///< share of what could have been paired that is paired, 0..1
    double residual_rms = 0;  ///< of the final pairings' distances, m

    /// Mean truncated squared residual (Matcher::truncated_costs(), m^2) at the guess, and where the
    /// iterations ended, over the local points for which the matchers know it at both.
    double cost_at_guess = 0, cost_at_end = 0;

    uint64_t local_points_used = 0;  ///< that the matchers considered at the end
    Pairings finalPairings;

    /// How many of the 6 degrees of freedom are known.
    int rank() const { return 6 - static_cast<int>(unobservable.size()); }
    bool trusted() const { return verdict == Verdict::aligned; }

    void print(std::ostream& out) const;
    void serializeTo(mrpt::serialization::CArchive& out) const;
    void serializeFrom(mrpt::serialization::CArchive& in);
};

}  // namespace mp2p_icp
