#pragma once

#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/QualityEvaluator.h>

namespace mp2p_icp
{
/** The share of the local points that have a pairing: pairings / potential pairings, clamped to 1. Below
 * absolute_minimum_pairing_ratio the alignment is discarded: no overlap. Without any potential pairing:
 * quality 0, discarded.
 */
class QualityEvaluator_PairedRatio : public QualityEvaluator
{
    DEFINE_MRPT_OBJECT(QualityEvaluator_PairedRatio, mp2p_icp)

 public:
    QualityEvaluator_PairedRatio()
    {
        mrpt::system::COutputLogger::setLoggerName("QualityEvaluator_PairedRatio");
    }

    bool reuse_icp_pairings = true;  ///< false: match anew, with `matcher`
    double absolute_minimum_pairing_ratio = 0.20;
    Matcher_Points_DistanceThreshold matcher;
    /// Of the global points, how many have a local one: the local map should show all that the global one
    /// does. `matcher` sees the maps exchanged, its `global` layers are local ones. Matches anew.
    bool exchange_maps = false;

    /// The keys of Matcher_Points_DistanceThreshold may be given too; then reuse_icp_pairings is false unless
    /// it says otherwise.
    void declare_parameters(ParameterDeclaration& declare) override;

    Result evaluate(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                    const mrpt::poses::CPose3D& localPose, const Pairings& pairingsFromICP,
                    const MatchContext& context) const override;
};

}  // namespace mp2p_icp
