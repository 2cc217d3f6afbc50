#pragma once

#include <mp2p_icp_filters/extract_planes.h>

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "VoxelCells.h"

namespace mp2p_icp_filters
{
/// The finite points of a cloud in double, neighbours together: in blocks of cells of a larger side.
struct BlockedPoints
{
    struct Block
    {
        uint32_t first, last;
        Eigen::Vector3d centre, half;  ///< of the box around its points
    };
    std::vector<Eigen::Vector3d> points;
    std::vector<uint32_t> ids;  ///< of each point, in the cloud
    std::vector<Block> blocks;

    BlockedPoints(const mrpt::maps::CPointsMap& cloud, double block_side);
};

/// Count, mean and covariance of points, added up one group at a time.
struct PointMoments
{
    double count = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  ///< sum of (p - mean)(p - mean)'

    void add(const PointMoments& other);
};
PointMoments moments_of(const std::vector<Eigen::Vector3d>& points, const uint32_t* first,
                        const uint32_t* last);

/// A plane through moments, by least squares, and the spread of the points about and in it.
struct MomentPlane
{
    Eigen::Vector3d centre, normal;
    double sigma = 0;                   ///< unbiased, m
    double spread_1 = 0, spread_2 = 0;  ///< standard deviations in the plane, the smaller one first, m
};
MomentPlane plane_through(const PointMoments& moments);

/// A cell of one level with its points.
struct PlaneCell
{
    PointMoments moments;
    MomentPlane plane;
    bool flat = false;
};

/// The cells of one side around some of the points.
class CellLevel
{
 public:
    CellLevel(const BlockedPoints& all, const std::vector<uint32_t>& which, double side,
              const PlaneParameters& parameters);

    double side() const { return side_; }
    const std::vector<PlaneCell>& cells() const { return cells_; }
    const uint32_t* first_point(uint32_t cell) const { return order_.data() + starts_[cell]; }
    const uint32_t* last_point(uint32_t cell) const { return order_.data() + starts_[cell + 1]; }
    /// The numbers of the up to 26 cells that touch it.
    void neighbours(uint32_t cell, std::vector<uint32_t>& out) const;

 private:
    double side_;
    VoxelCells numbers_;
    std::vector<PlaneCell> cells_;
    std::vector<uint32_t> starts_, order_;
};

}  // namespace mp2p_icp_filters
