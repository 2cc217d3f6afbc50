#pragma once

#include <mp2p_icp_filters/FilterBase.h>

namespace mp2p_icp_filters
{
/** Removes layers, of any kind of map, from a metric_map_t. filter() throws std::invalid_argument if one is
 * missing (and then removes none), unless error_on_missing_input_layer is false.
 */
class FilterDeleteLayer : public FilterBase
{
    DEFINE_MRPT_OBJECT(FilterDeleteLayer, mp2p_icp_filters)

 public:
    FilterDeleteLayer();
    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
    void filter(mp2p_icp::metric_map_t& inOut) const override;

    std::vector<std::string> pointcloud_layer_to_remove;
    bool error_on_missing_input_layer = true;
};

}  // namespace mp2p_icp_filters
