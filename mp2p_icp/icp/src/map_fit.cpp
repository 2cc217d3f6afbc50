#include "map_fit.h"

#include <mp2p_icp/ICP.h>
#include <mp2p_icp/Matcher_Point2Plane.h>
#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/observability.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/pose_step.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "pairings_on_surfaces.h"

namespace mp2p_icp
{
using mrpt::math::TPoint3D;
using mrpt::math::TPoint3Df;
using mrpt::poses::CPose3D;

namespace
{
constexpr size_t SUBSET = 400;
constexpr double NEIGHBORHOOD = 5;  ///< spacings: of a surface, a good dozen points and more
constexpr const char* LAYER = "points";

std::vector<TPoint3Df> finite_points(const mrpt::maps::CPointsMap& cloud)
{
    const auto &x = cloud.getPointsBufferRef_x(), &y = cloud.getPointsBufferRef_y(),
               &z = cloud.getPointsBufferRef_z();
    std::vector<TPoint3Df> out;
    for (size_t i = 0; i < x.size(); i++)
        if (std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]))
            out.emplace_back(x[i], y[i], z[i]);
    return out;
}

mrpt::maps::CSimplePointsMap::Ptr as_cloud(const std::vector<TPoint3Df>& points, float scale = 1)
{
    auto cloud = mrpt::maps::CSimplePointsMap::Create();
    cloud->reserve(points.size());
    for (const auto& p : points) cloud->insertPointFast(p.x * scale, p.y * scale, p.z * scale);
    cloud->mark_as_modified();
    return cloud;
}

metric_map_t as_map(const mrpt::maps::CSimplePointsMap::Ptr& cloud)
{
    metric_map_t map;
    map.layers[LAYER] = cloud;
    return map;
}

TPoint3D mean_of(const std::vector<TPoint3Df>& points)
{
    TPoint3D sum(0, 0, 0);
    for (const auto& p : points) sum += TPoint3D(p);
    return sum * (1.0 / static_cast<double>(points.size()));
}

double rms_distance(const std::vector<TPoint3Df>& points, const TPoint3D& from)
{
    double sum = 0;
    for (const auto& p : points) sum += (TPoint3D(p) - from).sqrNorm();
    return std::sqrt(sum / static_cast<double>(points.size()));
}

template <class T>
std::vector<T> subset_of(const std::vector<T>& all)
{
    std::vector<T> out;
    for (const size_t i : random_subset(all.size(), SUBSET, 1)) out.push_back(all[i]);
    return out;
}

PointArrays to_arrays(const std::vector<TPoint3Df>& points)
{
    PointArrays out;
    for (const auto& p : points) out.x.push_back(p.x), out.y.push_back(p.y), out.z.push_back(p.z);
    return out;
}

/// The median distance of points of a cloud to their nearest other one that stands elsewhere.
double median_spacing(const std::vector<TPoint3Df>& points, const NearestNeighborIndex& index)
{
    constexpr uint32_t neighbors = 4;  // itself, and some that may stand at the same place
    const auto queries = to_arrays(subset_of(points));
    const std::vector<float> no_limit(queries.size(), std::numeric_limits<float>::infinity());
    std::vector<uint32_t> ids(neighbors * queries.size());
    std::vector<float> squares(ids.size());
    index.nearest(queries, 0, queries.size(), neighbors, no_limit.data(), ids.data(), squares.data());
    std::vector<double> distances;
    for (size_t i = 0; i < queries.size(); i++)
        for (size_t k = i * neighbors; k < (i + 1) * neighbors; k++)
            if (ids[k] != NO_NEIGHBOR && squares[k] > 0)
            {
                distances.push_back(std::sqrt(static_cast<double>(squares[k])));
                break;
            }
    if (distances.empty()) return 0;
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
}

/// Which of 13 directions (axes, diagonals of faces and of the cube) a vector is nearest to, signs apart.
int direction_bin(const Eigen::Vector3f& v)
{
    const float largest = v.cwiseAbs().maxCoeff();
    int code = 0;
    for (int i = 0; i < 3; i++) code = 3 * code + (v(i) > 0.5f * largest) - (v(i) < -0.5f * largest);
    return std::abs(code);
}

