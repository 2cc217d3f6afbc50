#pragma once

#include <mp2p_icp/icp_pipeline_from_yaml.h>

namespace mp2p_icp_bench
{
/// A cloud of a map.
struct CloudLayer
{
    const mp2p_icp::metric_map_t& map;
    std::string name;
};

/// The share of the local points, moved by the pose, with a global one within so many metres.
double overlap(const CloudLayer& local, const CloudLayer& global, const mrpt::poses::CPose3D& pose,
               double metres);

/// The overlap for the first matcher of points in a pipeline, within its distance at the first iteration.
/// \exception std::invalid_argument if it has none.
double overlap_at_first(const mp2p_icp::Pipeline& pipeline, const mp2p_icp::metric_map_t& local,
                        const mp2p_icp::metric_map_t& global, const mrpt::poses::CPose3D& guess);
}  // namespace mp2p_icp_bench
