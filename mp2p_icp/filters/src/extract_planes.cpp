#include <mp2p_icp/se3.h>
#include <mp2p_icp_filters/extract_planes.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "plane_fit.h"
#include "plane_footprint.h"
#include "plane_regions.h"

namespace mp2p_icp_filters
{
using Eigen::Vector3d;
using mp2p_icp::Range;

void PlaneParameters::declare_parameters(mp2p_icp::ParameterDeclaration& declare)
{
    declare.number("voxel_size", voxel_size, "m", Range::positive(),
                   "Side of the smallest cells that are tested for flatness.");
    declare.integer("voxel_levels", voxel_levels, Range::between(1, 8),
                    "Cells of 1, 2, 4... times that side are tried, so many sizes.");
    declare.integer("minimum_inliers", minimum_inliers, Range::between(10, UINT32_MAX),
                    "Planes with fewer points are dropped.");
    declare.number("minimum_area", minimum_area, "m^2", Range::not_negative(),
                   "Smaller planes are dropped (area of a rectangle with the same spreads).");
    declare.number("maximum_noise", maximum_noise, "m", Range::positive(),
                   "Largest standard deviation of the distances to the plane.");
    declare.number("roughness", roughness, "m", Range::not_negative(),
                   "Surfaces and their noise are taken to be no smoother than this (standard deviation).");
    declare.number("maximum_angle_deg", maximum_angle_deg, "deg", {0, 45, true, false},
                   "Largest angle between the normals of a cell and of the plane that takes it in.");
    declare.number("maximum_angle_deviation_deg", maximum_angle_deviation_deg, "deg", Range::positive(),
                   "Planes whose normal is not known better than this (standard deviation) are dropped.");
    declare.number(
        "maximum_unevenness", maximum_unevenness, "", Range::positive(),
        "Largest rms height of bends, waves and steps of the surface, over its noise or roughness.");
}

namespace
{
constexpr int MOST_ROUNDS = 8;  // of fitting and gathering points
constexpr double POINTS_PER_SQUARE = 6;
constexpr double LEAST_CLEAR_SHARE = 0.3;   // of the inliers must be free of what stands beside the plane
constexpr double MOST_UNEVEN_SHARE = 0.25;  // of the inliers; more of them on a bent surface
constexpr double BENDING_SHARE =
    0.5;  // of maximum_unevenness; a bent surface is cut where it leaves the plane
constexpr double LEAST_INCIDENCE = 0.035;     // sine of 2 degrees
constexpr double LEAST_WIDTH_OVER_NOISE = 5;  // spread in the plane over that across it

/// Of a rectangle with these spreads: that of a side is its length / sqrt(12).
double area_of(const MomentPlane& plane)
{
    return 12 * plane.spread_1 * plane.spread_2;
}

/// A plane with the points that it was fitted to.
struct FittedPoints
{
    PlaneFit fit;
    std::vector<uint32_t> points, squares;
    double u_min = 0, u_max = 0, v_min = 0, v_max = 0;

    void measure_box(const std::vector<Vector3d>& all)
    {
        u_min = u_max = v_min = v_max = 0;
        for (const uint32_t i : points)
        {
            const Vector3d d = all[i] - fit.plane.centre;
            u_min = std::min(u_min, fit.u.dot(d)), u_max = std::max(u_max, fit.u.dot(d));
            v_min = std::min(v_min, fit.v.dot(d)), v_max = std::max(v_max, fit.v.dot(d));
        }
    }
    /// Could the point be one of this plane, within the box and a margin around it?
    bool may_own(const Vector3d& point, double margin) const
    {
        const Vector3d d = point - fit.plane.centre;
        const double u = fit.u.dot(d), v = fit.v.dot(d);
        return std::abs(fit.plane.normal.dot(d)) <= NEAR_SIGMAS * fit.noise && u >= u_min - margin &&
               u <= u_max + margin && v >= v_min - margin && v <= v_max + margin;
    }
};

class Extraction
{
 public:
    Extraction(const mrpt::maps::CPointsMap& cloud, const PlaneParameters& parameters, const Vector3d& sensor)
        : parameters_(parameters),
          sensor_(sensor),
          all_(cloud, 8 * parameters.voxel_size),
          taken_(all_.points.size(), false)
    {
    }

