#pragma once

#include <mp2p_icp_filters/FilterBase.h>
#include <mp2p_icp_filters/extract_poles.h>
#include <mp2p_icp_filters/extract_segments_2d.h>
#include <mp2p_icp_filters/intersect_planes.h>

#include <array>
#include <string>

namespace mp2p_icp_filters
{
/** Finds lines in a layer. Replaces `lines` of the map, each with its fit (extent, inliers, noise,
 * covariance):
 *  - of a 3-D cloud the lines in which the `planes` of the map meet (see intersect_planes(); run FilterPlanes
 *    on the same layer before), and then poles (see extract_poles());
 *  - with scan_2d, of a scan of a 2-D laser its walls (see extract_segments_2d()); their corners go, as
 * points, into the layer output_layer_corners. A layer without points gives none.
 */
class FilterLines : public FilterBase
{
    DEFINE_MRPT_OBJECT(FilterLines, mp2p_icp_filters)

 public:
    FilterLines();
    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
    void filter(mp2p_icp::metric_map_t& inOut) const override;

    std::string input_pointcloud_layer = mp2p_icp::metric_map_t::PT_LAYER_RAW;
    std::string output_layer_corners;      ///< empty: not written
    std::string output_layer_pole_points;  ///< the inliers of all poles; empty: not written
    bool scan_2d = false;
    bool intersect = true;   ///< 3-D clouds: lines in which planes meet?
    bool find_poles = true;  ///< 3-D clouds: poles?
    IntersectionParameters intersection_parameters;
    PoleParameters pole_parameters;
    SegmentParameters segment_parameters;
    /// x, y, z of the sensor in the frame of the layer, m.
    std::array<mp2p_icp::Formula, 3> sensor_position;
};

}  // namespace mp2p_icp_filters
