#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>

namespace mp2p_icp
{
/** Pairs each local point p with its nearest global points closer than a threshold: with d the distance at
 * the current pose, d^2 < threshold^2 + (thresholdAngular |p|)^2, where |p| is the point's distance from the
 * origin of the local frame (the sensor or robot), so that the allowance for a wrong heading grows with the
 * range.
 *
 * One-to-one by best pair, unless allowMatchAlreadyMatchedGlobalPoints. O(N log M) per call; searches never
 * go beyond the threshold.
 */
class Matcher_Points_DistanceThreshold : public Matcher_Points_Base
{
    DEFINE_MRPT_OBJECT(Matcher_Points_DistanceThreshold, mp2p_icp)

 public:
    Matcher_Points_DistanceThreshold()
    {
        mrpt::system::COutputLogger::setLoggerName("Matcher_Points_DistanceThreshold");
    }
    explicit Matcher_Points_DistanceThreshold(double distThreshold) : Matcher_Points_DistanceThreshold()
    {
        threshold = distThreshold;
    }

    Formula threshold = 0.50;           ///< m, > 0
    Formula thresholdAngularDeg = 0.0;  ///< degrees, >= 0
    Formula pairingsPerPoint = 1;       ///< whole number, >= 1

    void declare_parameters(ParameterDeclaration& declare) override;
    /// The threshold now, without the angular allowance.
    std::optional<double> gate(const MatchContext& context) const override;

 protected:
    void implMatchOneLayer(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                           const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                           MatchState& state, Pairings& out) const override;
};

}  // namespace mp2p_icp
