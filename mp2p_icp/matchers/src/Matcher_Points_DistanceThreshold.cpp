#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/numbers.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/TBoundingBox.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nearest_candidates.h"

IMPLEMENTS_MRPT_OBJECT(Matcher_Points_DistanceThreshold, mp2p_icp::Matcher_Points_Base, mp2p_icp)

namespace mp2p_icp
{
namespace
{
const Range PAIRINGS_PER_POINT = Range::between(1, 1000);
}

void Matcher_Points_DistanceThreshold::declare_parameters(ParameterDeclaration& declare)
{
    Matcher_Points_Base::declare_parameters(declare);
    declare.formula("threshold", threshold, "m", Range::positive(), "largest distance between paired points",
                    Need::Required);
    declare.formula(
        "thresholdAngularDeg", thresholdAngularDeg, "deg", Range::not_negative(),
        "allowance for a wrong heading: adds, in squares, this angle times the local point's range");
    declare.formula("pairingsPerPoint", pairingsPerPoint, "", PAIRINGS_PER_POINT,
                    "up to so many global points per local point");
}

std::optional<double> Matcher_Points_DistanceThreshold::gate(const MatchContext& context) const
{
    return checked_value(threshold, variables(context.variables), "threshold", Range::positive());
}

namespace
{
/// The largest allowed squared distance of each point.
float set_max_distances(const mrpt::maps::CPointsMap& local, double distance, double angle_rad,
                        NearestScratch& s)
{
    s.max_dist_sq.resize(s.local.ids.size());
    float largest = 0;
    for (size_t k = 0; k < s.local.ids.size(); k++)
    {
        const uint32_t i = s.local.ids[k];
        const double x = double(local.getPointsBufferRef_x()[i]), y = double(local.getPointsBufferRef_y()[i]),
                     z = double(local.getPointsBufferRef_z()[i]);
        s.max_dist_sq[k] =
            static_cast<float>(distance * distance + angle_rad * angle_rad * (x * x + y * y + z * z));
        largest = std::max(largest, s.max_dist_sq[k]);
    }
    return largest;
}

uint32_t whole_pairings_per_point(const Formula& formula, const RunVariables& variables)
{
    const double value = checked_value(formula, variables, "pairingsPerPoint", PAIRINGS_PER_POINT);
    if (value != std::floor(value))
        throw std::runtime_error("parameter 'pairingsPerPoint' = " + formula.text() + " gives " +
                                 to_text(value) + ", not a whole number");
    return static_cast<uint32_t>(value);
}

bool boxes_touch(const PointArrays& points, const mrpt::math::TBoundingBoxf& box, float margin)
{
    const auto overlap = [margin](const std::vector<float>& v, float lo, float hi)
    {
        const auto [least, most] = std::minmax_element(v.begin(), v.end());
        return *least <= hi + margin && *most >= lo - margin;
    };
    return overlap(points.x, box.min.x, box.max.x) && overlap(points.y, box.min.y, box.max.y) &&
           overlap(points.z, box.min.z, box.max.z);
}
}  // namespace

void Matcher_Points_DistanceThreshold::implMatchOneLayer(const layer_name_t& globalLayer,
                                                         const layer_name_t& localLayer,
                                                         const mrpt::poses::CPose3D& localPose,
                                                         const MatchContext& context, MatchState& state,
                                                         Pairings& out) const
{
    const RunVariables vars = variables(context.variables);
    const double distance = checked_value(threshold, vars, "threshold", Range::positive());
    const double angle_rad =
        mrpt::DEG2RAD(checked_value(thresholdAngularDeg, vars, "thresholdAngularDeg", Range::not_negative()));
    const uint32_t k = whole_pairings_per_point(pairingsPerPoint, vars);

    const auto global = state.pcGlobal.point_layer(globalLayer);
    auto& s = nearest_scratch(*this, globalLayer, localLayer, state);
    transform_local_to_global(localLayer, localPose, state, s.local);
    out.potential_pairings += s.local.ids.size() * k;
    const auto box = s.index->bounding_box();
    if (s.local.ids.empty() || !box) return;

    const float largest_sq =
        set_max_distances(*state.pcLocal.point_layer(localLayer), distance, angle_rad, s);
    const float margin = std::sqrt(largest_sq) + static_cast<float>(bounding_box_intersection_check_epsilon_);
    if (!boxes_touch(s.local.in_global, *box, margin)) return;

    const auto& paired = state.globalPairedBitField.point_layers.at(globalLayer);
    const bool shared = allowMatchAlreadyMatchedGlobalPoints_;
    find_candidates(k, shared ? nullptr : &paired, s);
    if (!shared) keep_best_per_global(s.candidates, global->size(), s.best);
    append_pairings(globalLayer, localLayer, s, !shared, localPose, state, out);
}

}  // namespace mp2p_icp
