#include "pairs_with_local_surfaces.h"

#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace mp2p_icp
{
namespace
{
/// The normal (of unit length to the rounding of float), towards the sensor where that is known.
Eigen::Vector3d oriented_normal(const LocalSurface& surface, const Eigen::Vector3d& mean,
                                const std::optional<Eigen::Vector3d>& sensor)
{
    const Eigen::Vector3d n = surface.normal.cast<double>();
    return sensor && n.dot(*sensor - mean) < 0 ? Eigen::Vector3d(-n) : n;
}

double distance_sq(const LocalSurface& surface, SurfaceShape shape, const Eigen::Vector3d& from_mean)
{
    if (shape == SurfaceShape::Planar) return std::pow(surface.normal.cast<double>().dot(from_mean), 2);
    return surface.direction.cast<double>().cross(from_mean).squaredNorm();
}

/// Decides which surfaces fit a local point.
class SurfaceTest
{
 public:
    SurfaceTest(const mrpt::maps::CPointsMap& global, const mrpt::maps::CPointsMap& local,
                const SurfaceChoice& choice, const SurfaceScratch& s)
        : global_(global), local_(local), choice_(choice), s_(s)
    {
    }

    /// What is there for the local point k (of LocalPoints) around a global point; Other if it does not fit,
    /// Unknown if there is no such surface.
    SurfaceShape fitting(size_t k, uint32_t global_id) const
    {
        const SurfaceShape shape = s_.global_shapes[global_id];
        if (!is_wanted(shape)) return SurfaceShape::Unknown;
        const bool planar = shape == SurfaceShape::Planar, must_agree = planar && choice_.agreement;
        const LocalSurface& surface = s_.global->of_point[global_id];
        const Eigen::Vector3d mean = point_of(global_, global_id) + surface.to_mean.cast<double>();
        const Eigen::Vector3d d = point_of(s_.nearest.local.in_global, k) - mean;
        const double reach = planar ? choice_.max_plane_distance : choice_.max_line_distance;
        if (!(distance_sq(surface, shape, d) < reach * reach)) return SurfaceShape::Other;
        return !must_agree || normals_agree(k, surface, mean) ? shape : SurfaceShape::Other;
    }

 private:
    bool is_wanted(SurfaceShape shape) const
    {
        return (shape == SurfaceShape::Planar && choice_.max_plane_distance > 0) ||
               (shape == SurfaceShape::Linear && choice_.max_line_distance > 0);
    }

    const LocalSurface& own_surface(size_t k) const { return s_.local->of_point[s_.nearest.local.ids[k]]; }

    bool normals_agree(size_t k, const LocalSurface& surface, const Eigen::Vector3d& mean) const
    {
        const NormalAgreement& a = *choice_.agreement;
        const LocalSurface& own = own_surface(k);
        const Eigen::Vector3d own_mean =
            point_of(local_, s_.nearest.local.ids[k]) + own.to_mean.cast<double>();
        const double cosine = oriented_normal(surface, mean, a.global_sensor)
                                  .dot(a.rotation * oriented_normal(own, own_mean, a.local_sensor));
        return (a.global_sensor && a.local_sensor ? cosine : std::abs(cosine)) >= a.min_cosine;
    }

    PointView global_, local_;
    const SurfaceChoice& choice_;
    const SurfaceScratch& s_;
};

/// How many chosen surfaces of this shape come before each block of local points, beginning with `total`;
/// `total` becomes their number after all of them.
void count_by_blocks(const std::vector<ChosenSurface>& chosen, SurfaceShape shape, size_t& total,
                     std::vector<size_t>& before)
{
    before.clear();
    for (size_t k = 0; k < chosen.size(); k++)
    {
        if (k % BLOCK_SIZE == 0) before.push_back(total);
        total += chosen[k].shape == shape;
    }
}

void add_weight(WeightRuns& runs, size_t count, double weight)
{
    if (count > 0) runs.emplace_back(count, weight);
}
}  // namespace

LocalSurfaceOptions neighbourhoods(double voxel, uint32_t knn, double radius)
{
    return voxel > 0 ? LocalSurfaceOptions::of_voxels(voxel) : LocalSurfaceOptions{knn, radius, 0};
}

SurfaceScratch& surface_scratch(const Matcher_Points_Base& matcher, const layer_name_t& globalLayer,
                                const layer_name_t& localLayer, const LocalSurfaceOptions& options,
                                MatchState& state, bool local_too)
{
    auto& s = state.scratch<SurfaceScratch>(&matcher, globalLayer, localLayer);
    if (s.global) return s;
    const uint32_t leaf = matcher.kdtree_leaf_max_points_;
    if (options.voxel > 0) state.searched_global_layers[globalLayer] = options.voxel;
    if (options.voxel > 0 && local_too) state.searched_local_layers[localLayer] = options.voxel;
    run_all({[&]()
             {
                 prepare(s.nearest, matcher, globalLayer, localLayer, state);
                 s.global = state.pcGlobal.local_surfaces(globalLayer, options, leaf);
             },
             [&]()
             {
                 if (local_too) s.local = state.pcLocal.local_surfaces(localLayer, options, leaf);
             }});
    return s;
}

void find_nearest(uint32_t k, double max_distance, SurfaceScratch& s)
{
    NearestScratch& n = s.nearest;
    n.max_dist_sq.assign(n.local.ids.size(), static_cast<float>(max_distance * max_distance));
    find_neighbors(k, n);
}

std::vector<uint32_t> planar_points(const LocalSurfaces& surfaces, const ShapeLimits& limits)
{
    std::vector<uint32_t> planar;
    for (uint32_t i = 0; i < surfaces.of_point.size(); i++)
        if (surfaces.of_point[i].shape(limits) == SurfaceShape::Planar) planar.push_back(i);
    return planar;
}

void choose_surfaces(const mrpt::maps::CPointsMap& global, const mrpt::maps::CPointsMap& local, uint32_t k,
                     const SurfaceChoice& choice, SurfaceScratch& s)
{
    if (s.global_shapes.empty())  // they are the same throughout a run
        for (const LocalSurface& surface : s.global->of_point)
            s.global_shapes.push_back(surface.shape(choice.limits));

    const SurfaceTest test(global, local, choice, s);
    const auto choose = [&](size_t i)
    {
        ChosenSurface chosen;
        bool all_unknown = true;
        for (size_t j = i * k; j < (i + 1) * k && s.nearest.ids[j] != NO_NEIGHBOR; j++)
        {
            chosen = {s.nearest.ids[j], test.fitting(i, s.nearest.ids[j])};
            if (chosen.found()) return chosen;
            all_unknown = all_unknown && chosen.shape == SurfaceShape::Unknown;
        }
        if (!all_unknown) chosen.shape = SurfaceShape::Other;
        return chosen;
    };
    s.chosen.resize(s.nearest.local.ids.size());
    parallel_for_blocks(s.chosen.size(),
                        [&](size_t first, size_t last)
                        {
                            for (size_t i = first; i < last; i++) s.chosen[i] = choose(i);
                        });
}

size_t potential_pairings(const SurfaceScratch& s)
{
    return static_cast<size_t>(std::count_if(s.chosen.begin(), s.chosen.end(),
                                             [](const ChosenSurface& c)
                                             { return c.shape != SurfaceShape::Unknown; }));
}

void append_surface_pairings(const layer_name_t& globalLayer, const layer_name_t& localLayer, double weight,
                             const std::optional<Eigen::Vector3d>& sensor, SurfaceScratch& s,
                             MatchState& state, Pairings& out)
{
    const size_t planes_before = out.paired_pt2pl.size(), lines_before = out.paired_pt2ln.size();
    size_t planes = planes_before, lines = lines_before;
    count_by_blocks(s.chosen, SurfaceShape::Planar, planes, s.first_plane);
    count_by_blocks(s.chosen, SurfaceShape::Linear, lines, s.first_line);
    out.paired_pt2pl.resize(planes), out.paired_pt2ln.resize(lines);
    add_weight(out.pt2pl_weights, planes - planes_before, weight);
    add_weight(out.pt2ln_weights, lines - lines_before, weight);

    const auto global_layer = state.pcGlobal.point_layer(globalLayer),
               local_layer = state.pcLocal.point_layer(localLayer);
    const PointView global(*global_layer), local(*local_layer);
    parallel_for_blocks(
        s.chosen.size(),
        [&](size_t first, size_t last)
        {
            size_t plane = s.first_plane[first / BLOCK_SIZE], line = s.first_line[first / BLOCK_SIZE];
            for (size_t k = first; k < last; k++)
            {
                const ChosenSurface& c = s.chosen[k];
                if (!c.found()) continue;
                const LocalSurface& surface = s.global->of_point[c.global_id];
                const Eigen::Vector3d mean = point_of(global, c.global_id) + surface.to_mean.cast<double>();
                const auto point = to_mrpt(point_of(local, s.nearest.local.ids[k]));
                if (c.shape == SurfaceShape::Planar)
                {
                    const Eigen::Vector3d n = oriented_normal(surface, mean, sensor).normalized();
                    auto& pair = out.paired_pt2pl[plane++];
                    pair.pl_global.plane.coefs = {n.x(), n.y(), n.z(), -n.dot(mean)};
                    pair.pl_global.centroid = to_mrpt(mean), pair.pt_local = point;
                    continue;
                }
                const Eigen::Vector3d u = surface.direction.cast<double>().normalized();
                auto& pair = out.paired_pt2ln[line++];
                pair.ln_global.pBase = to_mrpt(mean), pair.ln_global.director = {u.x(), u.y(), u.z()};
                pair.pt_local = point;
            }
        });
    // Bits of neighbours share a word: one thread.
    auto& local_paired = state.localPairedBitField.point_layers.at(localLayer);
    for (size_t k = 0; k < s.chosen.size(); k++)
        if (s.chosen[k].found()) local_paired[s.nearest.local.ids[k]] = true;
}

void append_surface_costs(const mrpt::maps::CPointsMap& global, double gate, const SurfaceScratch& s,
                          std::vector<double>& costs)
{
    const PointView points(global);
    const auto cost = [&](size_t i)
    {
        const ChosenSurface& c = s.chosen[i];
        if (c.shape == SurfaceShape::Unknown) return std::numeric_limits<double>::quiet_NaN();
        if (!c.found()) return gate * gate;
        const LocalSurface& surface = s.global->of_point[c.global_id];
        const Eigen::Vector3d mean = point_of(points, c.global_id) + surface.to_mean.cast<double>();
        return distance_sq(surface, c.shape, point_of(s.nearest.local.in_global, i) - mean);
    };
    for (size_t i = 0; i < s.chosen.size(); i++) costs.push_back(cost(i));
}

double weight_of_layers(const Matcher_Points_Base& matcher, const layer_name_t& globalLayer,
                        const layer_name_t& localLayer)
{
    const auto global = matcher.weight_pt2pt_layers.find(globalLayer);
    if (global == matcher.weight_pt2pt_layers.end()) return 1.0;
    const auto local = global->second.find(localLayer);
    return local == global->second.end() ? 1.0 : local->second;
}

Eigen::Vector3d sensor_of(const metric_map_t& scan)
{
    return -to_eigen(scan.coordinate_offset());
}

}  // namespace mp2p_icp
