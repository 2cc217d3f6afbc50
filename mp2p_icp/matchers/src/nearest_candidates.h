#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>

#include "tracked_nearest.h"

namespace mp2p_icp
{
/// Scratch memory of the point matchers on one pair of layers.
struct NearestScratch
{
    NearestNeighborIndex::ConstPtr index;  ///< of the global layer; maps do not change during a run
    mrpt::maps::CPointsMap::ConstPtr global;
    TrackedNearest tracked;
    LocalPoints local;
    std::vector<float> max_dist_sq, dist_sq;
    std::vector<uint32_t> ids, best;
    std::vector<PairCandidate> candidates;
};

/// Puts the global layer and its index at hand.
void prepare(NearestScratch& scratch, const Matcher_Points_Base& matcher, const layer_name_t& globalLayer,
             const layer_name_t& localLayer, MatchState& state);

/// The scratch memory of this matcher on these layers, prepared.
NearestScratch& nearest_scratch(const Matcher_Points_Base& matcher, const layer_name_t& globalLayer,
                                const layer_name_t& localLayer, MatchState& state);

/// The up to k nearest of each local point within its max_dist_sq, into scratch.ids and dist_sq, k for each.
void find_neighbors(uint32_t k, NearestScratch& scratch);

/// The same into scratch.candidates: by local point,
/// then by distance. Global points that are marked in `excluded` (may be null) are left out.
void find_candidates(uint32_t k, const std::vector<bool>* excluded, NearestScratch& scratch);

/// Appends the candidates as pairings and marks both points as paired.
void append_pairings(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                     const NearestScratch& scratch, bool mark_global, const mrpt::poses::CPose3D& localPose,
                     MatchState& state, Pairings& out);

}  // namespace mp2p_icp
