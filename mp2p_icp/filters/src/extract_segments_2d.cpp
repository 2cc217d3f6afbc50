#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp_filters/extract_segments_2d.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

namespace mp2p_icp_filters
{
using Eigen::Matrix2d;
using Eigen::Vector2d;
using mp2p_icp::Range;

void SegmentParameters::declare_parameters(mp2p_icp::ParameterDeclaration& declare)
{
    declare.number("segment_maximum_gap", maximum_gap, "m", Range::positive(),
                   "2-D scans: largest distance between neighbours on one wall.");
    declare.number("segment_split_distance", split_distance, "m", Range::positive(),
                   "2-D scans: a wall is split at a point that is farther from its chord.");
    declare.integer("segment_minimum_inliers", minimum_inliers, Range::between(4, UINT32_MAX),
                    "2-D scans: walls with fewer points are dropped.");
    declare.number("segment_minimum_length", minimum_length, "m", Range::not_negative(),
                   "2-D scans: shorter walls are dropped.");
    declare.number("segment_maximum_noise", maximum_noise, "m", Range::positive(),
                   "2-D scans: largest standard deviation of the distances to a wall.");
    declare.number("corner_minimum_angle_deg", minimum_corner_angle_deg, "deg", Range::between(1, 89),
                   "2-D scans: walls that meet at a smaller angle (or one nearer to 180) make no corner.");
    declare.number("corner_distance", corner_distance, "m", Range::positive(),
                   "2-D scans: how near to their corner both walls must end.");
}

namespace
{
struct ScanPoint
{
    double azimuth;
    Vector2d place;  // in the frame of the cloud
    uint32_t id;
};

/// The points sorted by azimuth from the farthest one on, and their height.
struct SortedScan
{
    std::vector<ScanPoint> points;
    double height = 0;
};

SortedScan sorted_scan(const mrpt::maps::CPointsMap& cloud, const Vector2d& sensor)
{
    SortedScan scan;
    float lowest = 0, highest = 0;
    for (const size_t i : mp2p_icp::finite_points(cloud))
    {
        float x = 0, y = 0, z = 0;
        cloud.getPointFast(i, x, y, z);
        const Vector2d place{static_cast<double>(x), static_cast<double>(y)}, ray = place - sensor;
        if (scan.points.empty()) lowest = highest = z;
        lowest = std::min(lowest, z), highest = std::max(highest, z);
        if (ray.norm() > 0)
            scan.points.push_back({std::atan2(ray.y(), ray.x()), place, static_cast<uint32_t>(i)});
    }
    const double spread = static_cast<double>(highest) - static_cast<double>(lowest);
    if (spread > 1e-3 + 1e-6 * std::abs(static_cast<double>(highest)))
        throw std::invalid_argument(
            "extract_segments_2d: the points of a 2-D scan must be of one height, and they spread over " +
            std::to_string(spread) + " m");
    scan.height = (static_cast<double>(lowest) + static_cast<double>(highest)) / 2;
    std::stable_sort(scan.points.begin(), scan.points.end(),
                     [](const ScanPoint& a, const ScanPoint& b) { return a.azimuth < b.azimuth; });
    const auto farthest = std::max_element(scan.points.begin(), scan.points.end(),
                                           [&sensor](const ScanPoint& a, const ScanPoint& b)
                                           { return (a.place - sensor).norm() < (b.place - sensor).norm(); });
    std::rotate(scan.points.begin(), farthest, scan.points.end());
    return scan;
}

constexpr size_t ENDS = 2;  // points at each end of a wall that may belong to the next one

/// Points first..last-1 of the scan.
struct Piece
{
    size_t first, last;
    size_t size() const { return last - first; }
};

/// A line through points of a piece.
struct Line2d
{
    Vector2d centre, direction;  // unit
    double noise = 0, farthest = 0;
    Vector2d across() const { return {-direction.y(), direction.x()}; }
};

class SegmentSearch
{
 public:
    SegmentSearch(const SortedScan& scan, const SegmentParameters& parameters)
        : scan_(scan), parameters_(parameters)
    {
    }

