#include "RangeImage.h"

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
namespace
{
constexpr double POINTS_PER_PIXEL = 4;
constexpr int AZIMUTH_BINS = 720;

double azimuth_of(const Eigen::Vector3d& p)
{
    return std::atan2(p.y(), p.x());
}
double elevation_of(const Eigen::Vector3d& p)
{
    return std::atan2(p.z(), std::hypot(p.x(), p.y()));
}
/// In [0, 2 pi).
double wrapped(double angle)
{
    const double turns = angle / (2 * M_PI);
    return (turns - std::floor(turns)) * 2 * M_PI;
}

/// First bin and number of bins of the shortest arc that holds all that are set.
std::pair<int, int> shortest_arc(const std::vector<bool>& set)
{
    const int n = static_cast<int>(set.size());
    int start = 0, longest = 0, empty = 0;
    for (int i = 0; i < 2 * n; i++)  // twice around, so that a gap over the end is seen whole
    {
        empty = set[static_cast<size_t>(i % n)] ? 0 : empty + 1;
        if (empty > longest && empty <= n) longest = empty, start = (i + 1) % n;
    }
    return {start, n - longest};
}
}  // namespace

FieldOfView FieldOfView::around(const std::vector<Eigen::Vector3d>& points)
{
    FieldOfView view;
    if (points.empty()) return view;
    std::vector<bool> bins(AZIMUTH_BINS, false);
    double lo = M_PI, hi = -M_PI;
    for (const auto& p : points)
    {
        bins[std::min<size_t>(AZIMUTH_BINS - 1, static_cast<size_t>(wrapped(azimuth_of(p)) / (2 * M_PI) *
                                                                    AZIMUTH_BINS))] = true;
        lo = std::min(lo, elevation_of(p)), hi = std::max(hi, elevation_of(p));
    }
    const auto [first, count] = shortest_arc(bins);
    constexpr double BIN = 2 * M_PI / AZIMUTH_BINS;
    view.azimuth = first * BIN, view.azimuth_span = count * BIN;
    view.elevation = lo, view.elevation_span = hi - lo;
    return view;
}

double RangeImageGeometry::pixel_angle_for(const FieldOfView& view, size_t points)
{
    // (azimuth / a + 1) (elevation / a + 1) = pixels, solved for a
    const double pixels = std::max(2.0, static_cast<double>(points) / POINTS_PER_PIXEL);
    const double sum = view.azimuth_span + view.elevation_span;
    const double product = view.azimuth_span * view.elevation_span;
    return (sum + std::sqrt(sum * sum + 4 * (pixels - 1) * product)) / (2 * (pixels - 1));
}

RangeImageGeometry RangeImageGeometry::spherical(const FieldOfView& view, double pixel_angle)
{
    RangeImageGeometry g;
    g.view_ = view;
    g.wraps_ = view.azimuth_span + 2 * pixel_angle > 2 * M_PI;
    if (g.wraps_) g.view_.azimuth_span = 2 * M_PI;
    // A full turn is divided evenly; other sides get half a pixel of margin at each end.
    g.cols_ = g.wraps_ ? std::max<int64_t>(1, static_cast<int64_t>(2 * M_PI / pixel_angle))
                       : 1 + static_cast<int64_t>(std::ceil(view.azimuth_span / pixel_angle));
    g.rows_ = 1 + static_cast<int64_t>(std::ceil(view.elevation_span / pixel_angle));
    g.per_azimuth_ = g.wraps_ ? static_cast<double>(g.cols_) / (2 * M_PI) : 1 / pixel_angle;
    g.per_elevation_ = 1 / pixel_angle;
    return g;
}

RangeImageGeometry RangeImageGeometry::pinhole(uint32_t cols, uint32_t rows, double cx, double cy, double fx,
                                               double fy)
{
    RangeImageGeometry g;
    g.pinhole_ = true;
    g.cols_ = cols, g.rows_ = rows, g.cx_ = cx, g.cy_ = cy, g.fx_ = fx, g.fy_ = fy;
    return g;
}

std::optional<size_t> RangeImageGeometry::pixel_of(const Eigen::Vector3d& p) const
{
    double col = -1, row = -1;
    if (pinhole_)
    {
        if (p.z() > 0) col = cx_ + fx_ * p.x() / p.z() + 0.5, row = cy_ + fy_ * p.y() / p.z() + 0.5;
    }
    else
    {
        // Angles a little below the lower end are in the margin, not a turn away.
        const double below = wraps_ ? 0.0 : 0.5 / per_azimuth_;
        col = wrapped(azimuth_of(p) - view_.azimuth + below) * per_azimuth_;
        if (wraps_ && col >= static_cast<double>(cols_)) col = 0;  // rounding
        row = (elevation_of(p) - view_.elevation) * per_elevation_ + 0.5;
    }
    if (!(col >= 0 && row >= 0 && col < static_cast<double>(cols_) && row < static_cast<double>(rows_)))
        return {};
    return static_cast<size_t>(row) * static_cast<size_t>(cols_) + static_cast<size_t>(col);
}

size_t RangeImageGeometry::neighbourhood(size_t pixel, std::array<size_t, 9>& out) const
{
    const int64_t row = static_cast<int64_t>(pixel) / cols_, col = static_cast<int64_t>(pixel) % cols_;
    size_t count = 0;
    out[count++] = pixel;
    for (int64_t r = row - 1; r <= row + 1; r++)
        for (int64_t c = col - 1; c <= col + 1; c++)
        {
            if (r < 0 || r >= rows_ || (r == row && c == col)) continue;
            if ((c < 0 || c >= cols_) && (!wraps_ || cols_ < 3)) continue;
            out[count++] = static_cast<size_t>(r * cols_ + (c + cols_) % cols_);
        }
    return count;
}

void RangeImage::insert(const Eigen::Vector3d& point)
{
    const float range = static_cast<float>(point.norm());
    if (!(range > 0 && std::isfinite(range))) return;
    const auto pixel = geometry_.pixel_of(point);
    if (!pixel || (seen(*pixel) && ranges_[*pixel] <= range)) return;
    ranges_[*pixel] = range;
    points_[*pixel] = point.cast<float>();
}

std::optional<Eigen::Vector3d> RangeImage::normal(size_t pixel) const
{
    constexpr size_t MIN_POINTS = 5;
    constexpr double MAX_THICKNESS = 0.05, MIN_WIDTH = 1e-4;  // ratios of variances
    std::array<size_t, 9> around;
    const size_t count = geometry_.neighbourhood(pixel, around);
    size_t n = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (size_t k = 0; k < count; k++)
    {
        if (!seen(around[k])) continue;
        const Eigen::Vector3d d = point(around[k]) - point(pixel);
        sum += d, squares += d * d.transpose(), n++;
    }
    if (n < MIN_POINTS) return {};
    const double N = static_cast<double>(n);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(squares / N - sum * sum.transpose() / (N * N));
    const auto& v = eigen.eigenvalues();
    if (!(v[0] <= MAX_THICKNESS * v[1] && v[1] >= MIN_WIDTH * v[2] && v[1] > 0)) return {};
    return Eigen::Vector3d(eigen.eigenvectors().col(0));
}

}  // namespace mp2p_icp
