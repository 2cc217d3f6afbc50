#pragma once

#include <mrpt/maps/CPointsMap.h>
#include <mrpt/math/TBoundingBox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

namespace mp2p_icp
{
/// Points as three arrays of the same length.
struct PointArrays
{
    std::vector<float> x, y, z;
    size_t size() const { return x.size(); }
    void resize(size_t n) { x.resize(n), y.resize(n), z.resize(n); }
};

/// Index of "no neighbour".
constexpr uint32_t NO_NEIGHBOR = UINT32_MAX;

/// A distance below that of a squared one in float, by more than the rounding of three squares, a root, and
/// of what a caller subtracts from it.
inline float surely_nearer_than(float dist_sq)
{
    if (!(dist_sq > 2 * std::numeric_limits<float>::min())) return 0;
    return std::sqrt(std::min(dist_sq, std::numeric_limits<float>::max())) * (1 - 4e-6f);
}

/** Nearest neighbours among the points of one layer. Built once, never changes; any number of threads may ask
 * at once. Distances are Euclidean, squared, in float, as the layer's coordinates are.
 */
class NearestNeighborIndex
{
 public:
    using ConstPtr = std::shared_ptr<const NearestNeighborIndex>;
    virtual ~NearestNeighborIndex() = default;

    virtual size_t size() const = 0;

    /// The box around the finite points; empty if there are none.
    virtual std::optional<mrpt::math::TBoundingBoxf> bounding_box() const = 0;

    /** For each query in [first, last): the up to `k` nearest points closer than sqrt(max_dist_sq[i]),
     * nearest first, into ids[i*k ...] and dist_sq[i*k ...]; the rest is filled with NO_NEIGHBOR. Every entry
     * of max_dist_sq may be infinite. One virtual call for a whole range of points; O(k + log size) each.
     */
    virtual void nearest(const PointArrays& queries, size_t first, size_t last, uint32_t k,
                         const float* max_dist_sq, uint32_t* ids, float* dist_sq) const = 0;

    /** As nearest() with k = 1; and into others[i], lower bounds of the distances (m) of all other points:
     * rounding included, so that a caller may tell for sure that a query that has moved a little still has
     * the same neighbour (see BoundedNeighbor).
     */
    virtual void nearest_and_bound(const PointArrays& queries, size_t first, size_t last,
                                   const float* max_dist_sq, uint32_t* ids, float* dist_sq,
                                   float* others) const = 0;
};

/** A KD-tree (nanoflann) over the map's own coordinate buffers. The map is kept alive, and must not change.
 * \param leaf_max_points 0: the default, 10.
 */
NearestNeighborIndex::ConstPtr make_kdtree_index(const mrpt::maps::CPointsMap::ConstPtr& points,
                                                 uint32_t leaf_max_points = 0);

/** Blocks (see BlockGrid) with some 16 points each; the same answers, two to three times as fast where the
 * density of the points does not vary too much: voxel-decimated clouds, surfaces. Null where it does, so that
 * a search among the points would look at more than some 100 of them on average. The map is kept alive, and
 * must not change.
 */
NearestNeighborIndex::ConstPtr make_block_grid_index(const mrpt::maps::CPointsMap::ConstPtr& points);

/// The faster one for these points. \param leaf_max_points if not 0: a KD-tree with such leaves
NearestNeighborIndex::ConstPtr make_nn_index(const mrpt::maps::CPointsMap::ConstPtr& points,
                                             uint32_t leaf_max_points = 0);

}  // namespace mp2p_icp
