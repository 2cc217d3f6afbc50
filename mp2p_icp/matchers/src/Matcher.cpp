#include <mp2p_icp/Matcher.h>

#include <algorithm>

IMPLEMENTS_VIRTUAL_MRPT_OBJECT(Matcher, mrpt::rtti::CObject, mp2p_icp)

namespace mp2p_icp
{
void pointcloud_bitfield_t::initialize_from(const metric_map_t& map)
{
    for (const auto& [name, layer] : map.layers)
        if (const auto* points = MapToPointsMap(*layer)) point_layers[name].assign(points->size(), false);
}

MatchState::MatchState(const metric_map_t& global, const metric_map_t& local)
    : pcGlobal(global), pcLocal(local)
{
    initialize();
}

void MatchState::initialize()
{
    localPairedBitField.initialize_from(pcLocal);
    globalPairedBitField.initialize_from(pcGlobal);
}

void Matcher::declare_parameters(ParameterDeclaration& declare)
{
    declare.integer("runFromIteration", runFromIteration, Range::not_negative(),
                    "first ICP iteration (from 0) in which it is used");
    declare.integer("runUpToIteration", runUpToIteration, Range::not_negative(),
                    "last ICP iteration in which it is used; 0: no limit");
    declare.flag("enabled", enabled, "false: as if it were not in the list");
}

bool Matcher::is_active(const MatchContext& context) const
{
    return enabled && context.icpIteration >= runFromIteration &&
           (runUpToIteration == 0 || context.icpIteration <= runUpToIteration);
}

bool Matcher::match(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                    const mrpt::poses::CPose3D& localPose, const MatchContext& context, MatchState& state,
                    Pairings& out) const
{
    if (!is_active(context)) return false;
    Pairings found;
    impl_match(pcGlobal, pcLocal, localPose, context, state, found);
    out.push_back(std::move(found));
    return true;
}

std::vector<double> Matcher::truncated_costs(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                             const mrpt::poses::CPose3D& localPose,
                                             const MatchContext& context, MatchState& state,
                                             double gate) const
{
    state.initialize();
    Pairings found;
    impl_match(pcGlobal, pcLocal, localPose, context, state, found);
    std::vector<double> costs;
    for (const auto& pair : found.paired_pt2pt)
        costs.push_back(std::min(pair.errorSquareAfterTransformation, gate * gate));
    costs.resize(std::max<size_t>(found.potential_pairings, costs.size()), gate * gate);
    return costs;
}

Pairings run_matchers(const matcher_list_t& matchers, const metric_map_t& pcGlobal,
                      const metric_map_t& pcLocal, const mrpt::poses::CPose3D& localPose,
                      const MatchContext& context, MatchState& state)
{
    state.initialize();
    Pairings out;
    for (const auto& matcher : matchers) matcher->match(pcGlobal, pcLocal, localPose, context, state, out);
    return out;
}

Pairings run_matchers(const matcher_list_t& matchers, const metric_map_t& pcGlobal,
                      const metric_map_t& pcLocal, const mrpt::poses::CPose3D& localPose,
                      const MatchContext& context)
{
    MatchState state(pcGlobal, pcLocal);
    return run_matchers(matchers, pcGlobal, pcLocal, localPose, context, state);
}

}  // namespace mp2p_icp
