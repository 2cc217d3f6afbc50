#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace mp2p_icp
{
/// A part of the sphere, rad.
struct FieldOfView
{
    double azimuth = 0, elevation = 0;            ///< the lower ends
    double azimuth_span = 0, elevation_span = 0;  ///< the former in [0, 2 pi]

    /// The smallest that holds all directions, but for half a degree of azimuth.
    static FieldOfView around(const std::vector<Eigen::Vector3d>& points);
};

/// Which pixel a point falls into, seen from the origin.
class RangeImageGeometry
{
 public:
    /// Rows of equal elevation, columns of equal azimuth about z.
    static RangeImageGeometry spherical(const FieldOfView& view, double pixel_angle);
    /// Looks along z.
    static RangeImageGeometry pinhole(uint32_t cols, uint32_t rows, double cx, double cy, double fx,
                                      double fy);

    /// A pixel so wide (rad) that each of `points` shares it with three others, were they spread evenly.
    static double pixel_angle_for(const FieldOfView& view, size_t points);

    size_t size() const { return static_cast<size_t>(cols_) * static_cast<size_t>(rows_); }
    /// Empty: outside of the image.
    std::optional<size_t> pixel_of(const Eigen::Vector3d& point) const;
    /// The pixel and those around it that exist: their number. The pixel itself comes first.
    size_t neighbourhood(size_t pixel, std::array<size_t, 9>& out) const;

 private:
    bool pinhole_ = false, wraps_ = false;
    int64_t cols_ = 1, rows_ = 1;
    FieldOfView view_;
    double per_azimuth_ = 0, per_elevation_ = 0;  // pixels per rad
    double cx_ = 0, cy_ = 0, fx_ = 0, fy_ = 0;
};

/// The nearest point in each pixel.
class RangeImage
{
 public:
    explicit RangeImage(const RangeImageGeometry& geometry)
        : geometry_(geometry), ranges_(geometry.size(), 0.0f), points_(geometry.size())
    {
    }

    /// Left out if it is outside of the image, or at the origin.
    void insert(const Eigen::Vector3d& point);

    const RangeImageGeometry& geometry() const { return geometry_; }
    bool seen(size_t pixel) const { return ranges_[pixel] > 0; }
    double range(size_t pixel) const { return static_cast<double>(ranges_[pixel]); }
    Eigen::Vector3d point(size_t pixel) const { return points_[pixel].cast<double>(); }

    /// Of the plane through the points of the pixel and its neighbours, if they lie on one.
    std::optional<Eigen::Vector3d> normal(size_t pixel) const;

 private:
    RangeImageGeometry geometry_;
    std::vector<float> ranges_;  // 0: nothing seen
    std::vector<Eigen::Vector3f> points_;
};

}  // namespace mp2p_icp
