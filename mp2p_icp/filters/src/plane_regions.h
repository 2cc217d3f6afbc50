#pragma once

#include "plane_cells.h"

namespace mp2p_icp_filters
{
/// Flat cells that hang together, and the plane through all of their points.
struct PlaneRegion
{
    std::vector<uint32_t> cells;
    PointMoments moments;
    MomentPlane plane;
};

/** Divides the flat cells that are not marked in `used` into regions, the one with most points first. The
 * flattest cell starts; a cell joins if it touches the region, its normal agrees, and its centre lies in the
 * region's plane.
 */
std::vector<PlaneRegion> grow_regions(const CellLevel& level, const std::vector<bool>& used,
                                      const PlaneParameters& parameters);

}  // namespace mp2p_icp_filters
