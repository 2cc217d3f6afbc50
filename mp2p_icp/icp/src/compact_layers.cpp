#include "compact_layers.h"

#include <mp2p_icp/point_fields.h>

#include "compact_bytes.h"

namespace mp2p_icp
{
using mrpt::math::TPoint3D;

namespace
{
bool same_bits(double a, double b)
{
    return std::memcmp(&a, &b, sizeof(double)) == 0;
}

TPoint3D point_of(const CompactLayers::Layer& layer, uint32_t index)
{
    return {layer.x[index], layer.y[index], layer.z[index]};
}
}  // namespace

CompactLayers::CompactLayers(const metric_map_t& map)
{
    constexpr size_t most = 255;
    for (const auto& [name, layer] : map.layers)
        if (const auto* points = layer ? MapToPointsMap(*layer) : nullptr; points && layers_.size() < most)
            layers_.push_back({points->getPointsBufferRef_x().data(), points->getPointsBufferRef_y().data(),
                               points->getPointsBufferRef_z().data(), points->size()});
}

size_t CompactLayers::points() const
{
    size_t count = 0;
    for (const auto& layer : layers_) count += layer.size;
    return count;
}

bool CompactLayers::has(uint8_t layer, uint32_t index, const TPoint3D& point) const
{
    if (layer == 0) return false;
    const auto& points = layers_[layer - 1u];
    if (index >= points.size) return false;
    const TPoint3D stored = point_of(points, index);
    return same_bits(stored.x, point.x) && same_bits(stored.y, point.y) && same_bits(stored.z, point.z);
}

uint8_t CompactLayers::layer_of(uint8_t before, uint32_t index, const TPoint3D& point) const
{
    if (has(before, index, point)) return before;
    for (size_t i = 1; i <= layers_.size(); i++)
        if (has(static_cast<uint8_t>(i), index, point)) return static_cast<uint8_t>(i);
    return 0;
}

TPoint3D CompactLayers::take_point(std::string_view& bytes, uint8_t layer, uint32_t index) const
{
    if (layer == 0)
    {
        const auto x = take<double>(bytes), y = take<double>(bytes), z = take<double>(bytes);
        return {x, y, z};
    }
    if (layer > layers_.size() || index >= layers_[layer - 1u].size)
        pairings_are_damaged("there is no such point");
    return point_of(layers_[layer - 1u], index);
}

void append_point(std::string& bytes, const TPoint3D& p)
{
    append(bytes, p.x), append(bytes, p.y), append(bytes, p.z);
}

}  // namespace mp2p_icp
