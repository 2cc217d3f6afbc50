#pragma once

#include <mp2p_icp/metricmap.h>

#include <Eigen/Dense>
#include <array>
#include <vector>

namespace mp2p_icp
{
/// What a cloud looks like around one of its points.
struct SurfaceAround
{
    SurfaceShape shape = SurfaceShape::Unknown;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    /// Columns: normal, and two directions along the surface. Of a line: two across it, and its direction.
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    /// Variances of the normal's error towards axes 1 and 2; of the line's direction towards axes 0 and 1,
    /// rad^2.
    Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
    double thickness = 0;  ///< rms distance of the points around from it, m
    double voxel = 0;      ///< the side of the voxels at which it was seen, m
    bool bulky = false;    ///< about as thick as it is wide: leaves, an edge, a corner

    bool is_surface() const { return shape == SurfaceShape::Planar || shape == SurfaceShape::Linear; }
};

/** Looks around the points of a cloud in neighbourhoods of four sizes (local surfaces of voxels; the smallest
 * hold some 13 points of a surface, each next one four times as many). A plane counts if it is filled with
 * points, or if the next larger size agrees; it is taken at the size at which its normal is known best, as
 * long as larger ones agree. Lines are none: the rings of a LiDAR on a wall look like them from near. What is
 * no plane at any size is `Other`. Of a cloud whose points all have one height (a 2-D scan), what is linear
 * is a wall, and nothing is planar.
 *
 * The surfaces are kept beside the layer: they are found at the first look at a map, which takes about a
 * quarter of a microsecond per point. Then any number of threads may look.
 */
class SurfaceScales
{
 public:
    /// \param voxel_in_use side of voxels (m) whose local surfaces the map has already, 0 if none: the
    /// smallest neighbourhoods are these, if their size will do
    SurfaceScales(const metric_map_t& map, const layer_name_t& layer, double voxel_in_use);

    SurfaceAround at(uint32_t point) const;
    /// The points nearest to places; NO_NEIGHBOR where there is none nearer than `distance` (m).
    std::vector<uint32_t> points_near(const std::vector<Eigen::Vector3d>& places, double distance) const;
    const mrpt::maps::CPointsMap& points() const { return *points_; }
    /// The median distance of a point to its nearest neighbour, m; 0 without any.
    double spacing() const { return spacing_; }
    /// The median thickness of its surfaces at the smallest size, m, over some of the points; 0 without any.
    double typical_thickness() const;

 private:
    const VoxelSurface& surface(size_t size, uint32_t point) const;
    double side(size_t size) const { return smallest_voxel_ * static_cast<double>(1u << size); }
    SurfaceAround judged(size_t size, uint32_t point) const;
    /// Of this plane and those of larger sizes that agree with it, the one whose normal is known best.
    SurfaceAround surest(SurfaceAround plane, size_t next_size, uint32_t point) const;

    mrpt::maps::CPointsMap::ConstPtr points_;
    NearestNeighborIndex::ConstPtr index_;
    std::array<std::shared_ptr<const SurfacesOfVoxels>, 4> sizes_;
    double spacing_ = 0, smallest_voxel_ = 0;
    bool flat_ = false;
};

}  // namespace mp2p_icp
