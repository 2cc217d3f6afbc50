#pragma once

#include <mp2p_icp_filters/FilterBase.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace mp2p_icp_filters
{
/// The cloud to read. \exception std::invalid_argument as metric_map_t::point_layer(), naming the filter too.
mrpt::maps::CPointsMap::Ptr input_layer(const FilterBase& filter, const mp2p_icp::metric_map_t& map,
                                        const std::string& name);

/// The values of the formulas of a position now. \exception std::runtime_error if one is not finite.
Eigen::Vector3d position_value(const std::array<mp2p_icp::Formula, 3>& formulas,
                               const mp2p_icp::RunVariables& variables, const std::string& name);

/// Puts the points `indices` of `from` into the layer `name`, a new cloud of the same class. Nothing if the
/// name is empty.
void write_layer(mp2p_icp::metric_map_t& map, const std::string& name, const mrpt::maps::CPointsMap& from,
                 const std::vector<size_t>& indices);

/// Puts places into the layer `name`, a new CSimplePointsMap. Nothing if the name is empty.
void write_places(mp2p_icp::metric_map_t& map, const std::string& name,
                  const std::vector<mrpt::math::TPoint3D>& places);

/// The centroids of the map's planes, by write_places().
void write_centroids(mp2p_icp::metric_map_t& map, const std::string& name);

/** Divides the finite points of layer `input` in two by `is_first(x, y, z)`, and writes those parts that have
 * a name, each in the order of the input. The input layer may be one of the outputs.
 */
template <class IsFirst>
void divide_layer(const FilterBase& filter, mp2p_icp::metric_map_t& map, const std::string& input,
                  const std::string& first_name, const std::string& second_name, const IsFirst& is_first)
{
    const auto points = input_layer(filter, map, input);
    std::vector<size_t> first, second;
    for (size_t i = 0; i < points->size(); i++)
    {
        float x = 0, y = 0, z = 0;
        points->getPointFast(i, x, y, z);
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) continue;
        (is_first(x, y, z) ? first : second).push_back(i);
    }
    write_layer(map, first_name, *points, first);
    write_layer(map, second_name, *points, second);
}

}  // namespace mp2p_icp_filters
