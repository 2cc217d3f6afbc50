#pragma once

#include <mp2p_icp/icp_pipeline_from_yaml.h>

#include <optional>
#include <string>

#include "input_maps.h"

namespace mp2p_icp_apps
{
/// A pipeline, and where it comes from.
struct NamedPipeline
{
    std::string name;  ///< a file, or the name of a shipped pipeline
    mp2p_icp::Pipeline pipeline;
};

/** A pipeline from a YAML file, or a shipped one by its name (a file of that name wins).
 * \exception mp2p_icp::ConfigError; std::invalid_argument if there is neither, naming the shipped ones.
 */
NamedPipeline load_pipeline(const std::string& file_or_name);

/// The shipped pipeline for these inputs, complete with maps: mp2p_icp::default_pipeline_for(); for flat
/// clouds `icp-2d-laser` where it can fill in the walls of the global scan (from a dataset), else
/// `icp-2d-points`. \param own_generators the user's are in place of those of the pipeline, which then
/// cannot fill in anything
std::string default_pipeline_for_inputs(const InputPair& inputs, bool own_generators);

/** The filters of one side. From `filters_file` if given, else from the pipeline; under `entry_name`, or
 * `filters` if not given. \param option what the name was given by, for messages \return no filters if the
 * pipeline has none and no name was given. \exception mp2p_icp::ConfigError; std::invalid_argument for a name
 * that is not there, listing those that are.
 */
mp2p_icp_filters::FilterPipeline choose_filters(const NamedPipeline& from, const std::string& filters_file,
                                                const std::optional<std::string>& entry_name,
                                                const std::string& option);

/** Checks that there is something to match. \exception std::invalid_argument if matchers work on layers of
 * equal names, and no name is in both maps.
 */
void check_layers_meet(const mp2p_icp::ICP& icp, const mp2p_icp::metric_map_t& local,
                       const mp2p_icp::metric_map_t& global);

/// Number of points of the global map's cloud layers that enabled matchers read; of all of them for matchers
/// of unknown kinds.
uint64_t global_points_used(const mp2p_icp::ICP& icp, const mp2p_icp::metric_map_t& local,
                            const mp2p_icp::metric_map_t& global);

}  // namespace mp2p_icp_apps
