#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/metricmap.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/rtti/CObject.h>
#include <mrpt/system/COutputLogger.h>

#include <any>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <typeindex>
#include <vector>

namespace mp2p_icp
{
class Matcher;

/// What a run tells its matchers.
struct MatchContext
{
    uint32_t icpIteration = 0;
    RunVariables variables;  ///< for formulas
};

/// Which points of each cloud layer are paired already.
struct pointcloud_bitfield_t
{
    std::map<layer_name_t, std::vector<bool>> point_layers;

    void initialize_from(const metric_map_t& map);  ///< all false
};

/** What matchers remember, in one run: one object per align(), used by one thread at a time. Matchers
 * themselves stay const. */
class MatchState
{
 public:
    MatchState(const metric_map_t& global, const metric_map_t& local);

    const metric_map_t& pcGlobal;
    const metric_map_t& pcLocal;
    pointcloud_bitfield_t localPairedBitField, globalPairedBitField;

    /// The clouds of the global map in which neighbours of local points were looked for, and those of the
    /// local map; with the side (m) of the voxels in which their surfaces were seen, 0 if in none.
    std::map<layer_name_t, double> searched_global_layers, searched_local_layers;

    /// Forgets what is paired: call before each round of matching.
    void initialize();

    /// Scratch memory of one matcher on one pair of layers, one of each type, made by default at the first
    /// call, kept for the whole run.
    template <class Scratch>
    Scratch& scratch(const Matcher* matcher, const std::string& global_layer, const std::string& local_layer)
    {
        std::any& any = scratch_[{matcher, global_layer, local_layer, typeid(Scratch)}];
        if (!any.has_value()) any = std::make_shared<Scratch>();
        return *std::any_cast<std::shared_ptr<Scratch>&>(any);
    }

 private:
    std::map<std::tuple<const Matcher*, std::string, std::string, std::type_index>, std::any> scratch_;
};

/** Finds pairings between two maps at a pose. Configured once, const while running; one object may serve
 * several threads, each with a MatchState of its own.
 */
class Matcher : public mrpt::rtti::CObject, public mrpt::system::COutputLogger, public Parameterizable
{
    DEFINE_VIRTUAL_MRPT_OBJECT(Matcher)

 public:
    Matcher() : mrpt::system::COutputLogger("Matcher") {}

    uint32_t runFromIteration = 0;
    uint32_t runUpToIteration = 0;  ///< inclusive; 0: no limit
    bool enabled = true;

    /// \exception ConfigError
    void initialize(const yaml& params, const YamlPlace& place = {}) { load_parameters(params, place); }
    void declare_parameters(ParameterDeclaration& declare) override;

    bool is_active(const MatchContext& context) const;

    /** Appends the pairings at `localPose` (of local with respect to global) to `out`.
     * \return false if it is not this matcher's turn.
     * \exception std::invalid_argument for a layer named in the parameters that is missing.
     */
    bool match(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
               const mrpt::poses::CPose3D& localPose, const MatchContext& context, MatchState& state,
               Pairings& out) const;

    /// The distance (m) beyond which it never pairs two primitives, with the values of the formulas now.
    /// Empty: there is none.
    virtual std::optional<double> gate(const MatchContext&) const { return std::nullopt; }

    /** How well the maps fit at a pose, without the discrete effects of one-to-one selection: for each local
     * point, in the same order at every pose, the squared distance (m^2) to what it is paired with, also if
     * that serves several, and gate^2 if there is nothing within `gate` (m). Points are compared with points,
     * planes with planes: what cannot be told at a pose is NaN, and two poses are to be compared where
     * neither is. The default, for matchers of other kinds, counts their point-point pairings and gate^2 for
     * each pairing that there could have been.
     */
    virtual std::vector<double> truncated_costs(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                                const mrpt::poses::CPose3D& localPose,
                                                const MatchContext& context, MatchState& state,
                                                double gate) const;

 protected:
    virtual void impl_match(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                            const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                            MatchState& state, Pairings& out) const = 0;
};

using matcher_list_t = std::vector<Matcher::Ptr>;

/// One round of all matchers of the list, in their order.
Pairings run_matchers(const matcher_list_t& matchers, const metric_map_t& pcGlobal,
                      const metric_map_t& pcLocal, const mrpt::poses::CPose3D& localPose,
                      const MatchContext& context, MatchState& state);
/// \overload With a state of its own.
Pairings run_matchers(const matcher_list_t& matchers, const metric_map_t& pcGlobal,
                      const metric_map_t& pcLocal, const mrpt::poses::CPose3D& localPose,
                      const MatchContext& context);

}  // namespace mp2p_icp
