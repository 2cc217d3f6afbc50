#pragma once

#include <mp2p_icp_filters/FilterBase.h>

#include <array>

namespace mp2p_icp_filters
{
/** Divides a cloud into the points inside an axis-aligned box and those outside, and writes either part, or
 * both, to a layer.
 *
 * A point exactly on a face is inside. Coordinates and limits (m) are compared as floats, so that a point
 * stored from 0.1 lies on the limit 0.1. All fields of the points, their order and the class of the cloud are
 * kept; points that are not finite go to neither part. Outputs replace layers of the same name; the input may
 * be one of them. An empty input gives empty outputs.
 *
 * filter() throws std::runtime_error when formulas give a minimum above its maximum. O(points).
 */
class FilterBoundingBox : public FilterBase
{
    DEFINE_MRPT_OBJECT(FilterBoundingBox, mp2p_icp_filters)

 public:
    FilterBoundingBox();
    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
    void filter(mp2p_icp::metric_map_t& inOut) const override;

    std::string input_pointcloud_layer = mp2p_icp::metric_map_t::PT_LAYER_RAW;
    std::string inside_pointcloud_layer;   ///< empty: not written
    std::string outside_pointcloud_layer;  ///< empty: not written
    std::array<mp2p_icp::Formula, 3> bounding_box_min, bounding_box_max;
};

}  // namespace mp2p_icp_filters
