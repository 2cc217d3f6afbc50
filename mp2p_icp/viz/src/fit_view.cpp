#include <mp2p_icp/ortho_view.h>
#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mp2p_icp
{
namespace
{
constexpr double OUTSIDE_FRACTION = 0.02;  // of the points, on each side of the middle
constexpr double SLACK = 0.25;      // of the middle's width, added on each side as far as there are points
constexpr double MARGIN = 1.08;     // so that no point sits on the border of the picture
constexpr double DEPTH_MARGIN = 2;  // shows outliers, too, unless they are very far
constexpr double FLAT = 0.02;       // thickness over extent (standard deviations) below which data is flat

struct Span
{
    double lo = 0, hi = 0;

    double width() const { return hi - lo; }
    double middle() const { return 0.5 * (lo + hi); }
};

Span united(const Span& a, const Span& b)
{
    return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)};
}

/// The values without far outliers: everything, if there are none.
Span robust_span(std::vector<double> values)
{
    const auto [min, max] = std::minmax_element(values.begin(), values.end());
    const Span all{*min, *max};
    const auto outside = static_cast<std::ptrdiff_t>(OUTSIDE_FRACTION * static_cast<double>(values.size()));
    std::nth_element(values.begin(), values.begin() + outside, values.end());
    const double lo = values[static_cast<size_t>(outside)];
    std::nth_element(values.begin(), values.end() - 1 - outside, values.end());
    const Span middle{lo, *(values.end() - 1 - outside)};
    if (middle.width() <= 0) return all;
    const double slack = SLACK * middle.width();
    return {std::max(all.lo, middle.lo - slack), std::min(all.hi, middle.hi + slack)};
}

/// Of all sets together, along a direction.
Span robust_span(const std::vector<PointSet>& sets, const mrpt::math::TVector3D& direction)
{
    std::optional<Span> span;
    for (const auto& points : sets)
    {
        if (points.empty()) continue;
        std::vector<double> values;
        values.reserve(points.size());
        for (const auto& p : points)
            values.push_back(p.x * direction.x + p.y * direction.y + p.z * direction.z);
        const Span of_set = robust_span(std::move(values));
        span = span ? united(*span, of_set) : of_set;
    }
    return *span;
}

/// How one set is spread about its own middle, outliers left out.
Eigen::Matrix3d robust_scatter(const PointSet& points)
{
    const std::vector<PointSet> set{points};
    const Span x = robust_span(set, {1, 0, 0}), y = robust_span(set, {0, 1, 0}),
               z = robust_span(set, {0, 0, 1});
    const Eigen::Vector3d reference(x.middle(), y.middle(), z.middle());
    const auto within = [](const Span& s, double value) { return s.lo <= value && value <= s.hi; };
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    double count = 0;
    for (const auto& p : points)
    {
        if (!within(x, p.x) || !within(y, p.y) || !within(z, p.z)) continue;
        const Eigen::Vector3d d =
            to_eigen(p) - reference;  // about the middle: no cancellation far from the origin
        sum += d;
        squares += d * d.transpose();
        count++;
    }
    if (count == 0) return Eigen::Matrix3d::Zero();
    return (squares - sum * sum.transpose() / count) / count;
}

/// The direction in which all sets are thin, if there is one; upwards is tried first.
std::optional<Eigen::Vector3d> normal_of_flat_data(const std::vector<PointSet>& sets)
{
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const auto& points : sets)
        if (!points.empty()) scatter += robust_scatter(points);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
    const Eigen::Vector3d deviations = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
    if (std::sqrt(scatter(2, 2)) <= FLAT * deviations(2)) return Eigen::Vector3d::UnitZ();
    if (deviations(0) > FLAT * deviations(1)) return std::nullopt;
    const Eigen::Vector3d normal = eigen.eigenvectors().col(0);
    return normal.z() < 0 ? Eigen::Vector3d(-normal) : normal;
}

void choose_direction(OrthoView& view, const std::vector<PointSet>& sets, const ViewDirection& wanted)
{
    if (!wanted.azimuth_deg || !wanted.elevation_deg)
        if (const auto normal = normal_of_flat_data(sets); normal)
        {
            view.elevation_deg = mrpt::RAD2DEG(std::asin(std::clamp(normal->z(), -1.0, 1.0)));
            const bool from_above = view.elevation_deg > 89;
            view.azimuth_deg = from_above ? -90 : mrpt::RAD2DEG(std::atan2(normal->y(), normal->x()));
        }
    view.azimuth_deg = wanted.azimuth_deg.value_or(view.azimuth_deg);
    view.elevation_deg = wanted.elevation_deg.value_or(view.elevation_deg);
}

void check(const std::vector<PointSet>& sets, double width_over_height)
{
    if (!(width_over_height > 0)) throw std::invalid_argument("fit_view: width_over_height must be positive");
    size_t count = 0;
    for (const auto& points : sets)
    {
        count += points.size();
        for (const auto& p : points)
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
                throw std::invalid_argument("fit_view: all points must be finite");
    }
    if (count == 0) throw std::invalid_argument("fit_view: there must be at least one point");
}
}  // namespace

OrthoView fit_view(const std::vector<PointSet>& sets, double width_over_height,
                   const ViewDirection& direction)
{
    check(sets, width_over_height);
    OrthoView view;
    choose_direction(view, sets, direction);

    const auto right = view.right(), up = view.up(), depth = view.towards_eye();
    const Span columns = robust_span(sets, right), rows = robust_span(sets, up),
               depths = robust_span(sets, depth);
    view.focus = right * columns.middle() + up * rows.middle() + depth * depths.middle();
    view.height = MARGIN * std::max(rows.width(), columns.width() / width_over_height);
    // Data without extent, down to rounding: a picture of one metre.
    const double rounding = 1e-9 * std::max(1.0, view.focus.norm());
    if (view.height < rounding) view.height = 1;
    view.depth = std::max(view.height, DEPTH_MARGIN * 0.5 * depths.width());
    return view;
}

}  // namespace mp2p_icp
