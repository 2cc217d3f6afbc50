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
    /// What a search found.
    struct Memory
    {
        PointArrays at;  ///< where the points were then
        std::vector<uint32_t> nearest;
        std::vector<float> others;  ///< BoundedNeighbor::others

        void resize(size_t n) { at.resize(n), nearest.resize(n), others.resize(n); }
        /// Is the answer for the i-th point known from it? Then it is written.
        bool knows(size_t i, const PointView& points, const PointArrays& now, float max_dist_sq, uint32_t& id,
                   float& dist_sq) const;
        void remember(size_t i, const PointArrays& now, uint32_t found, float others_from);
    };
    /// Searches for the points `which`, and remembers.
    void search(const NearestNeighborIndex& index, const std::vector<uint32_t>& which, const PointArrays& now,
                const float* max_dist_sq, std::vector<uint32_t>& ids, std::vector<float>& dist_sq);

    std::vector<uint32_t> local_ids_;  ///< whose neighbours these are
    Memory first_, last_;
};

}  // namespace mp2p_icp