    std::vector<ExtractedPlane> run()
    {
        double side = parameters_.voxel_size;
        for (uint32_t level = 0; level < parameters_.voxel_levels; level++, side *= 2) one_level(side);
        std::vector<FittedPoints> kept;
        for (size_t i = 0; i < found_.size(); i++)
            if (auto plane = without_points_of_others(i); is_plane(plane)) kept.push_back(std::move(plane));
        std::stable_sort(kept.begin(), kept.end(),
                         [](const FittedPoints& a, const FittedPoints& b)
                         { return a.points.size() > b.points.size(); });
        std::vector<ExtractedPlane> out;
        for (const FittedPoints& plane : kept) out.push_back(described(plane));
        return out;
    }

 private:
    void one_level(double side)
    {
        std::vector<uint32_t> left;
        for (uint32_t i = 0; i < taken_.size(); i++)
            if (!taken_[i]) left.push_back(i);
        const CellLevel level(all_, left, side, parameters_);
        std::vector<bool> used(level.cells().size(), false);
        for (bool any = true; any;)  // every round uses at least the cells of the largest region
        {
            any = false;
            for (const PlaneRegion& region : grow_regions(level, used, parameters_))
                any = consider(level, region, used) || any;
        }
    }

    /// Makes a plane of the region, or not. \return was it made, with cells left over?
    bool consider(const CellLevel& level, const PlaneRegion& region, std::vector<bool>& used)
    {
        const auto plane = region.moments.count * 4 >= parameters_.minimum_inliers
                               ? refined(level, region)
                               : std::optional<FittedPoints>();
        if (!plane)
        {
            for (const uint32_t c : region.cells) used[c] = true;
            return false;
        }
        bool left_over = false;
        for (const uint32_t c : region.cells)
        {
            size_t taken = 0;
            for (auto i = level.first_point(c); i != level.last_point(c); ++i) taken += taken_[*i];
            used[c] = 2 * static_cast<double>(taken) >= level.cells()[c].moments.count;
            left_over = left_over || !used[c];
        }
        used[region.cells.front()] = true;
        found_.push_back(*plane);
        return left_over;
    }

    std::optional<FittedPoints> refined(const CellLevel& level, const PlaneRegion& region)
    {
        std::vector<uint32_t> starts;
        for (const uint32_t c : region.cells)
            for (auto i = level.first_point(c); i != level.last_point(c); ++i)
                if (!taken_[*i]) starts.push_back(*i);
        // Squares small enough to see edges, and large enough to hold a few points.
        const double density = region.moments.count / (12 * region.plane.spread_1 * region.plane.spread_2);
        const double clear_pitch =
            std::clamp(std::sqrt(POINTS_PER_SQUARE / density), parameters_.voxel_size / 2, level.side() / 2);
        FittedPoints out;
        out.fit.plane = region.plane, out.fit.noise = std::max(region.plane.sigma, parameters_.roughness);
        std::vector<uint32_t> claimed;
        for (int round = 0; round < MOST_ROUNDS; round++)
        {
            Footprint f = footprint(all_, query_about(out.fit, level.side(), clear_pitch), starts);
            if (!is_enough(f)) return {};
            if (f.clear == out.points) break;
            out.points = std::move(f.clear), out.squares = std::move(f.clear_square);
            claimed = std::move(f.claimed);
            out.fit = fitted(out, f.surface);
        }
        if (!is_plane(out)) return {};
        for (const uint32_t i : claimed) taken_[i] = true;
        out.measure_box(all_.points);
        return out;
    }

    /// Points that lie in another plane, too, are dropped: where planes cross or meet, they bend the fit.
    FittedPoints without_points_of_others(size_t self) const
    {
        const double margin = 2 * parameters_.voxel_size;
        FittedPoints out;
        for (size_t k = 0; k < found_[self].points.size(); k++)
        {
            const uint32_t i = found_[self].points[k];
            bool shared = false;
            for (size_t other = 0; other < found_.size() && !shared; other++)
                shared = other != self && found_[other].may_own(all_.points[i], margin);
            if (shared) continue;
            out.points.push_back(i), out.squares.push_back(found_[self].squares[k]);
        }
        if (out.points.size() < parameters_.minimum_inliers) return {};
        out.fit = fitted(out, out.points);
        out.measure_box(all_.points);
        return out;
    }

    PlaneFit fitted(const FittedPoints& to, const std::vector<uint32_t>& surface) const
    {
        PlaneFit fit = fit_plane(all_.points, to.points, to.squares, surface, sensor_);
        fit.noise = std::max(fit.noise, parameters_.roughness);
        return fit;
    }

