#pragma once

#include <mp2p_icp/Matcher.h>

namespace mp2p_icp
{
/// Says how good an alignment looks.
class QualityEvaluator : public mrpt::rtti::CObject,
                         public mrpt::system::COutputLogger,
                         public Parameterizable
{
    DEFINE_VIRTUAL_MRPT_OBJECT(QualityEvaluator)

 public:
    QualityEvaluator() : mrpt::system::COutputLogger("QualityEvaluator") {}

    struct Result
    {
        double quality = 0;         ///< 0 (worst) .. 1 (best)
        bool hard_discard = false;  ///< there is no overlap worth the name: the total quality becomes 0
    };

    bool enabled = true;

    void initialize(const yaml& params, const YamlPlace& place = {}) { load_parameters(params, place); }

    /// \param pairingsFromICP those at `localPose`.
    virtual Result evaluate(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                            const mrpt::poses::CPose3D& localPose, const Pairings& pairingsFromICP,
                            const MatchContext& context) const = 0;
};

}  // namespace mp2p_icp
