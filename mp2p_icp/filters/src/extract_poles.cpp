#include <mp2p_icp/se3.h>
#include <mp2p_icp_filters/extract_poles.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "line_fit.h"
#include "plane_cells.h"

namespace mp2p_icp_filters
{
using Eigen::Vector3d;
using mp2p_icp::Range;

void PoleParameters::declare_parameters(mp2p_icp::ParameterDeclaration& declare)
{
    declare.number("pole_voxel_size", voxel_size, "m", Range::positive(),
                   "Side of the cells whose points must be spread along a line.");
    declare.number("pole_minimum_linearity", minimum_linearity, "", Range::between(1, 1000),
                   "Least spread of a cell's points along that line, over the widest one across it.");
    declare.number("pole_maximum_radius", maximum_radius, "m", Range::positive(),
                   "Largest distance of its points from the line.");
    declare.number("pole_minimum_length", minimum_length, "m", Range::not_negative(),
                   "Shorter ones are dropped.");
    declare.number("pole_minimum_thickness", minimum_thickness, "m", Range::not_negative(),
                   "Least rms distance of its points from the line, across the view.");
    declare.integer("pole_minimum_inliers", minimum_inliers, Range::between(6, UINT32_MAX),
                    "Poles with fewer points are dropped.");
    declare.number("pole_maximum_angle_to_vertical_deg", maximum_angle_to_vertical_deg, "deg",
                   Range::between(0, 90), "Largest angle of the line from the z axis; 90: any direction.");
    declare.number("pole_maximum_crowd", maximum_crowd, "", Range::not_negative(),
                   "Most points in the shell around a pole, over its inliers.");
}

namespace
{
constexpr int MOST_ROUNDS = 10;                         // of fitting and gathering points
constexpr double SHELL_INNER = 1.5, SHELL_OUTER = 2.5;  // times maximum_radius: what must be nearly empty
constexpr double FEET = 0.1;  // of the length at each end does not count for that: a pole stands on something
constexpr double LEAST_POINTS_IN_CELL = 6;
constexpr double MOST_TURN_DEG = 20;  // between the line of a cell and that of the pole that takes it in

/// A cell whose points are spread along a line.
struct LinearCell
{
    uint32_t cell;
    double linearity;
};

class PoleSearch
{
 public:
    PoleSearch(const mrpt::maps::CPointsMap& cloud, const PoleParameters& parameters, const Vector3d& sensor)
        : parameters_(parameters),
          sensor_(sensor),
          all_(cloud, 4 * parameters.voxel_size),
          level_(all_, every_point(), parameters.voxel_size, {}),
          lines_(level_.cells().size()),
          used_(level_.cells().size(), false),
          taken_(all_.points.size(), false)
    {
    }

    std::vector<ExtractedPole> run()
    {
        std::vector<ExtractedPole> out;
        for (const LinearCell& seed : linear_cells())
        {
            if (used_[seed.cell]) continue;
            if (const auto pole = refined(grown(seed.cell))) out.push_back(*pole);
        }
        return out;
    }

 private:
    std::vector<uint32_t> every_point() const
    {
        std::vector<uint32_t> out(all_.points.size());
        for (uint32_t i = 0; i < out.size(); i++) out[i] = i;
        return out;
    }

    /// The most linear first; measures the lines of all of them, and marks all others as used.
    std::vector<LinearCell> linear_cells()
    {
        std::vector<LinearCell> out;
        for (uint32_t c = 0; c < level_.cells().size(); c++)
        {
            used_[c] = true;
            const PointMoments& moments = level_.cells()[c].moments;
            if (moments.count < LEAST_POINTS_IN_CELL) continue;
            lines_[c] = line_through(moments);
            const double linearity = lines_[c].spread / std::max(lines_[c].widest_across, 1e-9);
            if (lines_[c].widest_across > parameters_.maximum_radius || lines_[c].spread < 1e-6 ||
                linearity < parameters_.minimum_linearity || !may_point_along(lines_[c].direction))
                continue;
            used_[c] = false;
            out.push_back({c, linearity});
        }
        std::stable_sort(out.begin(), out.end(),
                         [](const LinearCell& a, const LinearCell& b) { return a.linearity > b.linearity; });
        return out;
    }

