#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <vector>

namespace mp2p_icp
{
/// A cube of the grid about the origin.
struct Voxel
{
    int32_t x = 0, y = 0, z = 0;
    bool operator==(const Voxel& o) const { return x == o.x && y == o.y && z == o.z; }
};

/// Into which voxel points fall.
class VoxelGrid
{
 public:
    explicit VoxelGrid(double side) : side_(side) {}

    double side() const { return side_; }
    /// Empty: too far away for the grid (a million voxels), or not finite.
    std::optional<Voxel> voxel_of(const Eigen::Vector3d& point) const;
    Eigen::Vector3d centre_of(const Voxel& v) const
    {
        return side_ * (Eigen::Vector3d(v.x, v.y, v.z) + Eigen::Vector3d::Constant(0.5));
    }

 private:
    double side_;
};

/// Numbers the voxels in the order in which they come.
class VoxelTable
{
 public:
    static constexpr uint32_t NONE = UINT32_MAX;

    uint32_t find(const Voxel& v) const;
    uint32_t find_or_add(const Voxel& v);
    const std::vector<Voxel>& voxels() const { return voxels_; }

 private:
    size_t slot_of(const Voxel& v) const;
    void grow();

    std::vector<Voxel> voxels_;
    std::vector<uint32_t> slots_;  // numbers; a power of two of them
};

/// What the points in and around a voxel look like.
struct SurfacePiece
{
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();   ///< columns; the thinnest first
    Eigen::Vector3d variances = Eigen::Vector3d::Zero();  ///< increasing
    bool planar = false;                                  ///< then it has a normal

    Eigen::Vector3d normal() const { return axes.col(0); }
};

/// The surfaces that points occupy, a piece for each voxel.
class VoxelSurfaces
{
 public:
    /// \param flat all points lie in one plane z = const: surfaces are lines in it, their normals too.
    VoxelSurfaces(double side, bool flat) : grid_(side), flat_(flat) {}

    void add(const Eigen::Vector3d& point);
    /// To be called after the last point. A piece is fitted to the points of its voxel and those around it.
    void finish();

    const VoxelGrid& grid() const { return grid_; }
    /// Of the pieces.
    double planar_share() const;
    const SurfacePiece* at(const Voxel& v) const;

    /// How a point lies to the pieces in its voxel and those around it.
    struct Fit
    {
        double score = 0;      ///< exp(-d^2/2), the best
        bool covered = false;  ///< the point stands over a planar piece
    };
    Fit fit(const Eigen::Vector3d& point) const;

    /** Does the ray from the origin through `point` cross a planar piece at a range between these, from which
     * the point is far? Looked at are the MAX_STEPS half voxels nearest to `to_range`.
     */
    bool crosses(const Eigen::Vector3d& point, double from_range, double to_range) const;
    static constexpr double MAX_STEPS = 1000;

    double sigma() const { return 0.25 * grid_.side(); }

 private:
    struct Sums
    {
        double count = 0;
        Eigen::Vector3d first = Eigen::Vector3d::Zero();  // relative to the voxel's centre
        Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    };
    Sums sums_around(const Voxel& v) const;
    SurfacePiece surface(const Voxel& v) const;
    bool separates(const SurfacePiece& piece, const Voxel& v, const Eigen::Vector3d& point, double from_range,
                   double to_range) const;

    VoxelGrid grid_;
    bool flat_;
    VoxelTable table_;
    std::vector<Sums> sums_;
    std::vector<SurfacePiece> surfaces_;
};

}  // namespace mp2p_icp
