#pragma once

#include <mp2p_icp_filters/FilterDecimateVoxels.h>

namespace mp2p_icp_filters
{
/// The points of all input layers in one cloud, and which of them must not be thinned.
struct DecimationInput
{
    mrpt::maps::CPointsMap::ConstPtr points;
    std::vector<std::pair<size_t, size_t>>
        kept_whole;  ///< ranges [first, last) of points, in increasing order
};

/// One point for each cell of side `side`, or one for each point that is kept whole. \exception
/// std::invalid_argument for a point whose cell cannot be numbered.
mrpt::maps::CPointsMap::Ptr decimate(const DecimationInput& input, double side, DecimateMethod method,
                                     uint64_t seed);

}  // namespace mp2p_icp_filters
