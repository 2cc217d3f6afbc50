#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>

namespace mp2p_icp
{
/** Pairs each local point with its nearest global one at whatever distance, and keeps the nearest fraction
 * `inliersRatio` of these pairs (the trimmed ICP of Chetverikov et al., 2002); then one-to-one by best pair,
 * unless allowMatchAlreadyMatchedGlobalPoints.
 */
class Matcher_Points_InlierRatio : public Matcher_Points_Base
{
    DEFINE_MRPT_OBJECT(Matcher_Points_InlierRatio, mp2p_icp)

 public:
    Matcher_Points_InlierRatio() { mrpt::system::COutputLogger::setLoggerName("Matcher_Points_InlierRatio"); }
    explicit Matcher_Points_InlierRatio(double ratio) : Matcher_Points_InlierRatio() { inliersRatio = ratio; }

    double inliersRatio = 0.80;  ///< in (0, 1)

    void declare_parameters(ParameterDeclaration& declare) override;

 protected:
    void implMatchOneLayer(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                           const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                           MatchState& state, Pairings& out) const override;
};

}  // namespace mp2p_icp
