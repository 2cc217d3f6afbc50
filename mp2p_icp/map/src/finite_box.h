#pragma once

#include <mp2p_icp/block_grid.h>
#include <mrpt/math/TBoundingBox.h>

#include <optional>

namespace mp2p_icp
{
/// Around the points with three finite coordinates; empty if there are none. Half a nanosecond per point.
std::optional<mrpt::math::TBoundingBoxf> box_of_finite_points(const PointView& points);

}  // namespace mp2p_icp
