#include <mp2p_icp/modules_from_yaml.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp_filters/FilterBase.h>

#include <optional>

#include "register.h"

IMPLEMENTS_VIRTUAL_MRPT_OBJECT(FilterBase, mrpt::rtti::CObject, mp2p_icp_filters)

namespace mp2p_icp_filters
{
void apply_filter_pipeline(const FilterPipeline& filters, mp2p_icp::metric_map_t& inOut,
                           mrpt::system::CTimeLogger* profiler)
{
    for (const auto& filter : filters)
    {
        std::optional<mrpt::system::CTimeLoggerEntry> timed;
        if (profiler) timed.emplace(*profiler, filter->GetRuntimeClass()->className);
        filter->filter(inOut);
    }
}

FilterPipeline filter_pipeline_from_yaml(const yaml& list, const mp2p_icp::YamlPlace& place,
                                         mrpt::system::VerbosityLevel verbosity)
{
    register_classes();
    return mp2p_icp::modules_from_yaml<FilterBase>(list, place, "filter", verbosity);
}

FilterPipeline filter_pipeline_from_yaml_file(const std::string& file_name,
                                              mrpt::system::VerbosityLevel verbosity)
{
    return filter_pipeline_from_yaml(mp2p_icp::module_list_from_file(file_name, "filters"),
                                     {file_name, "filters"}, verbosity);
}

mrpt::maps::CPointsMap::Ptr GetOrCreatePointLayer(mp2p_icp::metric_map_t& map, const std::string& name,
                                                  const std::string& class_name)
{
    if (map.layers.count(name)) return map.point_layer(name);
    const auto cloud = mp2p_icp::new_cloud(class_name);
    map.layers[name] = cloud;
    return cloud;
}

}  // namespace mp2p_icp_filters
