#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/block_grid.h>

namespace mp2p_icp
{
/** The nearest global points of local points, found as by NearestNeighborIndex::nearest(), to the bit; but a
 * point that was looked for before, and has not moved far enough since then to have another neighbour, is not
 * looked for again. From one iteration of ICP to the next, that is most of them. One thread at a time may use
 * an object.
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
    /// Is the answer for the i-th point known from before? Then it is written.
    bool is_known(size_t i, const PointView& points, const PointArrays& now, float max_dist_sq, uint32_t& id,
                  float& dist_sq) const;
    /// Searches for the points `which`, and remembers.
    void search(const NearestNeighborIndex& index, const std::vector<uint32_t>& which, const PointArrays& now,
                const float* max_dist_sq, std::vector<uint32_t>& ids, std::vector<float>& dist_sq);

    std::vector<uint32_t> local_ids_;  ///< whose neighbours these are
    PointArrays at_;                   ///< where they were when they were looked for
    std::vector<uint32_t> nearest_;
    std::vector<float> others_;  ///< BoundedNeighbor::others
};

}  // namespace mp2p_icp
