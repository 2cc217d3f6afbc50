#include <mp2p_icp/numbers.h>
#include <mp2p_icp_filters/FilterByRange.h>

#include <cmath>

#include "filter_layers.h"

IMPLEMENTS_MRPT_OBJECT(FilterByRange, FilterBase, mp2p_icp_filters)

namespace mp2p_icp_filters
{
using mp2p_icp::checked_value;
using mp2p_icp::Need;
using mp2p_icp::Range;

FilterByRange::FilterByRange()
{
    setLoggerName("FilterByRange");
}

namespace
{
const Range RANGES = {0, std::numeric_limits<double>::infinity(), false, false};

std::string wrong_ranges(double lo, double hi)
{
    if (lo <= hi) return {};
    return "'range_min' must not exceed 'range_max', and they are " + mp2p_icp::to_text(lo) + " and " +
           mp2p_icp::to_text(hi);
}
}  // namespace

void FilterByRange::declare_parameters(mp2p_icp::ParameterDeclaration& declare)
{
    declare.text("input_pointcloud_layer", input_pointcloud_layer, "The cloud to divide.", Need::Required);
    declare.text("output_layer_between", output_layer_between,
                 "Layer for range_min <= distance <= range_max; empty: not written.");
    declare.text("output_layer_outside", output_layer_outside,
                 "Layer for the other points; empty: not written.");
    declare.formula("range_min", range_min, "m", RANGES, "Least distance.", Need::Required);
    declare.formula("range_max", range_max, "m", RANGES, "Greatest distance.", Need::Required);
    declare.formulas("center", center.data(), 3, "m", "Where distances are measured from: x, y, z.");
    declare.rule(
        [this]() -> std::string
        {
            if (output_layer_between.empty() && output_layer_outside.empty())
                return "at least one of 'output_layer_between' and 'output_layer_outside' must be given";
            if (output_layer_between == output_layer_outside)
                return "'output_layer_between' and 'output_layer_outside' must differ";
            if (!range_min.is_constant() || !range_max.is_constant()) return {};
            return wrong_ranges(range_min.value(), range_max.value());
        });
}

void FilterByRange::filter(mp2p_icp::metric_map_t& inOut) const
{
    const auto known = variables();
    const double least = checked_value(range_min, known, "range_min", RANGES);
    const double greatest = checked_value(range_max, known, "range_max", RANGES);
    if (const auto broken = wrong_ranges(least, greatest); !broken.empty())
        throw std::runtime_error("FilterByRange: " + broken);
    const auto lo = static_cast<float>(least), hi = static_cast<float>(greatest);
    const double cx = center[0].value(known), cy = center[1].value(known), cz = center[2].value(known);
    const auto is_between = [&](float x, float y, float z)
    {
        const double dx = static_cast<double>(x) - cx, dy = static_cast<double>(y) - cy,
                     dz = static_cast<double>(z) - cz;
        const auto distance = static_cast<float>(std::sqrt(dx * dx + dy * dy + dz * dz));
        return distance >= lo && distance <= hi;
    };
    divide_layer(*this, inOut, input_pointcloud_layer, output_layer_between, output_layer_outside,
                 is_between);
}

}  // namespace mp2p_icp_filters
