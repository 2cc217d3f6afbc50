#pragma once

#include <mp2p_icp/run_curves.h>

#include <Eigen/Dense>

#include "packed_points.h"

namespace mp2p_icp
{
/// What is drawn of the pairings of a kind, relative to a centre.
struct DrawnPairings
{
    PackedPoints residuals;   ///< segments from the global side to the local one
    PackedPoints primitives;  ///< pieces of lines, borders of planes
};

/// At most about so many pairings, a random subset of all, as seen at a pose. Sizes of primitives suit a
/// picture of that height, m.
PerPairingKind<DrawnPairings> drawn_pairings(const Pairings& pairings,
                                             const mrpt::poses::CPose3D& localWrtGlobal,
                                             const Eigen::Vector3d& centre, size_t max_pairings,
                                             double picture_height);

}  // namespace mp2p_icp