    bool may_point_along(const Vector3d& direction) const
    {
        return std::abs(direction.z()) >= std::cos(mrpt::DEG2RAD(parameters_.maximum_angle_to_vertical_deg));
    }

    /// The line through all cells that continue this one.
    MomentLine grown(uint32_t seed)
    {
        std::vector<uint32_t> cells = {seed}, near;
        PointMoments moments = level_.cells()[seed].moments;
        MomentLine line = lines_[seed];
        used_[seed] = true;
        for (size_t next = 0; next < cells.size(); next++)
        {
            level_.neighbours(cells[next], near);
            for (const uint32_t c : near)
            {
                if (used_[c] || !continues(line, lines_[c])) continue;
                used_[c] = true;
                cells.push_back(c);
                moments.add(level_.cells()[c].moments);
                line = line_through(moments);
            }
        }
        return line;
    }

    bool continues(const MomentLine& line, const MomentLine& cell) const
    {
        return std::abs(line.direction.dot(cell.direction)) >= std::cos(mrpt::DEG2RAD(MOST_TURN_DEG)) &&
               distance_from(line, cell.centre) <= parameters_.maximum_radius;
    }

    std::optional<ExtractedPole> refined(MomentLine line)
    {
        std::vector<uint32_t> points;
        for (int round = 0; round < MOST_ROUNDS; round++)
        {
            std::vector<uint32_t> now = piece_around(line);
            if (now.size() < parameters_.minimum_inliers) return {};
            if (now == points) break;
            points = std::move(now);
            line = line_through(moments_of(all_.points, points.data(), points.data() + points.size()));
        }
        const LineFit found = fit_line(all_.points, points, line, sensor_);
        if (!is_pole(found, points.size())) return {};
        ExtractedPole out{found.line, found.thickness, {}};
        for (const uint32_t i : points)
        {
            taken_[i] = true;
            out.inliers.push_back(all_.ids[i]);
        }
        std::sort(out.inliers.begin(), out.inliers.end());
        return out;
    }

    /// Calls `each(index, place along the line, distance from it)` for the free points within a radius.
    template <class Each>
    void for_points_near(const MomentLine& line, double radius, const Each& each) const
    {
        for (const auto& block : all_.blocks)
        {
            if (distance_from(line, block.centre) > block.half.norm() + radius) continue;
            for (uint32_t i = block.first; i < block.last; i++)
                if (const double d = distance_from(line, all_.points[i]); d <= radius && !taken_[i])
                    each(i, line.direction.dot(all_.points[i] - line.centre), d);
        }
    }

    /// The points near the line that hang together with its middle; increasing.
    std::vector<uint32_t> piece_around(const MomentLine& line) const
    {
        std::vector<std::pair<double, uint32_t>> along;
        for_points_near(line, parameters_.maximum_radius,
                        [&along](uint32_t i, double s, double) { along.emplace_back(s, i); });
        std::sort(along.begin(), along.end());
        if (along.empty()) return {};
        const auto middle =
            std::min(std::lower_bound(along.begin(), along.end(), std::make_pair(0.0, 0u)), along.end() - 1);
        auto first = middle, last = middle;
        while (first != along.begin() && first->first - (first - 1)->first <= parameters_.voxel_size) --first;
        while (last + 1 != along.end() && (last + 1)->first - last->first <= parameters_.voxel_size) ++last;
        std::vector<uint32_t> out;
        for (auto it = first; it <= last; ++it) out.push_back(it->second);
        std::sort(out.begin(), out.end());
        return out;
    }

