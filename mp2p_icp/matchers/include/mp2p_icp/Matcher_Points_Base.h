#pragma once

#include <mp2p_icp/Matcher.h>

namespace mp2p_icp
{
/// The local points that a matcher works on, and where they fall at a pose. Part of the run's scratch memory.
struct LocalPoints
{
    std::vector<uint32_t> ids;  ///< into the local layer, increasing
    PointArrays in_global;      ///< one per id
};

/** Common part of the matchers from points to what is near them in another cloud. */
class Matcher_Points_Base : public Matcher
{
    DEFINE_VIRTUAL_MRPT_OBJECT(Matcher_Points_Base)

 public:
    /// weight_pt2pt_layers[global layer][local layer] = factor on the weight of their pairings. Empty: layers
    /// of equal names, weight 1.
    std::map<layer_name_t, std::map<layer_name_t, double>> weight_pt2pt_layers;

    uint32_t maxLocalPointsPerLayer_ =
        0;  ///< 0: all; otherwise a random subset of so many, the same during a run
    uint32_t localPointsSampleSeed_ = 0;
    bool allowMatchAlreadyMatchedPoints_ = false;
    bool allowMatchAlreadyMatchedGlobalPoints_ = false;
    uint32_t kdtree_leaf_max_points_ = 0;  ///< 0: the default
    double bounding_box_intersection_check_epsilon_ = 0.20;

    void declare_parameters(ParameterDeclaration& declare) override;
    std::vector<double> truncated_costs(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                        const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                                        MatchState& state, double gate) const override;

    /// The pairs of layers to match, with their weights.
    struct LayerPair
    {
        layer_name_t global, local;
        double weight;
    };
    /// Those of `pointLayerMatches`, also if a layer is missing; else all cloud layers with equal names.
    std::vector<LayerPair> layer_pairs(const metric_map_t& pcGlobal, const metric_map_t& pcLocal) const;

 protected:
    /// Offers every pair of layers to implMatchOneLayer(). Layers named in weight_pt2pt_layers must exist on
    /// both sides.
    void impl_match(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                    const mrpt::poses::CPose3D& localPose, const MatchContext& context, MatchState& state,
                    Pairings& out) const override;

    /// Appends point pairings, and their potential count; weights are added by the caller.
    virtual void implMatchOneLayer(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                   const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                                   MatchState& state, Pairings& out) const = 0;

    /** Appends the truncated_costs() of one pair of layers. The default: distances to the nearest global
     * points. */
    virtual void append_costs(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                              const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                              MatchState& state, double gate, std::vector<double>& costs) const;

    /// The points of the layer to be matched (subsampled, without already paired ones unless allowed), moved
    /// to the global frame. \param wanted those that are, by increasing index, if not all
    void transform_local_to_global(const layer_name_t& localLayer, const mrpt::poses::CPose3D& localPose,
                                   const MatchState& state, LocalPoints& out,
                                   const std::vector<uint32_t>* wanted = nullptr) const;
};

/// A local point (index into LocalPoints) and a global point, with their squared distance.
struct PairCandidate
{
    uint32_t local;
    uint32_t global_id;
    float dist_sq;
};

/** One-to-one selection by best pair: of the candidates of one global point, the nearest stays (the lower
 * local index among equals), in the given order. `best` is scratch memory.
 */
void keep_best_per_global(std::vector<PairCandidate>& candidates, size_t global_size,
                          std::vector<uint32_t>& best);

}  // namespace mp2p_icp
