#include <mp2p_icp/numbers.h>
#include <mp2p_icp_filters/FilterBoundingBox.h>

#include "filter_layers.h"
#include "noted_parameter.h"

IMPLEMENTS_MRPT_OBJECT(FilterBoundingBox, FilterBase, mp2p_icp_filters)

namespace mp2p_icp_filters
{
using mp2p_icp::Formula;
using mp2p_icp::Need;
using mp2p_icp::ParameterDeclaration;

FilterBoundingBox::FilterBoundingBox()
{
    setLoggerName("FilterBoundingBox");
}

namespace
{
/// The keys of 0.2.2: one output, and whether it takes the inside or the outside. Lives as long as the
/// declaration: a rule owns it.
struct OldOutput
{
    std::string layer;
    bool inside = true;
    std::shared_ptr<bool> layer_given = std::make_shared<bool>(false),
                          inside_given = std::make_shared<bool>(false),
                          new_keys_given = std::make_shared<bool>(false);
};

void declare_outputs(ParameterDeclaration& declare, FilterBoundingBox& filter)
{
    const auto old = std::make_shared<OldOutput>();
    declare.custom(noted(old->new_keys_given,
                         [&](auto& d)
                         {
                             d.text("inside_pointcloud_layer", filter.inside_pointcloud_layer,
                                    "Layer for the points inside; empty: not written.");
                         }));
    declare.custom(noted(old->new_keys_given,
                         [&](auto& d)
                         {
                             d.text("outside_pointcloud_layer", filter.outside_pointcloud_layer,
                                    "Layer for the points outside; empty: not written.");
                         }));
    declare.custom(older(old->layer_given,
                         [&](auto& d)
                         {
                             d.text("output_pointcloud_layer", old->layer,
                                    "Older key (0.2.2): the only output layer; needs keep_bbox_contents.");
                         }));
    declare.custom(
        older(old->inside_given,
              [&](auto& d)
              {
                  d.flag("keep_bbox_contents", old->inside,
                         "Older key (0.2.2): does output_pointcloud_layer take the inside, or the outside?");
              }));
    declare.rule(
        [old, &filter]() -> std::string
        {
            if (*old->layer_given != *old->inside_given)
                return "'output_pointcloud_layer' and 'keep_bbox_contents' (older keys) must be given "
                       "together";
            if (*old->layer_given && *old->new_keys_given)
                return "the older keys 'output_pointcloud_layer' and 'keep_bbox_contents' cannot stand "
                       "beside "
                       "'inside_pointcloud_layer' and 'outside_pointcloud_layer'";
            if (*old->layer_given)
            {
                filter.inside_pointcloud_layer = old->inside ? old->layer : std::string();
                filter.outside_pointcloud_layer = old->inside ? std::string() : old->layer;
            }
            if (filter.inside_pointcloud_layer.empty() && filter.outside_pointcloud_layer.empty())
                return "at least one of 'inside_pointcloud_layer' and 'outside_pointcloud_layer' must be "
                       "given";
            if (filter.inside_pointcloud_layer == filter.outside_pointcloud_layer)
                return "'inside_pointcloud_layer' and 'outside_pointcloud_layer' must differ";
            return {};
        });
}

std::string wrong_limits(size_t axis, double lo, double hi)
{
    if (lo <= hi) return {};
    return std::string("'bounding_box_min' must not exceed 'bounding_box_max', and in ") + "xyz"[axis] +
           " they are " + mp2p_icp::to_text(lo) + " and " + mp2p_icp::to_text(hi);
}
}  // namespace

void FilterBoundingBox::declare_parameters(ParameterDeclaration& declare)
{
    declare.text("input_pointcloud_layer", input_pointcloud_layer, "The cloud to divide.");
    declare_outputs(declare, *this);
    declare.formulas("bounding_box_min", bounding_box_min.data(), 3, "m",
                     "Least x, y, z of the box (inside it).", Need::Required);
    declare.formulas("bounding_box_max", bounding_box_max.data(), 3, "m",
                     "Greatest x, y, z of the box (inside it).", Need::Required);
    declare.rule(
        [this]()
        {
            std::string broken;
            for (size_t a = 0; a < 3 && broken.empty(); a++)
                if (bounding_box_min[a].is_constant() && bounding_box_max[a].is_constant())
                    broken = wrong_limits(a, bounding_box_min[a].value(), bounding_box_max[a].value());
            return broken;
        });
}

void FilterBoundingBox::filter(mp2p_icp::metric_map_t& inOut) const
{
    const auto known = variables();
    float lo[3], hi[3];
    for (size_t a = 0; a < 3; a++)
    {
        const double least = bounding_box_min[a].value(known), greatest = bounding_box_max[a].value(known);
        if (const auto broken = wrong_limits(a, least, greatest); !broken.empty())
            throw std::runtime_error("FilterBoundingBox: " + broken);
        lo[a] = static_cast<float>(least), hi[a] = static_cast<float>(greatest);
    }
    const auto is_inside = [&](float x, float y, float z)
    { return x >= lo[0] && x <= hi[0] && y >= lo[1] && y <= hi[1] && z >= lo[2] && z <= hi[2]; };
    divide_layer(*this, inOut, input_pointcloud_layer, inside_pointcloud_layer, outside_pointcloud_layer,
                 is_inside);
}

}  // namespace mp2p_icp_filters