/// A surface with a spread across of a fifth of that along it is one still.
const ShapeLimits SHAPES = {0.05, 0.1, 0.05, 4, 4};

LocalSurfaces::ConstPtr surfaces_of(const metric_map_t& cloud, double spacing)
{
    LocalSurfaceOptions options;
    options.radius = std::max(1e-6, NEIGHBORHOOD * spacing);
    return cloud.local_surfaces(LAYER, options);
}

/// Of each point, the kind and direction of the surface around it.
std::vector<int> surface_bins(const metric_map_t& cloud, double spacing)
{
    const auto surfaces = surfaces_of(cloud, spacing);
    std::vector<int> bins;
    for (const auto& s : surfaces->of_point)
    {
        const auto shape = s.shape(SHAPES);
        bins.push_back(shape == SurfaceShape::Planar   ? 100 + direction_bin(s.normal)
                       : shape == SurfaceShape::Linear ? 200 + direction_bin(s.direction)
                                                       : 0);
    }
    return bins;
}

std::vector<double> weights_of(const std::vector<int>& bins)
{
    std::map<int, double> counts;
    for (const int bin : bins) counts[bin]++;
    double total = 0;
    for (const auto& [bin, count] : counts) total += std::sqrt(count);
    std::vector<double> weights;
    for (const int bin : bins) weights.push_back(1 / (std::sqrt(counts[bin]) * total));
    return weights;
}
}  // namespace

MatchedLayers matched_layers(const LogRecord& log)
{
    const auto icp = log.pipeline.make();
    const auto cloud = [](const metric_map_t& map, const layer_name_t& name)
    {
        const auto it = map.layers.find(name);
        return it == map.layers.end() ? nullptr
                                      : std::dynamic_pointer_cast<mrpt::maps::CPointsMap>(it->second);
    };
    for (const auto& matcher : icp->matchers())
    {
        const auto* of_points = dynamic_cast<const Matcher_Points_Base*>(matcher.get());
        if (!of_points || !matcher->enabled) continue;
        for (const auto& pair : of_points->layer_pairs(*log.pcGlobal, *log.pcLocal))
            return {cloud(*log.pcGlobal, pair.global), cloud(*log.pcLocal, pair.local), pair.global,
                    pair.local};
    }
    const auto first = [](const metric_map_t& map) -> std::pair<mrpt::maps::CPointsMap::Ptr, layer_name_t>
    {
        for (const auto& [name, layer] : map.layers)
            if (auto points = std::dynamic_pointer_cast<mrpt::maps::CPointsMap>(layer)) return {points, name};
        return {nullptr, "(none)"};
    };
    const auto global = first(*log.pcGlobal), local = first(*log.pcLocal);
    return {global.first, local.first, global.second, local.second};
}

MapFit::MapFit(const mrpt::maps::CPointsMap& global, const mrpt::maps::CPointsMap& local)
{
    const auto global_points = finite_points(global), local_points = finite_points(local);
    const auto global_cloud = as_cloud(global_points);
    global_ = as_map(global_cloud), global_points_ = global_cloud;
    index_ = global_.nn_index(LAYER);
    const auto whole_local = as_map(as_cloud(local_points));
    local_spacing_ = std::max(median_spacing(local_points, *whole_local.nn_index(LAYER)), 1e-9);
    spacing_ = std::max(median_spacing(global_points, *index_), 1e-9);
    surfaces_ = surfaces_of(global_, spacing_);
    const auto bins = surface_bins(whole_local, local_spacing_);
    std::vector<int> subset_bins;
    for (const size_t i : random_subset(local_points.size(), SUBSET, 1))
        local_.push_back(local_points[i]), subset_bins.push_back(bins[i]);
    weights_ = weights_of(subset_bins);
    local_mean_ = mean_of(local_), global_mean_ = mean_of(global_points);
    radius_ = std::max(rms_distance(local_, local_mean_), 1e-9);
    global_radius_ = rms_distance(global_points, global_mean_);
}

