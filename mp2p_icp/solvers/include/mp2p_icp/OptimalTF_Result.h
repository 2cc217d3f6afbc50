#pragma once

#include <mp2p_icp/FreeTwist.h>
#include <mrpt/poses/CPose3D.h>

#include <cstddef>
#include <vector>

namespace mp2p_icp
{
/// Pairings that a solver left out, as indices into the lists of Pairings, increasing.
struct OutlierIndices
{
    std::vector<size_t> point2point, point2line, point2plane, line2line, plane2plane;

    bool empty() const { return size() == 0; }
    size_t size() const
    {
        return point2point.size() + point2line.size() + point2plane.size() + line2line.size() +
               plane2plane.size();
    }
};

/// What the pose of an OptimalTF_Result is.
enum class SolveStatus : uint8_t
{
    NoPairings,        ///< nothing to solve with: no pairing with a positive weight and finite numbers
    UnderConstrained,  ///< a minimiser; the motions `free` are not determined, along them the guess was kept
    Determined         ///< the pairings determine all six degrees of freedom
};
/// `no pairings`, `under-constrained`, `determined`.
std::string to_string(SolveStatus status);

/// What a solver found.
struct OptimalTF_Result
{
    mrpt::poses::CPose3D optimalPose;  ///< of local with respect to global; unchanged by NoPairings
    double optimalScale = 1.0;         ///< always 1: poses are rigid
    OutlierIndices outliers;

    SolveStatus status = SolveStatus::NoPairings;
    size_t skipped = 0;  ///< pairings left out for numbers that are not finite, or a direction of length 0
    int rank = 0;        ///< how many of the 6 degrees of freedom the pairings determine
    std::vector<FreeTwist> free;  ///< the 6 - rank motions that they do not, global frame
};

}  // namespace mp2p_icp
