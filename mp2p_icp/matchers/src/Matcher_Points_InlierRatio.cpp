#include <mp2p_icp/Matcher_Points_InlierRatio.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nearest_candidates.h"

IMPLEMENTS_MRPT_OBJECT(Matcher_Points_InlierRatio, mp2p_icp::Matcher_Points_Base, mp2p_icp)

namespace mp2p_icp
{
void Matcher_Points_InlierRatio::declare_parameters(ParameterDeclaration& declare)
{
    Matcher_Points_Base::declare_parameters(declare);
    declare.number("inliersRatio", inliersRatio, "", Range::open(0, 1),
                   "fraction of the pairs to keep, the nearest ones", Need::Required);
}

namespace
{
/// The `count` nearest candidates (the lower local index among equals), in their order by local point.
void keep_nearest(std::vector<PairCandidate>& candidates, size_t count)
{
    const auto nearer = [](const PairCandidate& a, const PairCandidate& b)
    { return a.dist_sq < b.dist_sq || (a.dist_sq == b.dist_sq && a.local < b.local); };
    std::sort(candidates.begin(), candidates.end(), nearer);
    candidates.resize(std::min(count, candidates.size()));
    std::sort(candidates.begin(), candidates.end(),
              [](const PairCandidate& a, const PairCandidate& b) { return a.local < b.local; });
}
}  // namespace

void Matcher_Points_InlierRatio::implMatchOneLayer(const layer_name_t& globalLayer,
                                                   const layer_name_t& localLayer,
                                                   const mrpt::poses::CPose3D& localPose, const MatchContext&,
                                                   MatchState& state, Pairings& out) const
{
    const auto global = state.pcGlobal.point_layer(globalLayer);
    auto& s = nearest_scratch(*this, globalLayer, localLayer, state);
    transform_local_to_global(localLayer, localPose, state, s.local);
    out.potential_pairings += s.local.ids.size();
    if (s.local.ids.empty() || global->empty()) return;

    s.max_dist_sq.assign(s.local.ids.size(), std::numeric_limits<float>::infinity());
    const auto& paired = state.globalPairedBitField.point_layers.at(globalLayer);
    const bool shared = allowMatchAlreadyMatchedGlobalPoints_;
    find_candidates(1, shared ? nullptr : &paired, s);
    keep_nearest(s.candidates,
                 static_cast<size_t>(std::lround(inliersRatio * static_cast<double>(s.local.ids.size()))));
    if (!shared) keep_best_per_global(s.candidates, global->size(), s.best);
    append_pairings(globalLayer, localLayer, s, !shared, localPose, state, out);
}

}  // namespace mp2p_icp
