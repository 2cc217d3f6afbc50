#include <mp2p_icp/numbers.h>
#include <mp2p_icp/point_fields.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <numeric>

#include "filter_layers.h"
#include "noted_parameter.h"
#include "voxel_decimation.h"

IMPLEMENTS_MRPT_OBJECT(FilterDecimateVoxels, FilterBase, mp2p_icp_filters)

namespace mp2p_icp_filters
{
using mp2p_icp::Need;
using mp2p_icp::ParameterDeclaration;
using mp2p_icp::Range;
using mrpt::maps::CPointsMap;

FilterDecimateVoxels::FilterDecimateVoxels()
{
    setLoggerName("FilterDecimateVoxels");
}

namespace
{
void declare_method(ParameterDeclaration& declare, DecimateMethod& method)
{
    struct Old
    {
        bool average = false;
        std::shared_ptr<bool> given = std::make_shared<bool>(false),
                              new_given = std::make_shared<bool>(false);
    };
    const auto old = std::make_shared<Old>();  // lives as long as the declaration: the rule owns it
    declare.custom(
        noted(old->new_given,
              [&](auto& d)
              {
                  d.template choice<DecimateMethod>(
                      "decimate_method", method, "DecimateMethod",
                      {{DecimateMethod::FirstPoint, "FirstPoint"},
                       {DecimateMethod::ClosestToAverage, "ClosestToAverage"},
                       {DecimateMethod::VoxelAverage, "VoxelAverage"},
                       {DecimateMethod::RandomPoint, "RandomPoint"}},
                      "Which point stands for a cell. Required, unless use_voxel_average is given.");
              }));
    declare.custom(older(old->given,
                         [&](auto& d)
                         {
                             d.flag("use_voxel_average", old->average,
                                    "Older key (0.2.2), in place of decimate_method: true is VoxelAverage, "
                                    "false is RandomPoint.");
                         }));
    declare.rule(
        [old, &method]() -> std::string
        {
            if (*old->given && *old->new_given)
                return "only one of 'decimate_method' and 'use_voxel_average' (its older form) may be given";
            if (!*old->given && !*old->new_given)
                return "the required key 'decimate_method' is missing (which point stands for a cell)";
            if (*old->given)
                method = old->average ? DecimateMethod::VoxelAverage : DecimateMethod::RandomPoint;
            return {};
        });
}

void declare_keys_without_effect(ParameterDeclaration& declare)
{
    KeysWithoutEffect keys;
    for (const char* name : {"bounding_box_min", "bounding_box_max"}) keys.position(declare, name, HASHED);
    keys.flag(declare, "use_tsl_robin_map", ONE_HASH_MAP);
    keys.keep_in(declare);
}

ParameterDeclaration::Entry flatten_entry(std::optional<double>& flatten_to)
{
    const auto load = [&flatten_to](const mp2p_icp::yaml::node_t& node, const mp2p_icp::YamlPlace& place)
    {
        flatten_to.reset();
        if (node.isNullNode()) return;
        double height = 0;
        ParameterDeclaration one;
        one.number("flatten_to", height, "m",
                   Range::open(-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()), "");
        one.entries().back().load(node, place);
        flatten_to = height;
    };
    const auto save = [&flatten_to]() {
        return flatten_to ? mp2p_icp::yaml::node_t(mp2p_icp::to_text(*flatten_to)) : mp2p_icp::yaml::node_t();
    };
    return {"flatten_to", "number", "m",  "",  "If given, z of all output points is set to this.",
            "none",       false,    load, save};
}
}  // namespace

void FilterDecimateVoxels::declare_parameters(ParameterDeclaration& declare)
{
    declare.texts("input_pointcloud_layer", input_pointcloud_layer, "The cloud, or clouds, to thin.",
                  Need::Required);
    declare.text("output_pointcloud_layer", output_pointcloud_layer,
                 "Layer for the result; may be the input.", Need::Required);
    declare.formula("voxel_filter_resolution", voxel_filter_resolution, "m", Range::positive(),
                    "Side of the cells.", Need::Required);
    declare_method(declare, decimate_method);
    declare.flag("error_on_missing_input_layer", error_on_missing_input_layer,
                 "Is an input layer that is not there an error?");
    declare.integer("minimum_input_points_to_filter", minimum_input_points_to_filter, Range::not_negative(),
                    "An input layer with fewer points is taken as it is.");
    declare.custom(flatten_entry(flatten_to));
    declare.integer("seed", seed, Range::not_negative(), "Seed of RandomPoint.");
    declare_keys_without_effect(declare);
    declare.rule(
        [this]() -> std::string
        {
            if (input_pointcloud_layer.empty())
                return "'input_pointcloud_layer' must name at least one layer";
            if (output_pointcloud_layer.empty()) return "'output_pointcloud_layer' must not be empty";
            return {};
        });
}

namespace
{
DecimationInput join_layers(const std::vector<CPointsMap::Ptr>& layers, uint32_t minimum_points)
{
    DecimationInput input;
    size_t first = 0;
    for (const auto& layer : layers)
    {
        if (layer->size() < minimum_points) input.kept_whole.emplace_back(first, first + layer->size());
        first += layer->size();
    }
    if (layers.size() == 1)
    {
        input.points = layers[0];
        return input;
    }
    const auto joined = mp2p_icp::new_cloud_like(*layers[0]);
    for (const auto& layer : layers)
    {
        std::vector<size_t> all(layer->size());
        std::iota(all.begin(), all.end(), size_t(0));
        mp2p_icp::append_points(*joined, *layer, all);
    }
    input.points = joined;
    return input;
}

void set_heights(CPointsMap& points, double z)
{
    float x = 0, y = 0, old_z = 0;
    for (size_t i = 0; i < points.size(); i++)
    {
        points.getPointFast(i, x, y, old_z);
        points.setPointFast(i, x, y, static_cast<float>(z));
    }
    points.mark_as_modified();
}
}  // namespace

void FilterDecimateVoxels::filter(mp2p_icp::metric_map_t& inOut) const
{
    const double side = mp2p_icp::checked_value(voxel_filter_resolution, variables(),
                                                "voxel_filter_resolution", Range::positive());
    std::vector<CPointsMap::Ptr> layers;
    for (const auto& name : input_pointcloud_layer)
        if (error_on_missing_input_layer || inOut.layers.count(name))
            layers.push_back(input_layer(*this, inOut, name));
    CPointsMap::Ptr out = mrpt::maps::CSimplePointsMap::Create();
    if (!layers.empty())
        out = decimate(join_layers(layers, minimum_input_points_to_filter), side, decimate_method, seed);
    if (flatten_to) set_heights(*out, *flatten_to);
    inOut.layers[output_pointcloud_layer] = out;
}

}  // namespace mp2p_icp_filters
