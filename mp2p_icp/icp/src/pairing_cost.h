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
    /// Of the distances of points, of local lines' base points and of local planes' centroids, m; 0 without
    /// pairings.
    double residual_rms = 0;
};

/// Pairings that are not finite are left out. O(N), a few ns for a pair of points; the same bits on any
/// number of threads.
PairingCost pairing_cost(const Pairings& pairings, const mrpt::poses::CPose3D& pose);

}  // namespace mp2p_icp
