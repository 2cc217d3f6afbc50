#include <mp2p_icp_filters/FilterDeleteLayer.h>

IMPLEMENTS_MRPT_OBJECT(FilterDeleteLayer, FilterBase, mp2p_icp_filters)

namespace mp2p_icp_filters
{
FilterDeleteLayer::FilterDeleteLayer()
{
    setLoggerName("FilterDeleteLayer");
}

void FilterDeleteLayer::declare_parameters(mp2p_icp::ParameterDeclaration& declare)
{
    declare.texts("pointcloud_layer_to_remove", pointcloud_layer_to_remove,
                  "The layer, or layers, to remove.", mp2p_icp::Need::Required);
    declare.flag("error_on_missing_input_layer", error_on_missing_input_layer,
                 "Is a layer that is not there an error?");
    declare.rule(
        [this]() -> std::string
        {
            return pointcloud_layer_to_remove.empty()
                       ? "'pointcloud_layer_to_remove' must name at least one layer"
                       : "";
        });
}

void FilterDeleteLayer::filter(mp2p_icp::metric_map_t& inOut) const
{
    if (error_on_missing_input_layer)
        for (const auto& name : pointcloud_layer_to_remove)
            if (!inOut.layers.count(name))
            {
                std::string known;
                for (const auto& [n, layer] : inOut.layers) known += (known.empty() ? "'" : ", '") + n + "'";
                throw std::invalid_argument("FilterDeleteLayer: there is no layer '" + name +
                                            "' (layers: " + (known.empty() ? "none" : known) + ")");
            }
    for (const auto& name : pointcloud_layer_to_remove) inOut.layers.erase(name);
}

}  // namespace mp2p_icp_filters
