#pragma once

#include <mp2p_icp/Matcher.h>

namespace mp2p_icp
{
/** Pairs lines of the local map with lines of the global one (their `lines`; see FilterLines).
 *
 * Each local line looks for the nearest global one among those
 *  - whose direction is within an angle (lines have no sign);
 *  - that are nearer than the threshold. Their distance is measured across the mean of both directions, in
 * the middle of the piece that both were seen on, or where an extent is unknown in the middle between the
 * base points;
 *  - that overlap it, if the extents of both are known: they share at least minimumOverlap of the shorter
 * one, seen along the mean direction. Where they are not known, the base points may be at most
 * maxAlongDistance apart along that direction, if that is given.
 *
 * One to one: a global line keeps the nearest local one. Among equals the lower index wins. Lines with
 * numbers that are not finite, or without a direction, pair with nothing; a fit that is not sound counts as
 * none.
 *
 * weightByFit, pairAsPoints and unitWeightSigma mean what they mean for Matcher_Planes: a pairing's weight is
 * unitWeightSigma^2 over the variance of the distance between the lines along one direction across them (the
 * mean over directions, at the base point of the local line), and pairAsPoints gives for each pair of lines
 * four weighted pairings of points of the local line with planes through the global one.
 *
 * O(local lines x global lines). Needs no layer: maps without lines give no pairing. The result does not
 * depend on the number of threads: one is used.
 */
class Matcher_Lines : public Matcher
{
    DEFINE_MRPT_OBJECT(Matcher_Lines, mp2p_icp)

 public:
    Matcher_Lines() { mrpt::system::COutputLogger::setLoggerName("Matcher_Lines"); }

    Formula distanceThreshold = 0.50;  ///< m, > 0
    Formula angleThresholdDeg = 10.0;  ///< degrees, in (0, 90)
    Formula maxAlongDistance = 0.0;    ///< m; 0: no limit. Only where an extent is unknown
    double minimumOverlap = 0.10;      ///< in [0, 1]; 0: not checked
    bool weightByFit = true;
    bool pairAsPoints = false;
    double unitWeightSigma = 0.01;  ///< m, > 0: a distance with this standard deviation weighs 1

    void declare_parameters(ParameterDeclaration& declare) override;
    /// The distance threshold now.
    std::optional<double> gate(const MatchContext& context) const override;
    /// For each local line the least squared distance to a global line that may be paired with it, also if
    /// that serves several.
    std::vector<double> truncated_costs(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                        const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                                        MatchState& state, double gate) const override;

 protected:
    void impl_match(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                    const mrpt::poses::CPose3D& localPose, const MatchContext& context, MatchState& state,
                    Pairings& out) const override;
};

}  // namespace mp2p_icp
