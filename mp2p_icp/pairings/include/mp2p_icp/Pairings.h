#pragma once

#include <mp2p_icp/pairings_render_params.h>
#include <mp2p_icp/plane_patch.h>
#include <mrpt/containers/yaml.h>
#include <mrpt/math/TLine3D.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/tfest/TMatchingPair.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace mp2p_icp
{
/// A local point that lies on a global line.
struct point_line_pair_t
{
    mrpt::math::TLine3D ln_global;
    mrpt::math::TPoint3D pt_local;
};
/// A local point that lies on a global plane.
struct point_plane_pair_t
{
    plane_patch_t pl_global;
    mrpt::math::TPoint3D pt_local;
};
struct matched_line_t
{
    mrpt::math::TLine3D ln_global, ln_local;
};
struct matched_plane_t
{
    plane_patch_t p_global, p_local;
};

using MatchedPointLineList = std::vector<point_line_pair_t>;
using MatchedPointPlaneList = std::vector<point_plane_pair_t>;
using MatchedLineList = std::vector<matched_line_t>;
using MatchedPlaneList = std::vector<matched_plane_t>;

/** Point-point pairings in double. Takes the float ones and whole lists of them too, as MRPT produces them.
 */
class MatchedPointList : public mrpt::tfest::TMatchingPairListTempl<double>
{
 public:
    using base_list = mrpt::tfest::TMatchingPairListTempl<double>;
    using base_list::base_list;
    using base_list::push_back;
    void push_back(const mrpt::tfest::TMatchingPair& pair);
    void push_back(const mrpt::tfest::TMatchingPairList& pairs);
};

/** Weights of a list of pairings, as runs of (count, weight) in the order of the list; pairs beyond the runs
 * weigh 1, runs beyond the pairs mean nothing. Weights are dimensionless factors, not negative; they multiply
 * squared residuals. It is the solvers that refuse bad ones.
 */
using WeightRuns = std::vector<std::pair<size_t, double>>;

/// The weight of each of `count` pairs, the runs expanded.
std::vector<double> expanded_weights(const WeightRuns& runs, size_t count);

/** What matchers found and solvers use: pairs of primitives of the global and the local map. The sought pose
 * P of local with respect to global makes `P (+) local` fall on `global`. All coordinates in metres, each
 * side in its own frame.
 */
class Pairings
{
 public:
    Pairings() = default;
    virtual ~Pairings() = default;
    // Said out loud, as the destructor would otherwise turn moves into copies.
    Pairings(const Pairings&) = default;
    Pairings(Pairings&&) = default;
    Pairings& operator=(const Pairings&) = default;
    Pairings& operator=(Pairings&&) = default;

    MatchedPointList paired_pt2pt;
    MatchedPointLineList paired_pt2ln;
    MatchedPointPlaneList paired_pt2pl;
    MatchedLineList paired_ln2ln;
    MatchedPlaneList paired_pl2pl;

    /// Weights of paired_pt2pt, paired_pt2ln, ... in this order.
    WeightRuns point_weights, pt2ln_weights, pt2pl_weights, ln2ln_weights, pl2pl_weights;

    /// How many pairings there could have been at most: the denominator of the paired ratio.
    uint64_t potential_pairings = 0;

    virtual bool empty() const;
    virtual size_t size() const;
    /// Such as `12 point-point, 3 point-plane out of 20`.
    virtual std::string contents_summary() const;

    /// Appends pairings of all kinds, their weights and their potential count. Each pair keeps its weight.
    virtual void push_back(const Pairings& other);
    virtual void push_back(Pairings&& other);

    /// The weight of each paired_pt2pt, runs expanded.
    std::vector<double> expanded_point_weights() const;

    /// Writes version 1.
    virtual void serializeTo(mrpt::serialization::CArchive& out) const;
    /** Reads version 1, and version 0, in which only points had weights: all others then weigh 1.
     * \exception DataError on an unknown version, or counts beyond the data.
     */
    virtual void serializeFrom(mrpt::serialization::CArchive& in);

    /** Draws what is paired, in the frame of the global map, with local primitives moved by the pose. Each
     * kind that has something to draw is one set named as the kind (`pt2ln`), of up to three CSetOfLines
     * named `global` and `local` (primitives) and `residuals` (from the global side to the local one).
     *
     * Left out are whole pairings with numbers that are not finite (or too large for the floats of OpenGL) or
     * with a direction or normal of zero length; so a pose that is not finite draws nothing. Directions need
     * not be unit vectors.
     * \exception std::invalid_argument for a size in the parameters that is negative or not finite.
     */
    virtual std::shared_ptr<mrpt::opengl::CSetOfObjects> get_visualization(
        const mrpt::poses::CPose3D& localWrtGlobal, const pairings_render_params_t& p = {}) const;

    /// Segments from the global points to the local ones.
    virtual std::shared_ptr<mrpt::opengl::CSetOfObjects> get_visualization_pt2pt(
        const mrpt::poses::CPose3D& localWrtGlobal, const render_params_pairings_pt2pt_t& p) const;
    /// A piece of each line, centred where the perpendicular from the point meets it, and that perpendicular.
    virtual std::shared_ptr<mrpt::opengl::CSetOfObjects> get_visualization_pt2ln(
        const mrpt::poses::CPose3D& localWrtGlobal, const render_params_pairings_pt2ln_t& p) const;
    /// The border of a square around each centroid, and the perpendicular from its plane (the one through the
    /// centroid) to the point.
    virtual std::shared_ptr<mrpt::opengl::CSetOfObjects> get_visualization_pt2pl(
        const mrpt::poses::CPose3D& localWrtGlobal, const render_params_pairings_pt2pl_t& p) const;
    /// A piece of both lines, and the perpendicular from the global line to the base point of the local one;
    /// the pieces are centred at its ends.
    virtual std::shared_ptr<mrpt::opengl::CSetOfObjects> get_visualization_ln2ln(
        const mrpt::poses::CPose3D& localWrtGlobal, const render_params_pairings_ln2ln_t& p) const;
    /// The border of a square around both centroids, both normals, and a segment between the centroids.
    virtual std::shared_ptr<mrpt::opengl::CSetOfObjects> get_visualization_pl2pl(
        const mrpt::poses::CPose3D& localWrtGlobal, const render_params_pairings_pl2pl_t& p) const;
};

mrpt::serialization::CArchive& operator<<(mrpt::serialization::CArchive& out, const Pairings& obj);
mrpt::serialization::CArchive& operator>>(mrpt::serialization::CArchive& in, Pairings& obj);

}  // namespace mp2p_icp
