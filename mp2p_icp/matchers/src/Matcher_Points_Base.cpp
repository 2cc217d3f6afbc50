#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/parallel.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <numeric>

#include "nearest_candidates.h"

IMPLEMENTS_VIRTUAL_MRPT_OBJECT(Matcher_Points_Base, mp2p_icp::Matcher, mp2p_icp)

namespace mp2p_icp
{
namespace
{
struct LayerMatch : public Parameterizable
{
    std::string global, local;
    double weight = 1;
    void declare_parameters(ParameterDeclaration& declare) override
    {
        declare.text("global", global, "layer of the global map", Need::Required);
        declare.text("local", local, "layer of the local map", Need::Required);
        declare.number("weight", weight, "", Range::not_negative(), "factor on the weight of their pairings");
    }
};

ParameterDeclaration::Entry layer_matches_entry(
    std::map<layer_name_t, std::map<layer_name_t, double>>& weights)
{
    const auto load = [&weights](const yaml::node_t& node, const YamlPlace& place)
    {
        if (!node.isSequence())
            throw ConfigError(place.text(&node) + ": expected a list of {global, local, weight}");
        weights.clear();
        for (size_t i = 0; i < node.size(); i++)
        {
            LayerMatch match;
            match.load_parameters(yaml(node.asSequence()[i]), place.item(i));
            if (!weights[match.global].emplace(match.local, match.weight).second)
                throw ConfigError(place.item(i).text(&node) + ": the layers '" + match.global + "' and '" +
                                  match.local + "' stand twice");
        }
    };
    const auto save = [&weights]()
    {
        yaml::node_t list = yaml::Sequence();
        for (const auto& [global, locals] : weights)
            for (const auto& [local, weight] : locals)
            {
                LayerMatch match;
                match.global = global, match.local = local, match.weight = weight;
                list.asSequence().push_back(match.save_parameters().node());
            }
        return list;
    };
    return {"pointLayerMatches",
            "list of {global, local, weight}",
            "",
            "",
            "which layers to match; default: layers of equal names",
            "",
            false,
            load,
            save};
}
}  // namespace

void Matcher_Points_Base::declare_parameters(ParameterDeclaration& declare)
{
    Matcher::declare_parameters(declare);
    declare.custom(layer_matches_entry(weight_pt2pt_layers));
    declare.integer("maxLocalPointsPerLayer", maxLocalPointsPerLayer_, Range::not_negative(),
                    "use a random subset of so many local points; 0: all");
    declare.integer("localPointsSampleSeed", localPointsSampleSeed_, Range::not_negative(),
                    "seed of the random subset");
    declare.flag("allowMatchAlreadyMatchedPoints", allowMatchAlreadyMatchedPoints_,
                 "also use local points that an earlier matcher of the list has paired");
    declare.flag("allowMatchAlreadyMatchedGlobalPoints", allowMatchAlreadyMatchedGlobalPoints_,
                 "let several local points pair with the same global point; false: only the nearest of them");
    declare.integer("kdtree_leaf_max_points", kdtree_leaf_max_points_, Range::not_negative(),
                    "leaf size of the KD-tree; 0: default");
    declare.number(
        "bounding_box_intersection_check_epsilon", bounding_box_intersection_check_epsilon_, "m",
        Range::not_negative(),
        "margin, on top of the matching distance, of the quick test for clouds that are far apart");
}

std::vector<Matcher_Points_Base::LayerPair> Matcher_Points_Base::layer_pairs(
    const metric_map_t& pcGlobal, const metric_map_t& pcLocal) const
{
    std::vector<LayerPair> pairs;
    for (const auto& [global, locals] : weight_pt2pt_layers)
        for (const auto& [local, weight] : locals) pairs.push_back({global, local, weight});
    if (!weight_pt2pt_layers.empty()) return pairs;
    for (const auto& [name, layer] : pcGlobal.layers)
    {
        const auto it = pcLocal.layers.find(name);
        if (it != pcLocal.layers.end() && MapToPointsMap(*layer) && MapToPointsMap(*it->second))
            pairs.push_back({name, name, 1.0});
    }
    return pairs;
}

void Matcher_Points_Base::impl_match(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                     const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                                     MatchState& state, Pairings& out) const
{
    for (const auto& layers : layer_pairs(pcGlobal, pcLocal))
    {
        const size_t before = out.paired_pt2pt.size();
        implMatchOneLayer(layers.global, layers.local, localPose, context, state, out);
        if (const size_t added = out.paired_pt2pt.size() - before; added > 0)
            out.point_weights.emplace_back(added, layers.weight);
    }
}

std::vector<double> Matcher_Points_Base::truncated_costs(const metric_map_t& pcGlobal,
                                                         const metric_map_t& pcLocal,
                                                         const mrpt::poses::CPose3D& localPose,
                                                         const MatchContext& context, MatchState& state,
                                                         double gate) const
{
    state.initialize();
    std::vector<double> costs;
    for (const auto& layers : layer_pairs(pcGlobal, pcLocal))
        append_costs(layers.global, layers.local, localPose, context, state, gate, costs);
    return costs;
}

void Matcher_Points_Base::append_costs(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                       const mrpt::poses::CPose3D& localPose, const MatchContext&,
                                       MatchState& state, double gate, std::vector<double>& costs) const
{
    auto& s = nearest_scratch(*this, globalLayer, localLayer, state);
    transform_local_to_global(localLayer, localPose, state, s.local);
    s.max_dist_sq.assign(s.local.ids.size(), static_cast<float>(gate * gate));
    find_candidates(1, nullptr, s);
    const size_t before = costs.size();
    costs.resize(before + s.local.ids.size(), gate * gate);
    for (const auto& c : s.candidates) costs[before + c.local] = static_cast<double>(c.dist_sq);
}

void Matcher_Points_Base::transform_local_to_global(const layer_name_t& localLayer,
                                                    const mrpt::poses::CPose3D& localPose,
                                                    const MatchState& state, LocalPoints& out,
                                                    const std::vector<uint32_t>* wanted) const
{
    const auto points = state.pcLocal.point_layer(localLayer);
    const auto& paired = state.localPairedBitField.point_layers.at(localLayer);
    const PointView all(*points);

    out.ids.resize(wanted ? wanted->size() : all.size);
    size_t count = 0;
    const auto take = [&, all](size_t i)
    {
        const bool finite = std::isfinite(all.x[i]) && std::isfinite(all.y[i]) && std::isfinite(all.z[i]);
        out.ids[count] = static_cast<uint32_t>(i);
        count += finite && (allowMatchAlreadyMatchedPoints_ || !paired[i]);
    };
    if (maxLocalPointsPerLayer_ > 0 && maxLocalPointsPerLayer_ < all.size)
    {
        for (const size_t i : random_subset(all.size, maxLocalPointsPerLayer_, localPointsSampleSeed_))
            if (!wanted || std::binary_search(wanted->begin(), wanted->end(), i)) take(i);
    }
    else if (wanted)
        for (const uint32_t i : *wanted) take(i);
    else
        for (size_t i = 0; i < all.size; i++) take(i);
    out.ids.resize(count);
    out.in_global.resize(count);
    const Eigen::Matrix3d R = rotation_of(localPose);
    const Eigen::Vector3d t = translation_of(localPose);
    const auto transform = [&, all](size_t first, size_t last)
    {
        float *const x = out.in_global.x.data(), *const y = out.in_global.y.data(),
                     *const z = out.in_global.z.data();
        for (size_t k = first; k < last; k++)
        {
            const uint32_t i = out.ids[k];
            const Eigen::Vector3d p =
                R * Eigen::Vector3d(double(all.x[i]), double(all.y[i]), double(all.z[i])) + t;
            x[k] = static_cast<float>(p.x()), y[k] = static_cast<float>(p.y()),
            z[k] = static_cast<float>(p.z());
        }
    };
    parallel_for_blocks(count, transform);
}

void keep_best_per_global(std::vector<PairCandidate>& candidates, size_t global_size,
                          std::vector<uint32_t>& best)
{
    constexpr uint32_t NONE = UINT32_MAX;
    if (best.size() != global_size) best.assign(global_size, NONE);  // all NONE between calls
    for (uint32_t c = 0; c < candidates.size(); c++)
    {
        uint32_t& winner = best[candidates[c].global_id];
        if (winner == NONE || candidates[c].dist_sq < candidates[winner].dist_sq) winner = c;
    }
    size_t kept = 0;
    std::vector<uint32_t> touched;
    for (uint32_t c = 0; c < candidates.size(); c++)
    {
        const PairCandidate candidate = candidates[c];
        touched.push_back(candidate.global_id);
        if (best[candidate.global_id] == c) candidates[kept++] = candidate;
    }
    candidates.resize(kept);
    for (const uint32_t g : touched) best[g] = NONE;
}

}  // namespace mp2p_icp
