#pragma once

#include <mp2p_icp_filters/FilterBase.h>
#include <mp2p_icp_filters/extract_planes.h>

#include <array>
#include <string>

namespace mp2p_icp_filters
{
/** Finds planes in a layer, see extract_planes(). Replaces `planes` of the map: those with most inliers
 * first, each with its fit (extent, inliers, noise, covariance) and its normal towards the sensor. The layer
 * output_layer_centroids gets one point per plane. A cloud without planes, or without points, gives none.
 */
class FilterPlanes : public FilterBase
{
    DEFINE_MRPT_OBJECT(FilterPlanes, mp2p_icp_filters)

 public:
    FilterPlanes();
    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
    void filter(mp2p_icp::metric_map_t& inOut) const override;

    std::string input_pointcloud_layer = mp2p_icp::metric_map_t::PT_LAYER_RAW;
    std::string output_layer_centroids = mp2p_icp::metric_map_t::PT_LAYER_PLANE_CENTROIDS;
    std::string output_layer_plane_points;  ///< the inliers of all planes; empty: not written
    std::string output_layer_other_points;  ///< all others that are finite; empty: not written
    PlaneParameters plane_parameters;
    /// x, y, z of the sensor in the frame of the layer, m.
    std::array<mp2p_icp::Formula, 3> sensor_position;
};

}  // namespace mp2p_icp_filters
