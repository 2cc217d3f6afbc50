#pragma once

#include <mp2p_icp/metricmap.h>
#include <mrpt/maps/CPointsMap.h>

#include <string>
#include <string_view>
#include <vector>

namespace mp2p_icp
{
/** The cloud layers of a map, up to 255, counted from 1 in the order of their names; 0 stands for none of
 * them. The map must outlive them.
 */
class CompactLayers
{
 public:
    explicit CompactLayers(const metric_map_t& map);

    size_t size() const { return layers_.size(); }
    size_t points() const;  ///< of all of them

    /// Is it, to the bit, that point of that layer?
    bool has(uint8_t layer, uint32_t index, const mrpt::math::TPoint3D& point) const;
    /// Which of the layers has that point there: `before` if it does.
    uint8_t layer_of(uint8_t before, uint32_t index, const mrpt::math::TPoint3D& point) const;

    struct Layer
    {
        const float *x, *y, *z;
        size_t size;
    };
    const Layer& layer(uint8_t number) const { return layers_[number - 1u]; }

    /// The point of a layer, or the next 3 doubles. \exception std::runtime_error if there is no such point
    mrpt::math::TPoint3D take_point(std::string_view& bytes, uint8_t layer, uint32_t index) const;

 private:
    std::vector<Layer> layers_;
};

void append_point(std::string& bytes, const mrpt::math::TPoint3D& p);

}  // namespace mp2p_icp
