#pragma once

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

struct pairings_render_params_t
{
    bool pt2pt = true;
    mrpt::img::TColor pt2pt_color{0x00, 0xa0, 0x00, 0xff};
};

/** What matchers found and solvers use: pairs of primitives of the global and the local map. The sought pose
 * P of local with respect to global makes `P (+) local` fall on `global`. All coordinates in metres, each
 * side in its own frame.
 */
class Pairings
{
 public:
    virtual ~Pairings() = default;

    MatchedPointList paired_pt2pt;
    MatchedPointLineList paired_pt2ln;
    MatchedPointPlaneList paired_pt2pl;
    MatchedLineList paired_ln2ln;
    MatchedPlaneList paired_pl2pl;

    /** Weights of paired_pt2pt, as runs of (count, weight) in their order; pairs beyond the runs weigh 1.
     * Weights are dimensionless factors, not negative; they multiply squared residuals.
     */
    std::vector<std::pair<size_t, double>> point_weights;

    /// How many pairings there could have been at most: the denominator of the paired ratio.
    uint64_t potential_pairings = 0;

    virtual bool empty() const;
    virtual size_t size() const;
    /// Such as `12 point-point, 3 point-plane out of 20`.
    virtual std::string contents_summary() const;

    /// Appends pairings, their weights and their potential count.
    virtual void push_back(const Pairings& other);
    virtual void push_back(Pairings&& other);

    /// The weight of each paired_pt2pt, runs expanded.
    std::vector<double> expanded_point_weights() const;

    virtual void serializeTo(mrpt::serialization::CArchive& out) const;
    /// \exception DataError on an unknown version, or counts beyond the data.
    virtual void serializeFrom(mrpt::serialization::CArchive& in);

    /// Segments between paired points, the local ones moved by the pose.
    virtual std::shared_ptr<mrpt::opengl::CSetOfObjects> get_visualization(
        const mrpt::poses::CPose3D& localWrtGlobal, const pairings_render_params_t& p = {}) const;
};

mrpt::serialization::CArchive& operator<<(mrpt::serialization::CArchive& out, const Pairings& obj);
mrpt::serialization::CArchive& operator>>(mrpt::serialization::CArchive& in, Pairings& obj);

}  // namespace mp2p_icp
