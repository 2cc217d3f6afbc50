#include <mp2p_icp/QualityEvaluator_PairedRatio.h>

#include <algorithm>

IMPLEMENTS_VIRTUAL_MRPT_OBJECT(QualityEvaluator, mrpt::rtti::CObject, mp2p_icp)
IMPLEMENTS_MRPT_OBJECT(QualityEvaluator_PairedRatio, mp2p_icp::QualityEvaluator, mp2p_icp)

namespace mp2p_icp
{
void QualityEvaluator_PairedRatio::declare_parameters(ParameterDeclaration& declare)
{
    auto given = std::make_shared<bool>(false);        // reuse_icp_pairings stands in the YAML
    auto own_matcher = std::make_shared<bool>(false);  // a key of the matcher stands there
    ParameterDeclaration own;
    own.flag("reuse_icp_pairings", reuse_icp_pairings,
             "use the pairings of ICP; false: match anew with the keys below");
    auto reuse = own.entries().front();
    reuse.load = [given, load = reuse.load](const auto& node, const auto& place)
    { *given = true, load(node, place); };
    declare.custom(reuse);
    declare.flag("exchange_maps", exchange_maps,
                 "match the global points with the local map; 'global' layers below are then local ones");
    declare.number("absolute_minimum_pairing_ratio", absolute_minimum_pairing_ratio, "", Range::between(0, 1),
                   "with a smaller share of paired points there is no overlap");

    ParameterDeclaration of_matcher;
    matcher.declare_parameters(of_matcher);
    for (auto entry : of_matcher.entries())
    {
        entry.required = false;
        entry.load = [own_matcher, load = entry.load](const auto& node, const auto& place)
        { *own_matcher = true, load(node, place); };
        entry.save = [this, save = entry.save]() { return reuse_icp_pairings ? yaml::node_t() : save(); };
        declare.custom(entry);
    }
    declare.rule(
        [this, given, own_matcher]() -> std::string
        {
            if (*own_matcher && !*given) reuse_icp_pairings = false;
            if (*own_matcher && reuse_icp_pairings)
                return "keys of the matcher have no effect with 'reuse_icp_pairings: true'; remove one or "
                       "the other";
            if (exchange_maps && reuse_icp_pairings)
                return "'exchange_maps: true' needs the keys of a matcher of its own";
            return {};
        });
}

QualityEvaluator::Result QualityEvaluator_PairedRatio::evaluate(const metric_map_t& pcGlobal,
                                                                const metric_map_t& pcLocal,
                                                                const mrpt::poses::CPose3D& localPose,
                                                                const Pairings& pairingsFromICP,
                                                                const MatchContext& context) const
{
    Pairings fresh;
    if (!reuse_icp_pairings)
    {
        const metric_map_t &to = exchange_maps ? pcLocal : pcGlobal,
                           &from = exchange_maps ? pcGlobal : pcLocal;
        MatchState state(to, from);
        matcher.match(to, from, exchange_maps ? -localPose : localPose, context, state, fresh);
    }
    const Pairings& pairings = reuse_icp_pairings ? pairingsFromICP : fresh;
    if (pairings.potential_pairings == 0) return {0.0, true};
    const double ratio =
        static_cast<double>(pairings.size()) / static_cast<double>(pairings.potential_pairings);
    return {std::min(1.0, ratio), pairings.empty() || ratio < absolute_minimum_pairing_ratio};
}

}  // namespace mp2p_icp
