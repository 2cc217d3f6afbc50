#pragma once

#include <mp2p_icp/Matcher.h>

namespace mp2p_icp
{
/** Pairs planes of the local map with planes of the global one (their `planes`; see FilterPlanes).
 *
 * Each local plane looks for the global one with the nearest centroid among those
 *  - whose normal, which points towards the sensor, is within an angle: the two sides of a wall never match;
 *  - that are near: the distance of the centroids along the mean of both normals is below the threshold (for
 *    two planes at an angle this is what separates them in the middle between the centroids);
 *  - that overlap it, if the extents of both are known: the box of the local one, laid onto the global plane,
 *    shares at least minimumOverlap of the smaller box. Where they are not known, centroids must be within
 *    maxCentroidDistance, if that is given.
 *
 * One to one: a global plane keeps the local one with the nearest centroid. Among equals the lower index
 * wins. Planes with numbers that are not finite, or without a normal, pair with nothing; a fit that is not
 * sound counts as none.
 *
 * Weights: if both fits are known, a pairing counts as much as unitWeightSigma^2 over the variance of the
 * distance between the two planes; otherwise, or without weightByFit, 1. So weights of several matchers
 * agree.
 *
 * One weight cannot tell that a plane's place is known well, and its normal along one direction better than
 * along the other. pairAsPoints does: in place of the plane-plane pairing it gives four weighted pairings of
 * points of the local plane with the global one, such that least squares over them is the maximum-likelihood
 * pose, to first order. Where a fit is not known, the plane-plane pairing stays.
 *
 * O(local planes x global planes). Needs no layer: maps without planes give no pairing. The result does not
 * depend on the number of threads: one is used.
 */
class Matcher_Planes : public Matcher
{
    DEFINE_MRPT_OBJECT(Matcher_Planes, mp2p_icp)

 public:
    Matcher_Planes() { mrpt::system::COutputLogger::setLoggerName("Matcher_Planes"); }

    Formula distanceThreshold = 0.50;   ///< m, > 0; along the normal
    Formula angleThresholdDeg = 10.0;   ///< degrees, in (0, 90)
    Formula maxCentroidDistance = 0.0;  ///< m; 0: no limit. Only where an extent is unknown
    double minimumOverlap = 0.10;       ///< in [0, 1]; 0: not checked
    bool weightByFit = true;
    bool pairAsPoints = false;
    double unitWeightSigma = 0.01;  ///< m, > 0: a distance with this standard deviation weighs 1

    void declare_parameters(ParameterDeclaration& declare) override;
    /// The distance threshold now.
    std::optional<double> gate(const MatchContext& context) const override;
    /// For each local plane the least squared distance along the normals to a global plane that may be paired
    /// with it, also if that serves several.
    std::vector<double> truncated_costs(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                        const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                                        MatchState& state, double gate) const override;

 protected:
    void impl_match(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                    const mrpt::poses::CPose3D& localPose, const MatchContext& context, MatchState& state,
                    Pairings& out) const override;
};

}  // namespace mp2p_icp
