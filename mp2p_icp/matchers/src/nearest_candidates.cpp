#include "nearest_candidates.h"

#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

namespace mp2p_icp
{
void prepare(NearestScratch& s, const Matcher_Points_Base& matcher, const layer_name_t& globalLayer,
             const layer_name_t& localLayer, MatchState& state)
{
    if (s.index) return;
    state.searched_global_layers.emplace(globalLayer, 0), state.searched_local_layers.emplace(localLayer, 0);
    s.global = state.pcGlobal.point_layer(globalLayer);
    s.index = state.pcGlobal.nn_index(globalLayer, matcher.kdtree_leaf_max_points_);
}

NearestScratch& nearest_scratch(const Matcher_Points_Base& matcher, const layer_name_t& globalLayer,
                                const layer_name_t& localLayer, MatchState& state)
{
    auto& s = state.scratch<NearestScratch>(&matcher, globalLayer, localLayer);
    prepare(s, matcher, globalLayer, localLayer, state);
    return s;
}

void find_neighbors(uint32_t k, NearestScratch& s)
{
    if (k == 1) return s.tracked.find(*s.index, *s.global, s.local, s.max_dist_sq.data(), s.ids, s.dist_sq);
    const size_t n = s.local.ids.size();
    s.ids.resize(n * k), s.dist_sq.resize(n * k);
    parallel_for_blocks(n,
                        [&](size_t first, size_t last)
                        {
                            s.index->nearest(s.local.in_global, first, last, k, s.max_dist_sq.data(),
                                             s.ids.data(), s.dist_sq.data());
                        });
}

void find_candidates(uint32_t k, const std::vector<bool>* excluded, NearestScratch& s)
{
    find_neighbors(k, s);
    const size_t n = s.local.ids.size();
    s.candidates.clear();
    for (size_t i = 0; i < n; i++)
        for (size_t j = i * k; j < (i + 1) * k && s.ids[j] != NO_NEIGHBOR; j++)
            if (!excluded || !(*excluded)[s.ids[j]])
                s.candidates.push_back({static_cast<uint32_t>(i), s.ids[j], s.dist_sq[j]});
}

void append_pairings(const layer_name_t& globalLayer, const layer_name_t& localLayer, const NearestScratch& s,
                     bool mark_global, const mrpt::poses::CPose3D& localPose, MatchState& state,
                     Pairings& out)
{
    const auto global = state.pcGlobal.point_layer(globalLayer),
               local = state.pcLocal.point_layer(localLayer);
    auto& global_paired = state.globalPairedBitField.point_layers.at(globalLayer);
    auto& local_paired = state.localPairedBitField.point_layers.at(localLayer);
    const Eigen::Matrix3d R = rotation_of(localPose);
    const Eigen::Vector3d t = translation_of(localPose);
    const auto point = [](const mrpt::maps::CPointsMap& map, uint32_t i)
    {
        return mrpt::math::TPoint3D(double(map.getPointsBufferRef_x()[i]),
                                    double(map.getPointsBufferRef_y()[i]),
                                    double(map.getPointsBufferRef_z()[i]));
    };
    for (const auto& c : s.candidates)
    {
        const uint32_t local_id = s.local.ids[c.local];
        mrpt::tfest::TMatchingPair_d pair(c.global_id, local_id, point(*global, c.global_id),
                                          point(*local, local_id));
        pair.errorSquareAfterTransformation =
            (R * to_eigen(pair.local) + t - to_eigen(pair.global)).squaredNorm();
        out.paired_pt2pt.push_back(pair);
        local_paired[local_id] = true;
        if (mark_global) global_paired[c.global_id] = true;
    }
}

}  // namespace mp2p_icp
