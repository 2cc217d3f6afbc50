#pragma once

#include <mp2p_icp/Pairings.h>
#include <mrpt/poses/CPose3D.h>

namespace mp2p_icp
{
/** Sum of the squared residuals (errorTerms.h) of all pairings at a pose, each times the weight of its
 * pairing, m^2; directions of lines and planes count 1 m^2 per rad^2. Pairings that are not finite are left
 * out. O(N); the same bits on any number of threads.
 */
double weighted_cost(const Pairings& pairings, const mrpt::poses::CPose3D& pose);

}  // namespace mp2p_icp
