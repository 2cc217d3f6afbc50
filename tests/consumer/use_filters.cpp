#include <mp2p_icp_filters/FilterBase.h>
#include <mrpt/maps/CSimplePointsMap.h>

int main()
{
    const auto filters = mp2p_icp_filters::filter_pipeline_from_yaml(mrpt::containers::yaml::FromText(
        "- class_name: mp2p_icp_filters::FilterByRange\n"
        "  params: {input_pointcloud_layer: raw, output_layer_between: near, range_min: 0, range_max: 2}\n"));
    auto points = mrpt::maps::CSimplePointsMap::Create();
    points->insertPoint(1, 0, 0);
    points->insertPoint(5, 0, 0);
    mp2p_icp::metric_map_t map;
    map.layers["raw"] = points;
    mp2p_icp_filters::apply_filter_pipeline(filters, map);
    return map.point_layer("near")->size() == 1 ? 0 : 1;
}