    FootprintQuery query_about(const PlaneFit& fit, double side, double clear_pitch) const
    {
        const MomentPlane& plane = fit.plane;
        // Float coordinates: a plane is never thinner than their rounding.
        const double rounding = 1e-7 * (plane.centre.cwiseAbs().maxCoeff() + 10 * side);
        const double sigma = std::min(std::max(fit.noise, rounding), parameters_.maximum_noise);
        FootprintQuery query;
        query.centre = plane.centre, query.normal = plane.normal;
        query.sigma = sigma, query.clearance = std::max(parameters_.voxel_size, 4 * sigma);
        query.pitch = side / 2, query.clear_pitch = clear_pitch;
        query.taken = &taken_;
        return query;
    }

    bool is_enough(const Footprint& f) const
    {
        return f.clear.size() >= parameters_.minimum_inliers &&
               static_cast<double>(f.uneven) <= MOST_UNEVEN_SHARE * static_cast<double>(f.inside) &&
               static_cast<double>(f.clear.size()) >= LEAST_CLEAR_SHARE * static_cast<double>(f.inside);
    }

    bool is_plane(const FittedPoints& found) const
    {
        if (found.points.size() < parameters_.minimum_inliers) return false;
        const PlaneFit& fit = found.fit;
        const MomentPlane& p = fit.plane;
        const double allowed = std::max(parameters_.maximum_unevenness * fit.noise,
                                        1e-7 * p.centre.cwiseAbs().maxCoeff());  // float coordinates
        const bool is_uneven = (fit.unevenness > allowed && !fit.is_uneven_by_chance) ||
                               (fit.bending > BENDING_SHARE * allowed && !fit.is_bent_by_chance);
        return p.sigma <= parameters_.maximum_noise && !is_uneven &&
               p.spread_1 >= LEAST_WIDTH_OVER_NOISE * p.sigma && area_of(p) >= parameters_.minimum_area &&
               fit.mean_incidence >= LEAST_INCIDENCE &&
               described(found).plane.fit->angle_deviation() <=
                   mrpt::DEG2RAD(parameters_.maximum_angle_deviation_deg);
    }

    ExtractedPlane described(const FittedPoints& found) const
    {
        const MomentPlane& p = found.fit.plane;
        ExtractedPlane out;
        for (int i = 0; i < 3; i++) out.plane.plane.coefs[i] = p.normal(i);
        out.plane.plane.coefs[3] = -p.normal.dot(p.centre);
        out.plane.centroid = mp2p_icp::to_mrpt(p.centre);
        mp2p_icp::plane_fit_t& fit = out.plane.fit.emplace();
        fit.axis_u = found.fit.u;
        fit.u_min = found.u_min, fit.u_max = found.u_max, fit.v_min = found.v_min, fit.v_max = found.v_max;
        fit.inliers = found.points.size(), fit.sigma = p.sigma;
        fit.covariance = fit_covariance(all_.points, found.points, found.fit);
        out.area = area_of(p);
        for (const uint32_t i : found.points) out.inliers.push_back(all_.ids[i]);
        std::sort(out.inliers.begin(), out.inliers.end());
        return out;
    }

    const PlaneParameters& parameters_;
    Vector3d sensor_;
    BlockedPoints all_;
    std::vector<bool> taken_;
    std::vector<FittedPoints> found_;
};

void check(bool rule, const char* text)
{
    if (!rule) throw std::invalid_argument(std::string("extract_planes: ") + text);
}
}  // namespace

std::vector<ExtractedPlane> extract_planes(const mrpt::maps::CPointsMap& cloud,
                                           const PlaneParameters& parameters, const Vector3d& sensor)
{
    check(parameters.voxel_size > 0 && std::isfinite(parameters.voxel_size), "voxel_size must be above zero");
    check(parameters.voxel_levels >= 1 && parameters.voxel_levels <= 8, "voxel_levels must be 1 to 8");
    check(parameters.minimum_inliers >= 10, "minimum_inliers must be at least 10");
    check(parameters.minimum_area >= 0, "minimum_area must not be negative");
    check(parameters.maximum_noise > 0, "maximum_noise must be above zero");
    check(parameters.roughness >= 0 && std::isfinite(parameters.roughness), "roughness must not be negative");
    check(parameters.maximum_angle_deg > 0 && parameters.maximum_angle_deg <= 45,
          "maximum_angle_deg must be in (0, 45]");
    check(parameters.maximum_angle_deviation_deg > 0, "maximum_angle_deviation_deg must be above zero");
    check(parameters.maximum_unevenness > 0, "maximum_unevenness must be above zero");
    check(sensor.allFinite(), "sensor must be finite");
    return Extraction(cloud, parameters, sensor).run();
}

}  // namespace mp2p_icp_filters
