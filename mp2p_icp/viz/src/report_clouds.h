#pragma once

#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/ortho_view.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
/// What is drawn of a cloud layer.
struct DrawnLayer
{
    std::string name;
    PointSet points;    ///< stored coordinates
    size_t finite = 0;  ///< how many there are; `points` is a random subset of them
};

/// The finite points of all cloud layers, at most so many in all. Small layers are drawn whole, large ones
/// share what is left.
std::vector<DrawnLayer> drawn_layers(const metric_map_t& map, size_t max_points);

/// Where a map is: its drawn points, and the centres of its planes and lines.
PointSet places_of(const metric_map_t& map, const std::vector<DrawnLayer>& layers);

/// The median of each coordinate; the origin if there is no point.
mrpt::math::TPoint3D middle_of(const PointSet& points);

}  // namespace mp2p_icp
