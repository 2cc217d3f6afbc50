#pragma once

#include <mp2p_icp_filters/FilterBase.h>

#include <array>

namespace mp2p_icp_filters
{
/** Divides a cloud by the distance (m) of its points from a centre: range_min <= distance <= range_max, and
 * the others.
 *
 * A point exactly at a limit counts as between them. Distances and limits are compared as floats, as in
 * FilterBoundingBox, which also has the rules on fields, order, points that are not finite, and outputs.
 *
 * filter() throws std::runtime_error when formulas give range_min > range_max or a negative range. O(points).
 */
class FilterByRange : public FilterBase
{
    DEFINE_MRPT_OBJECT(FilterByRange, mp2p_icp_filters)

 public:
    FilterByRange();
    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
    void filter(mp2p_icp::metric_map_t& inOut) const override;

    std::string input_pointcloud_layer = mp2p_icp::metric_map_t::PT_LAYER_RAW;
    std::string output_layer_between;  ///< empty: not written
    std::string output_layer_outside;  ///< empty: not written
    mp2p_icp::Formula range_min, range_max;
    std::array<mp2p_icp::Formula, 3> center;
};

}  // namespace mp2p_icp_filters
