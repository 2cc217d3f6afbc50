#pragma once

#include <mp2p_icp/nn_index.h>

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

namespace mp2p_icp
{
/// Coordinates of a cloud that belong to somebody else.
struct PointView
{
    const float *x = nullptr, *y = nullptr, *z = nullptr;
    size_t size = 0;

    PointView() = default;
    PointView(const PointArrays& a) : x(a.x.data()), y(a.y.data()), z(a.z.data()), size(a.size()) {}
    PointView(const mrpt::maps::CPointsMap& cloud)
        : x(cloud.getPointsBufferRef_x().data()),
          y(cloud.getPointsBufferRef_y().data()),
          z(cloud.getPointsBufferRef_z().data()),
          size(cloud.size())
    {
    }
};

/// What BlockGrid searches among.
enum class GridElements : uint8_t
{
    Points,      ///< the given points; indices are theirs
    VoxelMeans,  ///< the means of the voxels; indices are those of means()
    None         ///< nothing: only the voxels are wanted
};

struct BlockGridOptions
{
    double voxel_size =
        0;  ///< m; any positive number. Without influence on what nearest() finds among Points
    GridElements elements = GridElements::VoxelMeans;
    bool moments = false;  ///< keep what surfaces() needs
};

/** The distribution of all points in the 3x3x3 voxels around one voxel (each point counts once).
 * The normal belongs to the smallest eigenvalue, and its largest component is positive; it is 0 where there
 * is none: fewer than three points, or points along a line. So does the direction to the largest one; it is 0
 * where that is not larger than the middle one.
 */
struct VoxelSurface
{
    float nx = 0, ny = 0, nz = 0;
    float dx = 0, dy = 0, dz = 0;
    float mean_x = 0, mean_y = 0, mean_z = 0;  ///< of the points, m
    float eigenvalues[3] = {0, 0, 0};          ///< of the covariance (divided by count), increasing, m^2
    uint32_t count = 0;                        ///< of points
    uint32_t voxels = 0;                       ///< of the 27, how many have points

    bool has_normal() const { return nx != 0 || ny != 0 || nz != 0; }
    /// Smallest eigenvalue over the sum of all three: 0 on a plane, 1/3 in a ball. 0 if all points are equal.
    float curvature() const;
};

struct GridNeighbor
{
    uint32_t id = NO_NEIGHBOR;
    float dist_sq = std::numeric_limits<float>::infinity();
};

/// A nearest neighbour, and how far all others are at least.
struct BoundedNeighbor : public GridNeighbor
{
    /// No other element is nearer than this (m): a lower bound, rounding included, and often the distance of
    /// the second. 1.8e19 if there is no other.
    float others = 0;

    /** Is `id` still the one that nearest() would find, now that the query is moved by `moved` (m) and at
     * `dist_sq_now` from it? True only if it is for sure.
     */
    bool is_still_nearest(float moved, float dist_sq_now) const
    {
        return id != NO_NEIGHBOR && std::sqrt(dist_sq_now) < others - moved;
    }
    /// If nothing was found: is there for sure nothing within max_distance of a query moved by `moved`?
    bool is_still_alone(float moved, float max_distance) const
    {
        return id == NO_NEIGHBOR && max_distance < others - moved;
    }
};

/** Decimation, nearest neighbours and normals in one structure: the voxels of a cloud, in blocks of 4x4x4.
 *
 * Voxels are `[k*side, (k+1)*side)` on each axis for every whole k (as for FilterDecimateVoxels): a point
 * exactly on a face belongs to the voxel above it. Blocks are ordered along a space-filling curve (Morton),
 * voxels by block, so that what is near in space is near in memory. Points that are not finite are left out,
 * and counted.
 *
 * Searches are exact: the same neighbour, to the bit of its distance, as comparing with every element would
 * give, with distances in float and ties won by the lower index. They look into the blocks around the query,
 * and, where those do not decide, into a tree of boxes around the blocks, so that they end soon for any
 * radius. Typical cost 0.1 microseconds where the radius is below a block's side (4 voxels).
 *
 * Never changes after it was built; any number of threads may ask at once. Same input, same bits.
 */
class BlockGrid
{
 public:
    BlockGrid();
    /// \exception std::invalid_argument see rebuild()
    BlockGrid(const PointView& points, const BlockGridOptions& options);
    ~BlockGrid();
    BlockGrid(BlockGrid&&) noexcept;
    BlockGrid& operator=(BlockGrid&&) noexcept;

    /** Builds it anew. Reuses all memory, that of intermediate results too (which a grid made by the
     * constructor has given back). The points are copied where needed. O(points), about 13 ns each.
     * \exception std::invalid_argument if the side of the voxels is not positive and finite, if there are
     * 2^29 points or more, or if voxels are to be computed (VoxelMeans or moments) and a point is farther
     * than 2^30 of them from the middle of the cloud, or 2^50 from zero. The grid is empty then.
     */
    void rebuild(const PointView& points, const BlockGridOptions& options);

    const BlockGridOptions& options() const;
    /// Indices of elements are below this: the number of given points, or of voxels.
    size_t size() const;
    /// How many of the given points were not finite.
    size_t skipped_points() const;
    size_t block_count() const;
    /// How many elements there are in the block of an element, on average over the elements: what a search
    /// looks at, at least. 0 without elements. O(blocks).
    double mean_companions() const;
    /// The box around the elements; empty if there are none.
    std::optional<mrpt::math::TBoundingBoxf> bounding_box() const;

    /** \name The decimated cloud. Empty for GridElements::Points without moments.
     * @{ */
    /// The mean of each voxel that has points. Empty for GridElements::Points.
    const PointArrays& means() const;
    size_t voxel_count() const;
    /// How many points each voxel has.
    const std::vector<uint32_t>& point_counts() const;
    /// The voxel of each given point; NO_NEIGHBOR for those left out.
    const std::vector<uint32_t>& voxel_of_point() const;
    /** @} */

    /** The surface around each voxel, about 0.1 microseconds each, on all threads. Needs
     * BlockGridOptions::moments. \param min_spread no normal where the middle eigenvalue is below this times
     * the squared voxel side: there the points lie along a line. \exception std::invalid_argument if the grid
     * was built without moments
     */
    void surfaces(std::vector<VoxelSurface>& out, double min_spread = 1e-4) const;

    /** \name Search. Finds elements closer than sqrt(max_dist_sq), which may be infinite. A query that is not
     * finite has no neighbour.
     * @{ */
    GridNeighbor nearest(float x, float y, float z, float max_dist_sq) const;
    /// Also bounds the distance of all others, so that a caller can tell how far the query may move.
    BoundedNeighbor nearest_and_bound(float x, float y, float z, float max_dist_sq) const;
    /// The up to k nearest, nearest first. \return how many
    uint32_t nearest_k(float x, float y, float z, float max_dist_sq, uint32_t k, uint32_t* ids,
                       float* dist_sq) const;
    /** @} */

 private:
    std::unique_ptr<struct BlockGridData> data_;
};

/// The voxels of a cloud, and the surfaces around them.
struct SurfacesOfVoxels
{
    std::vector<uint32_t> voxel_of_point;  ///< NO_NEIGHBOR for points that are not finite
    std::vector<VoxelSurface> of_voxel;
};

/// BlockGrid::surfaces() of voxels of that side (m). \exception std::invalid_argument as BlockGrid::rebuild()
SurfacesOfVoxels voxel_surfaces(const PointView& points, double side);

}  // namespace mp2p_icp
