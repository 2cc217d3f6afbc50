#pragma once

#include <mp2p_icp/ICP.h>
#include <mp2p_icp_filters/FilterBase.h>
#include <mp2p_icp_filters/Generator.h>

#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace mp2p_icp
{
/// Everything that a pipeline file may describe.
struct Pipeline
{
    ICP::Ptr icp;
    Parameters parameters;
    /// From `generators:`; empty if there is no such key.
    std::optional<mp2p_icp_filters::GeneratorSet> generators;
    /// From `filters:` and from other top keys that hold a list of {class_name, params}, by key.
    std::map<std::string, mp2p_icp_filters::FilterPipeline> filters;

    /// Formulas of all parts see the variables of the source from now on.
    void attachToParameterSource(const ParameterSource& source);
};

/** Builds a pipeline from YAML: `class_name`, `params`, `solvers`, `matchers`, `quality`, and optionally
 * `generators`, `filters` and lists of filters under names of their own. Entries of solvers, matchers and
 * quality are `{class, params, enabled}`, of quality also with `weight`. \exception ConfigError for anything
 * else, naming the place and the nearest known name; `plugin` and `derived` are known, and refused.
 */
Pipeline pipeline_from_yaml(const yaml& config, const YamlPlace& place = {},
                            mrpt::system::VerbosityLevel verbosity = mrpt::system::LVL_INFO);
/// \overload \exception DataError if the file cannot be read.
Pipeline pipeline_from_yaml_file(const std::string& file_name,
                                 mrpt::system::VerbosityLevel verbosity = mrpt::system::LVL_INFO);

/// The ICP part of pipeline_from_yaml().
std::tuple<ICP::Ptr, Parameters> icp_pipeline_from_yaml(
    const yaml& config, mrpt::system::VerbosityLevel verbosity = mrpt::system::LVL_INFO);

// ---- Pipelines that come with the library -----------------------------------------------------------------

/// Names of the shipped pipelines, such as `icp-3d-lidar`. Their files are installed under share/mp2p_icp.
std::vector<std::string> shipped_pipeline_names();
/// YAML text of a shipped pipeline. \exception std::invalid_argument naming the known ones.
std::string shipped_pipeline(const std::string& name);

/** Which shipped pipeline suits two clouds. If both are flat (all points at one height): `icp-2d-laser` for
 * maps that will be made from observations, by its generators, else `icp-2d-points`. Otherwise
 * `icp-3d-point-to-plane` if the larger one extends over 10 m or more, else `icp-object`.
 */
std::string default_pipeline_for(const metric_map_t& local, const metric_map_t& global,
                                 bool from_observations = false);

/** Variables for formulas of filters and of the pipeline: `LOCAL_EXTENT` and `GLOBAL_EXTENT`, the diagonals
 * of the maps' bounding boxes in m, at least 1e-6.
 */
RunVariables extent_variables(const metric_map_t& local, const metric_map_t& global);

}  // namespace mp2p_icp
