#pragma once

#include <mrpt/poses/CPose3D.h>

#include <cstddef>
#include <vector>

namespace mp2p_icp
{
/// Pairings that a solver left out, as indices into the lists of Pairings, increasing.
struct OutlierIndices
{
    std::vector<size_t> point2point;
    bool empty() const { return point2point.empty(); }
    size_t size() const { return point2point.size(); }
};

/// What a solver found.
struct OptimalTF_Result
{
    mrpt::poses::CPose3D optimalPose;  ///< of local with respect to global
    double optimalScale = 1.0;         ///< always 1: poses are rigid
    OutlierIndices outliers;
};

}  // namespace mp2p_icp
