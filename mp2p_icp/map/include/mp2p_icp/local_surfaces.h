#pragma once

#include <mp2p_icp/block_grid.h>
#include <mp2p_icp/nn_index.h>
#include <mrpt/maps/CPointsMap.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

namespace mp2p_icp
{
/** Which points of a layer make the neighbourhood of one of them: the nearest ones, or, with `voxel`, all
 * that are in the 3x3x3 voxels around its own (BlockGrid::surfaces()), which takes a tenth of the time.
 */
struct LocalSurfaceOptions
{
    uint32_t neighbors = 10;  ///< the nearest so many, itself included (ties by the lower index); at least 1
    double radius = 0.5;      ///< m, > 0; those nearer than this

    double voxel = 0;  ///< side of the voxels, m; above 0: in place of the other two

    static LocalSurfaceOptions of_voxels(double side) { return {0, 0, side}; }
    bool operator==(const LocalSurfaceOptions& o) const
    {
        return neighbors == o.neighbors && radius == o.radius && voxel == o.voxel;
    }
};

enum class SurfaceShape : uint8_t
{
    Other,   ///< a ball, an edge, noise
    Planar,  ///< LocalSurface::normal means something
    Linear,  ///< LocalSurface::direction means something
    Unknown  ///< too few points, or all at one place
};

/** What counts as planar or linear, by the eigenvalues e0 <= e1 <= e2 of the covariance of a neighbourhood:
 * linear where e1 <= line * e2; planar where it is not linear, e0 <= plane * e2 (else it is a blob) and
 * e1 >= plane_width * e2 (else it is a strip too narrow to tell a normal).
 */
struct ShapeLimits
{
    double plane = 0.01, plane_width = 0.1, line = 0.01;
    uint32_t plane_points = 3, line_points = 3;  ///< in the neighbourhood, at least
};

/// The distribution of the points around one point of a layer.
struct LocalSurface
{
    /// From the point to the mean of its neighbourhood, m.
    Eigen::Vector3f to_mean = Eigen::Vector3f::Zero();
    /// Unit eigenvectors of the smallest and of the largest eigenvalue; of their components of the largest
    /// magnitude the first is positive. Zero where `count` is 0.
    Eigen::Vector3f normal = Eigen::Vector3f::Zero(), direction = Eigen::Vector3f::Zero();
    /// Of the covariance (divided by count), increasing, m^2.
    Eigen::Vector3f eigenvalues = Eigen::Vector3f::Zero();
    uint32_t count = 0;  ///< of points in the neighbourhood; 0 for a point that is not finite
    uint32_t voxels =
        0;  ///< how many of the 27 voxels have points: a filled plane has 9 or more, a curve in it fewer

    SurfaceShape shape(const ShapeLimits& limits) const;
};

/// The surfaces around all points of a layer, one per point, in its order. Never changes.
struct LocalSurfaces
{
    using ConstPtr = std::shared_ptr<const LocalSurfaces>;
    LocalSurfaceOptions options;
    std::vector<LocalSurface> of_point;
};

/** Computes them, on all threads; the same bits on any number of them, and by any index. About a microsecond
 * per point, for 10 neighbours; of voxels, 0.1. metric_map_t::local_surfaces() keeps the result beside the
 * layer. \param index of these points; not used, and may be null, with `voxel` \exception
 * std::invalid_argument for options out of their ranges, or what BlockGrid::rebuild() refuses.
 */
LocalSurfaces::ConstPtr compute_local_surfaces(const mrpt::maps::CPointsMap& points,
                                               const NearestNeighborIndex* index,
                                               const LocalSurfaceOptions& options);

/// What the surfaces of voxels say at the points. \param options what the result keeps
LocalSurfaces::ConstPtr local_surfaces_of(const PointView& points, const SurfacesOfVoxels& voxels,
                                          const LocalSurfaceOptions& options);

}  // namespace mp2p_icp
