#pragma once

#include <mp2p_icp/metricmap.h>
#include <mrpt/poses/CPose3D.h>

#include <string>

namespace mp2p_icp_apps
{
/** A pose between two maps, given in their original coordinates, as the pose between the coordinates that the
 * maps store (see metric_map_t::coordinate_offset()). In double.
 */
mrpt::poses::CPose3D pose_between_stored(const mrpt::poses::CPose3D& T_global_local,
                                         const mp2p_icp::metric_map_t& local,
                                         const mp2p_icp::metric_map_t& global);

/// The cloud layer that stands for a whole map: `raw` if there is one, else the first by name that has
/// points. \exception std::invalid_argument if there is none.
std::string main_cloud_layer(const mp2p_icp::metric_map_t& map);

/** main_cloud_layer() of the local map, with all fields of its points, moved into the global map's frame and
 * stored with the global map's offset. \param T_global_local in original coordinates
 */
mp2p_icp::metric_map_t aligned_cloud(const mp2p_icp::metric_map_t& local,
                                     const mp2p_icp::metric_map_t& global,
                                     const mrpt::poses::CPose3D& T_global_local);

}  // namespace mp2p_icp_apps