CPose3D MapFit::means_together(const CPose3D& turned_as) const
{
    const Eigen::Matrix3d R = rotation_of(turned_as);
    return make_pose(R, to_eigen(global_mean_) - R * to_eigen(local_mean_));
}

/// Of each local point, where it falls and its global point nearby.
struct MapFit::Nearest
{
    PointArrays moved;
    std::vector<uint32_t> ids;
};

MapFit::Nearest MapFit::nearest_of(const CPose3D& pose, double scale, double within) const
{
    std::vector<TPoint3Df> moved;
    for (const auto& p : local_) moved.push_back(TPoint3Df(pose.composePoint(TPoint3D(p) * scale)));
    Nearest out = {to_arrays(moved), std::vector<uint32_t>(moved.size())};
    const std::vector<float> limits(moved.size(), static_cast<float>(within * within));
    std::vector<float> squares(moved.size());
    index_->nearest(out.moved, 0, moved.size(), 1, limits.data(), out.ids.data(), squares.data());
    return out;
}

bool MapFit::fits(const Nearest& nearest, size_t i) const
{
    const uint32_t global_id = nearest.ids[i];
    if (global_id == NO_NEIGHBOR) return false;
    const TPoint3Df p(nearest.moved.x[i], nearest.moved.y[i], nearest.moved.z[i]);
    constexpr double open_spacings = 0.25, spacings_without_surface = 2;
    const LocalSurface& s = surfaces_->of_point[global_id];
    TPoint3Df q;
    global_points_->getPoint(global_id, q.x, q.y, q.z);
    const Eigen::Vector3f to_point(p.x - q.x, p.y - q.y, p.z - q.z), from_mean = to_point - s.to_mean;
    const auto within = [&](float distance, float variance)
    {
        return static_cast<double>(distance) <=
               3 * std::sqrt(static_cast<double>(variance)) + open_spacings * spacing_;
    };
    switch (s.shape(SHAPES))
    {
        case SurfaceShape::Planar:
            return within(std::abs(s.normal.dot(from_mean)), s.eigenvalues(0));
        case SurfaceShape::Linear:
            return within(from_mean.cross(s.direction).norm(), s.eigenvalues(1));
        default:
            return static_cast<double>(to_point.norm()) <= spacings_without_surface * spacing_;
    }
}

double MapFit::share(const CPose3D& pose, double scale) const
{
    const auto nearest = nearest_of(pose, scale, nearby());
    double sum = 0;
    for (size_t i = 0; i < nearest.ids.size(); i++)
        if (fits(nearest, i)) sum += weights_[i];
    return sum;
}

bool MapFit::fits_where_maps_overlap(const CPose3D& pose) const
{
    // Farther than this from a wall, another one is not that wall in the wrong place.
    constexpr double near_spacings = 10, least_overlap = 0.35, least_share = 0.75;
    const auto nearest = nearest_of(pose, 1, nearby()),
               around = nearest_of(pose, 1, near_spacings * spacing_);
    double overlap = 0, fitting = 0;
    for (size_t i = 0; i < local_.size(); i++)
    {
        if (around.ids[i] != NO_NEIGHBOR) overlap += weights_[i];
        if (fits(nearest, i)) fitting += weights_[i];
    }
    return overlap >= least_overlap && fitting >= least_share * overlap &&
           left_free(pairs_of(nearest), pose).empty();
}

Pairings MapFit::pairs_of(const Nearest& nearest) const
{
    Pairings pairings;
    for (size_t i = 0; i < nearest.ids.size(); i++)
    {
        const uint32_t id = nearest.ids[i];
        if (id == NO_NEIGHBOR) continue;
        TPoint3D q;
        global_points_->getPoint(id, q.x, q.y, q.z);
        pairings.paired_pt2pt.push_back(
            mrpt::tfest::TMatchingPair_d(id, static_cast<uint32_t>(i), q, TPoint3D(local_[i])));
    }
    return pairings;
}

std::vector<FreeTwist> MapFit::left_free(const Pairings& pairings, const CPose3D& pose) const
{
    const auto on = pairings_on_surfaces(pairings, global_, {{LAYER, 0}}, pose);
    ObservabilityParameters parameters;
    parameters.feigned = &on.feigned;
    return observability(on.pairings, pose, parameters).free;
}

