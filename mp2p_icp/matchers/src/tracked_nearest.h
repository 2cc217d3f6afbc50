#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/block_grid.h>

namespace mp2p_icp
{
/** The nearest global points of local points, found as by NearestNeighborIndex::nearest(), to the bit; but a
 * point that was looked for before, and has not moved far enough since then to have another neighbour, is not
 * looked for again. From one iteration of ICP to the next, that is most of them; and at the end, when the fit
 * is compared with that of the guess, nearly all: where points were looked for first is remembered, too. One
 * thread at a time may use an object.
 */
class TrackedNearest
{
 public:
    /** Into ids and dist_sq, for each local point: its nearest one of `points` nearer than sqrt(max_dist_sq),
     * else NO_NEIGHBOR and infinity. \param index of `points`, the same ones at every call
     */
    void find(const NearestNeighborIndex& index, const PointView& points, const LocalPoints& local,
              const float* max_dist_sq, std::vector<uint32_t>& ids, std::vector<float>& dist_sq);

 private:
    /// What a search found, and where the point was then.
    struct Memory
    {
        float x = 0, y = 0, z = 0;
        uint32_t nearest = NO_NEIGHBOR;
        float others = 0;  ///< BoundedNeighbor::others
    };
    struct Point;
    /// Is the answer for the point known from there? Then it is written.
    static bool knows(const Memory& memory, const Point& now, const PointView& points, float max_dist_sq,
                      uint32_t& id, float& dist_sq);
    /// Searches for the points `which`, and remembers.
    void search(const NearestNeighborIndex& index, const std::vector<uint32_t>& which, const PointArrays& now,
                const float* max_dist_sq, std::vector<uint32_t>& ids, std::vector<float>& dist_sq);

    std::vector<uint32_t> local_ids_;   ///< whose neighbours these are
    std::vector<Memory> first_, last_;  ///< one per point
};

}  // namespace mp2p_icp
