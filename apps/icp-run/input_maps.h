#pragma once

#include <mp2p_icp/load_map.h>
#include <mp2p_icp_filters/Generator.h>

#include <string>

namespace mp2p_icp_apps
{
/** One input of an alignment. Files of points are complete once read; the entry of a dataset holds
 * observations, and becomes a map by generate_map().
 */
struct InputMap
{
    mp2p_icp::LoadReport report;      ///< of observations: their own points, whatever generators make of them
    mp2p_icp::metric_map_t::Ptr map;  ///< null while there are only observations
    mrpt::obs::CSensoryFrame::Ptr observations;  ///< null for files of points

    /// Turns the observations, if there are any, into a map, in place of an earlier one.
    /// \exception mp2p_icp::DataError if no point comes out.
    void generate_map(const mp2p_icp_filters::GeneratorSet& generators);
};

struct InputPair
{
    InputMap local, global;

    bool has_observations() const { return local.observations || global.observations; }
    void generate_maps(const mp2p_icp_filters::GeneratorSet& generators);
};

/// Reads both inputs; any that mp2p_icp::load_map() takes. \exception mp2p_icp::DataError, also for an input
/// without a point
InputPair read_inputs(const std::string& local_path, const std::string& global_path);

}  // namespace mp2p_icp_apps
