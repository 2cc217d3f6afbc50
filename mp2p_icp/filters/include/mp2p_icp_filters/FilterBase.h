#pragma once

#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/parallel.h>
#include <mrpt/rtti/CObject.h>
#include <mrpt/system/COutputLogger.h>
#include <mrpt/system/CTimeLogger.h>

#include <string>
#include <vector>

namespace mp2p_icp_filters
{
using mrpt::containers::yaml;

/** A step that changes the layers of a map. Configured once, const while running: one filter may serve
 * several threads at once (on different maps).
 */
class FilterBase : public mrpt::rtti::CObject,
                   public mrpt::system::COutputLogger,
                   public mp2p_icp::Parameterizable
{
    DEFINE_VIRTUAL_MRPT_OBJECT(FilterBase)

 public:
    FilterBase() : mrpt::system::COutputLogger("FilterBase") {}

    /// Sets the parameters. \exception mp2p_icp::ConfigError
    void initialize(const yaml& params, const mp2p_icp::YamlPlace& place = {})
    {
        load_parameters(params, place);
    }

    /** Applies the filter in place. \exception std::invalid_argument for a missing or unfit layer, naming it
     * and the layers there are; std::runtime_error for a formula without its variables.
     */
    virtual void filter(mp2p_icp::metric_map_t& inOut) const = 0;
};

using FilterPipeline = std::vector<FilterBase::Ptr>;

/// Applies the filters in their order. Each one's time goes into the profiler under its class name, if one is
/// given.
void apply_filter_pipeline(const FilterPipeline& filters, mp2p_icp::metric_map_t& inOut,
                           mrpt::system::CTimeLogger* profiler = nullptr);

/// To two maps, at once if there are threads for it.
inline void apply_filter_pipeline(const FilterPipeline& filters, mp2p_icp::metric_map_t& one,
                                  mp2p_icp::metric_map_t& other)
{
    mp2p_icp::run_all(
        {[&]() { apply_filter_pipeline(filters, one); }, [&]() { apply_filter_pipeline(filters, other); }});
}

/** A pipeline from a list of `{class_name, params}` (params may be `~` or absent). An empty or null list is
 * an empty pipeline. \exception mp2p_icp::ConfigError for an unknown class (naming the nearest known one), an
 * unknown key, a wrong value.
 */
FilterPipeline filter_pipeline_from_yaml(const yaml& list, const mp2p_icp::YamlPlace& place = {},
                                         mrpt::system::VerbosityLevel verbosity = mrpt::system::LVL_INFO);
/// \overload From a file, under its top key `filters`.
FilterPipeline filter_pipeline_from_yaml_file(
    const std::string& file_name, mrpt::system::VerbosityLevel verbosity = mrpt::system::LVL_INFO);

/// The cloud layer `name`, made (empty, of class `class_name`) if it is not there yet.
mrpt::maps::CPointsMap::Ptr GetOrCreatePointLayer(
    mp2p_icp::metric_map_t& map, const std::string& name,
    const std::string& class_name = "mrpt::maps::CSimplePointsMap");

}  // namespace mp2p_icp_filters