std::vector<FreeTwist> MapFit::free_motions(const CPose3D& pose) const
{
    const auto pairings = pairs_of(nearest_of(pose, 1, nearby()));
    return 2 * pairings.size() < local_.size() ? std::vector<FreeTwist>() : left_free(pairings, pose);
}

double MapFit::better_scale(const Fit& fit) const
{
    const auto nearest = nearest_of(fit.pose, fit.scale, nearby());
    std::vector<TPoint3Df> from, to;
    for (size_t i = 0; i < nearest.ids.size(); i++)
        if (const uint32_t id = nearest.ids[i]; id != NO_NEIGHBOR)
        {
            from.emplace_back(nearest.moved.x[i], nearest.moved.y[i], nearest.moved.z[i]);
            to.emplace_back(0, 0, 0);
            global_points_->getPoint(id, to.back().x, to.back().y, to.back().z);
        }
    if (from.size() < 3) return fit.scale;
    const TPoint3D from_mean = mean_of(from), to_mean = mean_of(to);
    double products = 0, squares = 0;
    for (size_t i = 0; i < from.size(); i++)
    {
        const TPoint3D a = TPoint3D(from[i]) - from_mean, b = TPoint3D(to[i]) - to_mean;
        products += a.x * b.x + a.y * b.y + a.z * b.z, squares += a.sqrNorm();
    }
    return squares > 0 && products > 0 ? fit.scale * products / squares : fit.scale;
}

namespace
{
/// One step of ICP. \return how far the points move at most, about, m; empty: there are too few pairs.
std::optional<double> step(const Matcher::Ptr& matcher, const metric_map_t& global, const metric_map_t& local,
                           double radius, uint32_t iteration, MatchState& state, CPose3D& pose)
{
    const auto pairings = run_matchers({matcher}, global, local, pose, {iteration, {}}, state);
    OptimalTF_GN_Parameters start;
    start.linearizationPoint = pose;
    OptimalTF_Result found;
    found.optimalPose = pose;
    if (pairings.size() < 6 || !optimal_tf_gauss_newton(pairings, found, start)) return {};
    const auto [metres, radians] = step_between(pose, found.optimalPose);
    pose = found.optimalPose;
    return metres + radius * radians;
}
}  // namespace

Fit MapFit::fit_from(const CPose3D& start, double gate, double scale) const
{
    constexpr uint32_t most_iterations = 40, plane_iterations = 10;
    constexpr double shrinks_by = 0.8;
    const metric_map_t local = as_map(as_cloud(local_, static_cast<float>(scale)));
    MatchState state(global_, local);
    Fit fit = {start, scale, 0};
    const auto points = std::make_shared<Matcher_Points_DistanceThreshold>();
    points->allowMatchAlreadyMatchedGlobalPoints_ = true;
    for (uint32_t i = 0; i < most_iterations; i++)
    {
        const double distance = std::max(nearby(), gate * std::pow(shrinks_by, i));
        points->threshold = distance;
        const auto moved = step(points, global_, local, radius_, i, state, fit.pose);
        if (!moved || (distance == nearby() && *moved < 0.05 * spacing_)) break;
    }
    // Points alone creep along surfaces.
    const auto planes = std::make_shared<Matcher_Point2Plane>(nearby());
    planes->searchRadius = NEIGHBORHOOD * spacing_;
    Fit on_planes = fit;
    for (uint32_t i = 0; i < plane_iterations; i++)
        if (!step(planes, global_, local, radius_, i, state, on_planes.pose)) break;
    fit.share = share(fit.pose, scale), on_planes.share = share(on_planes.pose, scale);
    return on_planes.share > fit.share ? on_planes : fit;
}

double MapFit::displacement(const CPose3D& a, const CPose3D& b) const
{
    double sum = 0;
    for (const auto& p : local_) sum += (a.composePoint(TPoint3D(p)) - b.composePoint(TPoint3D(p))).sqrNorm();
    return std::sqrt(sum / static_cast<double>(local_.size()));
}

}  // namespace mp2p_icp
