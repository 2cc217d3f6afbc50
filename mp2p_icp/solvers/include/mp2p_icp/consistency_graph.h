#pragma once

#include <mp2p_icp/Pairings.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mp2p_icp
{
struct ConsistencyGraphParameters
{
    /** Largest difference of two lengths that noise explains, m; must be set. 2 k sigma, sigma being the
     * standard deviation of one coordinate of a_i - (R b_i + t): the difference has a deviation of sqrt(2)
     * sigma, so that k = 3 loses 2e-5 of the edges between inliers.
     */
    double tolerance = 0;
    /// A pairing looks for so many consistent partners, then stops. At least 1.
    size_t max_partners = 64;
    /// Of the order in which partners are tried, and of the jury.
    uint64_t seed = 1;
};

/** The largest set of point pairings found (a_i global, b_i local) that agree with each other, for which no
 * pose is needed: vectors between points keep their length under any pose, so inliers i and j are consistent,
 *
 *     | |a_i - a_j| - |b_i - b_j| | <= tolerance.
 *
 * Pairings with both lengths within the tolerance are so whatever the pose; such pairs are no edges and have
 * no votes, so that many copies of one wrong pairing do not support each other.
 *
 * 1. Graph: each pairing tries the others in one random cyclic order and keeps its first `max_partners`
 * consistent ones.
 *
 * 2. Core: the subgraph of the highest core number (each member has at least that many neighbours in it; V.
 * Batagelj and M. Zaversnik, "An O(m) algorithm for cores decomposition of networks", 2003).
 *
 * 3. Jury: at most 64 members of the core, at distances above the tolerance from each other and consistent
 * with the best connected one. Every pairing that agrees with most of the jury is in the set, which recovers
 * those that the cap left out of the core and drops those in it by chance; repeated once with a jury from the
 * set.
 *
 * 4. The cap makes the cores of large and small sets alike (a static world, and a vehicle with points
 * enough). The search is repeated without the members of the sets found (at most 8 times), as long as the
 * core left is dense enough for a larger set; the largest is returned, the first one of equals.
 *
 * What it cannot see: wrong pairings that keep the lengths, such as points mirrored through the plane of
 * coplanar inliers. With nothing but outliers the result is a handful of chance pairings: its size tells.
 * Inliers are found as long as their number exceeds, by some, the number of chance partners of a pairing,
 * about N * tolerance / (a quarter of the size of the scene), and chance does not fill `max_partners`.
 *
 * \return Indices, increasing. Pairings with a number that is not finite are never among them. If nothing
 * contradicts (one pairing; all at one place), all finite ones; if no two pairings agree, none. \exception
 * std::invalid_argument if tolerance is not positive and finite, or max_partners is 0.
 *
 * Deterministic: the same bits on any number of threads; ties go to the lower index. Thread-safe. Time: N
 * simple tests for an outlier, max_partners / r for an inlier at a ratio r of inliers (10 000 pairings: 20 ms
 * without outliers, 210 ms with 95 %, two cores). Memory at most 12 * max_partners + 150 bytes per pairing.
 */
std::vector<size_t> consistency_graph_inliers(const MatchedPointList& pairs,
                                              const ConsistencyGraphParameters& params);

}  // namespace mp2p_icp
