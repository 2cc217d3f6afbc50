#pragma once

#include <mp2p_icp/Pairings.h>

#include <cstddef>
#include <vector>

namespace mp2p_icp
{
/** Which point pairings keep their distance from a common centre, to within the noise:
 *
 *     | |a_i - ca| - |b_i - cb| | <= tolerance
 *
 * with a_i global, b_i local. Needs no pose: if cb is any point of the local frame and ca is where the true
 * pose takes it, the two distances of an inlier differ by noise only. The scale test of the OLAE-ICP report,
 * eq. (3) (see WeightParameters), with the noise as the scale and with centres that outliers cannot move:
 *
 * 1. An inlier is such a pair of centres itself. Of up to 64 pairings (a fixed random choice), the first one
 * with which more than half of all agree at 2 * tolerance, else the one with which most do, is a centre;
 * those that agree stay. Four times, with four centres. Pairings at less than that distance from the centre
 * on both sides agree whatever the pose, and do not count: many copies of a wrong pairing do not support each
 * other.
 *
 * 2. About the means of what has stayed, at `tolerance`; then about the means of those that pass, until the
 * set stops changing (at most 30 times; then the largest). Medians of all pairings are no start: with half of
 * them wrong and all on one side, they led to the inliers in less than half of the runs, even with a
 * shrinking gate and trilateration.
 *
 * With 200 points in a cube of 50 m, noise of 1 mm and k = 3, no wrong pairing was kept in 1000 runs at any
 * of seven ratios of uniform outliers up to 85 %.
 *
 * What it cannot see: a wrong pairing that keeps all five distances, such as one displaced by little more
 * than the tolerance, or mirrored through the plane of coplanar inliers. The choice among 64 misses all
 * inliers with a probability of (outlier ratio)^64 (4 % at 95 %): then, and when all are outliers, the result
 * is a handful of chance pairings; its size tells. Beyond 85 % outliers prefer consistency_graph_inliers().
 *
 * \param tolerance k standard deviations of one coordinate of a_i - (R b_i + t), m. With k = 3 Gaussian noise
 * loses 0.3 % of the inliers, with k = 4 less than 0.01 %. \return Indices of the inliers, increasing.
 * Pairings with a number that is not finite are never among them. If nothing contradicts (one pairing; all at
 * one place), all finite ones; if no two pairings agree, none. \exception std::invalid_argument unless
 * tolerance is positive and finite.
 *
 * Equal supports go to the lower index; the same bits on any number of threads. Moving either side as a whole
 * changes nothing but the rounding of its coordinates. Thread-safe. O(N): four passes and a few more when
 * inliers are the majority, about 64 when they are not. Memory about 300 bytes per pairing.
 */
std::vector<size_t> noise_scale_inliers(const MatchedPointList& pairs, double tolerance);

}  // namespace mp2p_icp