    /// Those that are long, straight and full enough, in order.
    std::vector<Piece> pieces() const
    {
        std::vector<Piece> out;
        for (const Piece& run : runs())
        {
            std::vector<Piece> of_run;
            split(run, of_run);
            join(of_run);
            for (const Piece& piece : of_run)
                if (is_wall(piece)) out.push_back(trimmed(piece));
        }
        return out;
    }

    Line2d line_of(const Piece& piece) const
    {
        Line2d line{Vector2d::Zero(), Vector2d::UnitX()};
        for (size_t i = piece.first; i < piece.last; i++) line.centre += place(i);
        line.centre /= static_cast<double>(piece.size());
        Matrix2d scatter = Matrix2d::Zero();
        for (size_t i = piece.first; i < piece.last; i++)
        {
            const Vector2d d = place(i) - line.centre;
            scatter += d * d.transpose();
        }
        const Eigen::SelfAdjointEigenSolver<Matrix2d> eigen(scatter);
        line.direction = eigen.eigenvectors().col(1);
        if (line.direction.dot(place(piece.last - 1) - place(piece.first)) < 0)
            line.direction = -line.direction;
        for (size_t i = piece.first; i < piece.last; i++)
            line.farthest = std::max(line.farthest, std::abs(line.across().dot(place(i) - line.centre)));
        const double free = std::max(1.0, static_cast<double>(piece.size()) - 2);
        line.noise = std::sqrt(std::max(0.0, eigen.eigenvalues()(0)) / free);
        return line;
    }

 private:
    const Vector2d& place(size_t i) const { return scan_.points[i].place; }

    std::vector<Piece> runs() const
    {
        std::vector<Piece> out;
        for (size_t i = 0; i < scan_.points.size(); i++)
        {
            if (i == 0 || (place(i) - place(i - 1)).norm() > parameters_.maximum_gap) out.push_back({i, i});
            out.back().last = i + 1;
        }
        return out;
    }

    void split(const Piece& whole, std::vector<Piece>& out) const
    {
        std::vector<Piece> pending = {whole};
        while (!pending.empty())
        {
            const Piece piece = pending.back();
            pending.pop_back();
            const size_t at = farthest_from_chord(piece);
            if (at == piece.first)
            {
                out.push_back(piece);
                continue;
            }
            pending.push_back({at, piece.last});  // popped second: pieces come out in their order
            pending.push_back({piece.first, at});
        }
    }

    /// Where to split; the first point if the piece is straight enough.
    size_t farthest_from_chord(const Piece& piece) const
    {
        size_t at = piece.first;
        if (piece.size() < 3) return at;
        const Vector2d from = place(piece.first), chord = place(piece.last - 1) - from;
        const double length = chord.norm();
        double farthest = parameters_.split_distance;
        for (size_t i = piece.first + 1; i + 1 < piece.last; i++)
        {
            const Vector2d d = place(i) - from;
            const double distance =
                length > 0 ? std::abs(chord.x() * d.y() - chord.y() * d.x()) / length : d.norm();
            if (distance > farthest) farthest = distance, at = i;
        }
        return at;
    }

    void join(std::vector<Piece>& pieces) const
    {
        for (size_t i = 0; i + 1 < pieces.size();)
        {
            const Piece both{pieces[i].first, pieces[i + 1].last};
            const Line2d line = line_of(both);
            if (line.farthest > parameters_.split_distance || line.noise > parameters_.maximum_noise)
            {
                i++;
                continue;
            }
            pieces[i] = both;
            pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(i) + 1);
        }
    }

    bool is_wall(const Piece& piece) const
    {
        if (piece.size() < parameters_.minimum_inliers + 2 * ENDS) return false;
        return (place(piece.last - 1) - place(piece.first)).norm() >= parameters_.minimum_length &&
               line_of(trimmed(piece)).noise <= parameters_.maximum_noise;
    }

    static Piece trimmed(const Piece& piece) { return {piece.first + ENDS, piece.last - ENDS}; }

