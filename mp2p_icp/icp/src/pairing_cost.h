#pragma once

#include <mp2p_icp/Pairings.h>
#include <mrpt/poses/CPose3D.h>

namespace mp2p_icp
{
/// Sums over pairings at a pose.
struct PairingCost
{
    /// Sum of the squared residuals (errorTerms.h), each times the weight of its pairing, m^2; directions of
    /// lines and planes count 1 m^2 per rad^2.
    double weighted = 0;
    double residual_rms = 0;  ///< of the distances point to point, line or plane, m; 0 without such pairings
};

/// Pairings that are not finite are left out. O(N), a few ns for a pair of points; the same bits on any
/// number of threads.
PairingCost pairing_cost(const Pairings& pairings, const mrpt::poses::CPose3D& pose);

}  // namespace mp2p_icp