    bool is_pole(const LineFit& found, size_t inliers) const
    {
        const double most = parameters_.maximum_crowd * static_cast<double>(inliers);
        return found.line.fit->length() >= parameters_.minimum_length &&
               found.thickness >= parameters_.minimum_thickness &&
               may_point_along(mp2p_icp::to_eigen(found.line.director)) &&
               points_around(found.line) <= most && points_before(found.line) <= most;
    }

    /// In the shell around it, but for its feet.
    double points_around(const mp2p_icp::fitted_line_t& found) const
    {
        const MomentLine line{mp2p_icp::to_eigen(found.pBase), mp2p_icp::to_eigen(found.director), 0, 0};
        double count = 0;
        for_points_near(
            line, SHELL_OUTER * parameters_.maximum_radius,
            [&](uint32_t, double s, double distance)
            { count += is_along(*found.fit, s) && distance > SHELL_INNER * parameters_.maximum_radius; });
        return count;
    }

    /// Nearer to the sensor than it, at a bearing within the shell's inner radius.
    double points_before(const mp2p_icp::fitted_line_t& found) const
    {
        const Vector3d to_base = mp2p_icp::to_eigen(found.pBase) - sensor_,
                       d = mp2p_icp::to_eigen(found.director);
        const Vector3d across = found.fit->axis_a, view = across.cross(d);
        const double distance = view.dot(to_base);
        double count = 0;
        for (const Vector3d& p : all_.points)
        {
            const Vector3d ray = p - sensor_;
            const double depth = view.dot(ray);
            if (!(depth > 0 && depth < distance - 2 * parameters_.maximum_radius)) continue;
            const Vector3d beside = ray * (distance / depth) - to_base;  // where the ray passes the pole
            count += is_along(*found.fit, d.dot(beside)) &&
                     std::abs(across.dot(beside)) <= SHELL_INNER * parameters_.maximum_radius;
        }
        return count;
    }

    static bool is_along(const mp2p_icp::line_fit_t& fit, double s)
    {
        return s >= fit.begin + FEET * fit.length() && s <= fit.end - FEET * fit.length();
    }

    const PoleParameters& parameters_;
    Vector3d sensor_;
    BlockedPoints all_;
    CellLevel level_;
    std::vector<MomentLine> lines_;
    std::vector<bool> used_, taken_;
};

void check(bool rule, const char* text)
{
    if (!rule) throw std::invalid_argument(std::string("extract_poles: ") + text);
}
}  // namespace

std::vector<ExtractedPole> extract_poles(const mrpt::maps::CPointsMap& cloud,
                                         const PoleParameters& parameters, const Vector3d& sensor)
{
    check(parameters.voxel_size > 0 && std::isfinite(parameters.voxel_size), "voxel_size must be above zero");
    check(parameters.minimum_linearity >= 1, "minimum_linearity must be at least 1");
    check(parameters.maximum_radius > 0, "maximum_radius must be above zero");
    check(parameters.minimum_length >= 0, "minimum_length must not be negative");
    check(parameters.minimum_thickness >= 0, "minimum_thickness must not be negative");
    check(parameters.minimum_inliers >= 6, "minimum_inliers must be at least 6");
    check(parameters.maximum_angle_to_vertical_deg >= 0 && parameters.maximum_angle_to_vertical_deg <= 90,
          "maximum_angle_to_vertical_deg must be in [0, 90]");
    check(parameters.maximum_crowd >= 0, "maximum_crowd must not be negative");
    check(sensor.allFinite(), "sensor must be finite");
    auto poles = PoleSearch(cloud, parameters, sensor).run();
    std::vector<size_t> order(poles.size());
    for (size_t i = 0; i < order.size(); i++) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&poles](size_t a, size_t b)
                     { return poles[a].inliers.size() > poles[b].inliers.size(); });
    std::vector<ExtractedPole> out;
    for (const size_t i : order) out.push_back(poles[i]);
    return out;
}

}  // namespace mp2p_icp_filters
