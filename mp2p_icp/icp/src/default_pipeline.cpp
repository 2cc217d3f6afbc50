#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <stdexcept>

#include "shipped_pipelines.h"

namespace mp2p_icp
{
std::vector<std::string> shipped_pipeline_names()
{
    std::vector<std::string> names;
    for (const auto& [name, text] : SHIPPED_PIPELINES) names.push_back(name);
    return names;
}

std::string shipped_pipeline(const std::string& name)
{
    std::string known;
    for (const auto& [n, text] : SHIPPED_PIPELINES)
    {
        if (n == name) return text;
        known += (known.empty() ? "" : ", ") + std::string(n);
    }
    throw std::invalid_argument("there is no shipped pipeline '" + name + "' (known: " + known + ")");
}

namespace
{
struct Extent
{
    double diagonal = 0, height = 0;
};

Extent extent_of(const metric_map_t& map)
{
    const auto box = map.bounding_box();
    if (!box) return {};
    const auto size = box->max - box->min;
    return {size.norm(), size.z};
}
}  // namespace

std::string default_pipeline_for(const metric_map_t& local, const metric_map_t& global,
                                 bool from_observations)
{
    const Extent l = extent_of(local), g = extent_of(global);
    const double larger = std::max(l.diagonal, g.diagonal);
    if (std::max(l.height, g.height) <= 1e-3 * larger)
        return from_observations ? "icp-2d-laser" : "icp-2d-points";
    return larger >= 10.0 ? "icp-3d-point-to-plane" : "icp-object";
}

RunVariables extent_variables(const metric_map_t& local, const metric_map_t& global)
{
    return {{"LOCAL_EXTENT", std::max(1e-6, extent_of(local).diagonal)},
            {"GLOBAL_EXTENT", std::max(1e-6, extent_of(global).diagonal)}};
}

Results align(const mrpt::maps::CSimplePointsMap& local, const mrpt::maps::CSimplePointsMap& global,
              const mrpt::poses::CPose3D& localWrtGlobal)
{
    if (!is_finite(localWrtGlobal)) throw std::invalid_argument("align: localWrtGlobal must be finite");
    metric_map_t l, g;
    l.layers[metric_map_t::PT_LAYER_RAW] = mrpt::maps::CSimplePointsMap::Create(local);
    g.layers[metric_map_t::PT_LAYER_RAW] = mrpt::maps::CSimplePointsMap::Create(global);
    Pipeline pipeline = pipeline_from_yaml(yaml_from_text(shipped_pipeline(default_pipeline_for(l, g))));
    ParameterSource source;
    source.updateVariables(extent_variables(l, g));
    pipeline.attachToParameterSource(source);
    mp2p_icp_filters::apply_filter_pipeline(pipeline.filters["filters"], l, g);
    Results out;
    pipeline.icp->align(l, g, localWrtGlobal.asTPose(), pipeline.parameters, out);
    return out;
}

}  // namespace mp2p_icp