    const SortedScan& scan_;
    const SegmentParameters& parameters_;
};

Segment2d described(const SortedScan& scan, const Piece& piece, const Line2d& line)
{
    Segment2d out;
    out.line.pBase = {line.centre.x(), line.centre.y(), scan.height};
    out.line.director = {line.direction.x(), line.direction.y(), 0};
    auto& fit = out.line.fit.emplace();
    fit.axis_a = {line.across().x(), line.across().y(), 0};
    Matrix2d normal = Matrix2d::Zero(), squares = Matrix2d::Zero();
    for (size_t i = piece.first; i < piece.last; i++)
    {
        const Vector2d d = scan.points[i].place - line.centre;
        const double s = line.direction.dot(d), r = line.across().dot(d);
        const Vector2d x(1, s);
        normal += x * x.transpose(), squares += r * r * x * x.transpose();
        fit.begin = std::min(fit.begin, s), fit.end = std::max(fit.end, s);
        out.inliers.push_back(scan.points[i].id);
    }
    const double count = static_cast<double>(piece.size());
    const Matrix2d inverse = normal.inverse(),
                   covariance = inverse * squares * inverse * (count / (count - 2));
    fit.inliers = piece.size(), fit.sigma = line.noise;
    fit.covariance.diagonal().setConstant(UNKNOWN_VARIANCE);
    fit.covariance(0, 0) = covariance(0, 0), fit.covariance(2, 2) = covariance(1, 1);
    fit.covariance(0, 2) = fit.covariance(2, 0) = (covariance(0, 1) + covariance(1, 0)) / 2;
    return out;
}

double distance_to_segment(const Vector2d& p, const Line2d& line, const mp2p_icp::line_fit_t& fit)
{
    const double s = std::clamp(line.direction.dot(p - line.centre), fit.begin, fit.end);
    return (p - line.centre - s * line.direction).norm();
}

std::optional<Vector2d> crossing(const Line2d& a, const Line2d& b, double minimum_angle)
{
    const double sine = a.across().dot(b.direction);
    if (!(std::abs(sine) >= std::sin(minimum_angle))) return {};
    return Vector2d(b.centre + b.direction * (a.across().dot(a.centre - b.centre) / sine));
}

void check(bool rule, const char* text)
{
    if (!rule) throw std::invalid_argument(std::string("extract_segments_2d: ") + text);
}

void check_all(const SegmentParameters& p)
{
    check(p.maximum_gap > 0, "maximum_gap must be above zero");
    check(p.split_distance > 0, "split_distance must be above zero");
    check(p.minimum_inliers >= 4, "minimum_inliers must be at least 4");
    check(p.minimum_length >= 0, "minimum_length must not be negative");
    check(p.maximum_noise > 0, "maximum_noise must be above zero");
    check(p.minimum_corner_angle_deg >= 1 && p.minimum_corner_angle_deg <= 89,
          "minimum_corner_angle_deg must be in [1, 89]");
    check(p.corner_distance > 0, "corner_distance must be above zero");
}
}  // namespace

Segments2d extract_segments_2d(const mrpt::maps::CPointsMap& cloud, const SegmentParameters& parameters,
                               const Eigen::Vector3d& sensor)
{
    check_all(parameters);
    check(sensor.allFinite(), "sensor must be finite");
    const SortedScan scan = sorted_scan(cloud, sensor.head<2>());
    const SegmentSearch search(scan, parameters);
    Segments2d out;
    std::vector<Line2d> lines;
    for (const Piece& piece : search.pieces())
    {
        lines.push_back(search.line_of(piece));
        out.segments.push_back(described(scan, piece, lines.back()));
    }
    for (size_t i = 0; i < lines.size() && lines.size() > 1; i++)
    {
        const size_t next = (i + 1) % lines.size();
        if (next == 0 && lines.size() == 2) break;  // the same two again
        const auto at = crossing(lines[i], lines[next], mrpt::DEG2RAD(parameters.minimum_corner_angle_deg));
        const auto is_near = [&](size_t k) {
            return distance_to_segment(*at, lines[k], *out.segments[k].line.fit) <=
                   parameters.corner_distance;
        };
        if (at && is_near(i) && is_near(next)) out.corners.emplace_back(at->x(), at->y(), scan.height);
    }
    return out;
}

}  // namespace mp2p_icp_filters
