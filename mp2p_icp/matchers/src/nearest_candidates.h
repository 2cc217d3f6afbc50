#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>

namespace mp2p_icp
{
/// Scratch memory of the point matchers on one pair of layers.
struct NearestScratch
{
    NearestNeighborIndex::ConstPtr index;  ///< of the global layer; maps do not change during a run
    LocalPoints local;
    std::vector<float> max_dist_sq, dist_sq;
    std::vector<uint32_t> ids, best;
    std::vector<PairCandidate> candidates;
};

/// The scratch memory of this matcher on these layers, with the index at hand.
NearestScratch& nearest_scratch(const Matcher_Points_Base& matcher, const layer_name_t& globalLayer,
                                const layer_name_t& localLayer, MatchState& state);

/// The up to k nearest of each local point within its max_dist_sq, into scratch.candidates: by local point,
/// then by distance. Global points that are marked in `excluded` (may be null) are left out.
void find_candidates(uint32_t k, const std::vector<bool>* excluded, NearestScratch& scratch);

/// Appends the candidates as pairings and marks both points as paired.
void append_pairings(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                     const NearestScratch& scratch, bool mark_global, const mrpt::poses::CPose3D& localPose,
                     MatchState& state, Pairings& out);

}  // namespace mp2p_icp
