#include "pairings_on_surfaces.h"

#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <array>
#include <cmath>
#include <map>

#include "surface_scales.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;
using mrpt::math::TPoint3D;

/** The share of the pairings whose surface may have been misjudged, as a fraction of a row along the surface
 * that each of them may feign. With ObservabilityParameters::feigned_factor: what fewer than one in 200 say
 * does not count.
 */
constexpr double MISJUDGED = 1.0 / 800;

/// Trees are more than so many of the points; fewer are places where surfaces meet and were seen too sparsely
/// to tell.
constexpr double LEAST_BODIES = 0.1;
/// Some lonely points of a cloud say nothing of its surfaces; a cloud of such points has none.
constexpr double LEAST_UNKNOWN = 0.5;

/// Within some 20 degrees.
bool parallel(const Vector3d& a, const Vector3d& b)
{
    return std::abs(a.dot(b)) > 0.94 * b.norm();
}
bool perpendicular(const Vector3d& a, const Vector3d& b)
{
    return std::abs(a.dot(b)) < 0.34 * b.norm();
}

Vector3d coordinates(const mrpt::maps::CPointsMap& layer, size_t i)
{
    return {double(layer.getPointsBufferRef_x()[i]), double(layer.getPointsBufferRef_y()[i]),
            double(layer.getPointsBufferRef_z()[i])};
}

/// A layer, one of its points, and what it looks like there.
struct Place
{
    const SurfaceScales* cloud = nullptr;  ///< null: in none of the clouds
    uint32_t point = 0;
    SurfaceAround surface;
};

class SurfaceRows
{
 public:
    SurfaceRows(const Pairings& in, const metric_map_t& global, const std::map<layer_name_t, double>& layers,
                const mrpt::poses::CPose3D& pose)
        : in_(in), R_(rotation_of(pose)), t_(translation_of(pose))
    {
        for (const auto& [layer, voxel] : layers)
        {
            clouds_.emplace_back(global, layer, voxel);
            out_.spacing = std::max(out_.spacing, clouds_.back().spacing());
        }
    }

    SurfacePairings take()
    {
        take_points(), take_planes(), take_lines();
        out_.pairings.paired_ln2ln = in_.paired_ln2ln, out_.pairings.ln2ln_weights = in_.ln2ln_weights;
        out_.pairings.paired_pl2pl = in_.paired_pl2pl, out_.pairings.pl2pl_weights = in_.pl2pl_weights;
        return std::move(out_);
    }

 private:
    void take_points();
    void take_planes();
    void take_lines();
    void take_point(size_t i, double weight);
    bool take_edge(const Place& place, double voxel, const Vector3d& local, double weight);
    void take_surface(const SurfaceAround& surface, const Vector3d& local, double weight);
    void compare(const SurfaceAround& surface, const Vector3d& local);
    void add_plane(const Vector3d& normal, const Vector3d& at, const Vector3d& local, double weight,
                   Pairings& to);

    std::vector<Place> places_of_points() const;
    std::vector<Place> places_near(const std::vector<Vector3d>& global) const;
    void look_around(std::vector<Place>& places) const;
    Vector3d moved(const TPoint3D& local) const { return R_ * to_eigen(local) + t_; }

    const Pairings& in_;
    const Matrix3d R_;
    const Vector3d t_;
    std::vector<SurfaceScales> clouds_;  ///< of the global map
    SurfacePairings out_;
};

void SurfaceRows::look_around(std::vector<Place>& places) const
{
    parallel_for_blocks(places.size(),
                        [&](size_t first, size_t last)
                        {
                            for (size_t i = first; i < last; i++)
                                if (places[i].cloud) places[i].surface = places[i].cloud->at(places[i].point);
                        });
}

/// Where the global points of pairings have their indices.
std::vector<Place> SurfaceRows::places_of_points() const
{
    std::vector<Place> places(in_.paired_pt2pt.size());
    for (size_t i = 0; i < places.size(); i++)
    {
        const auto& pair = in_.paired_pt2pt[i];
        for (const auto& cloud : clouds_)
            if (!places[i].cloud && pair.globalIdx < cloud.points().size() &&
                coordinates(cloud.points(), pair.globalIdx) == to_eigen(pair.global))
                places[i].cloud = &cloud, places[i].point = pair.globalIdx;
    }
    look_around(places);
    return places;
}

/// The middle of a surface of a cloud has points nearby: of points scattered at random, one in 50 places has
/// none so near. That of a primitive of the map need not.
std::vector<Place> SurfaceRows::places_near(const std::vector<Vector3d>& global) const
{
    std::vector<Place> places(global.size());
    for (const auto& cloud : clouds_)
    {
        const auto points = cloud.points_near(global, 2.4 * cloud.spacing());
        for (size_t i = 0; i < places.size(); i++)
            if (!places[i].cloud && points[i] != NO_NEIGHBOR)
                places[i].cloud = &cloud, places[i].point = points[i];
    }
    look_around(places);
    return places;
}

void SurfaceRows::take_points()
{
    const auto weights = expanded_weights(in_.point_weights, in_.paired_pt2pt.size());
    const auto places = places_of_points();
    std::vector<size_t> unknown, bodies;
    for (size_t i = 0; i < weights.size(); i++)
    {
        const Vector3d local = moved(in_.paired_pt2pt[i].local);
        const Place& place = places[i];
        const SurfaceAround& surface = place.surface;
        if (!place.cloud)
            take_point(i, weights[i]);
        else if (surface.is_surface())
            take_surface(surface, local, weights[i]), compare(surface, local);
        else if (surface.bulky && !take_edge(place, surface.voxel, local, weights[i]))
            bodies.push_back(i);
        else if (surface.shape == SurfaceShape::Unknown)
            unknown.push_back(i);
    }
    const auto take_if = [&](const std::vector<size_t>& which, double least_share)
    {
        if (static_cast<double>(which.size()) > least_share * static_cast<double>(weights.size()))
            for (const size_t i : which) take_point(i, weights[i]);
    };
    take_if(bodies, LEAST_BODIES), take_if(unknown, LEAST_UNKNOWN);
}

void SurfaceRows::take_point(size_t i, double weight)
{
    out_.pairings.paired_pt2pt.push_back(in_.paired_pt2pt[i]);
    out_.pairings.point_weights.emplace_back(1, weight);
}

void SurfaceRows::take_planes()
{
    const auto weights = expanded_weights(in_.pt2pl_weights, in_.paired_pt2pl.size());
    std::vector<Vector3d> middles;
    for (const auto& pair : in_.paired_pt2pl) middles.push_back(to_eigen(pair.pl_global.centroid));
    const auto places = places_near(middles);
    for (size_t i = 0; i < weights.size(); i++)
    {
        const auto& pair = in_.paired_pt2pl[i];
        const auto& n = pair.pl_global.plane.coefs;
        if (places[i].cloud)
        {
            const SurfaceAround& surface = places[i].surface;
            if (surface.shape == SurfaceShape::Planar && parallel(surface.axes.col(0), {n[0], n[1], n[2]}))
                take_surface(surface, moved(pair.pt_local), weights[i]),
                    compare(surface, moved(pair.pt_local));
            continue;
        }
        out_.pairings.paired_pt2pl.push_back(pair);
        out_.pairings.pt2pl_weights.emplace_back(1, weights[i]);
    }
}

void SurfaceRows::take_lines()
{
    const auto weights = expanded_weights(in_.pt2ln_weights, in_.paired_pt2ln.size());
    std::vector<Vector3d> bases;
    for (const auto& pair : in_.paired_pt2ln) bases.push_back(to_eigen(pair.ln_global.pBase));
    const auto places = places_near(bases);
    for (size_t i = 0; i < weights.size(); i++)
    {
        const auto& pair = in_.paired_pt2ln[i];
        const Vector3d u(pair.ln_global.director[0], pair.ln_global.director[1], pair.ln_global.director[2]);
        if (places[i].cloud)
        {
            const SurfaceAround& surface = places[i].surface;
            const bool contains =
                surface.shape == SurfaceShape::Planar && perpendicular(surface.axes.col(0), u);
            if (contains || (surface.shape == SurfaceShape::Linear && parallel(surface.axes.col(2), u)))
                take_surface(surface, moved(pair.pt_local), weights[i]),
                    compare(surface, moved(pair.pt_local));
            continue;
        }
        out_.pairings.paired_pt2ln.push_back(pair);
        out_.pairings.pt2ln_weights.emplace_back(1, weights[i]);
    }
}

/// What is two voxels away in the six directions of the axes. \return whether there is any
bool SurfaceRows::take_edge(const Place& place, double voxel, const Vector3d& local, double weight)
{
    const Vector3d here = coordinates(place.cloud->points(), place.point);
    std::vector<Vector3d> around;
    for (int axis = 0; axis < 3; axis++)
        for (const double step : {-2.0, 2.0}) around.push_back(here + step * voxel * Vector3d::Unit(axis));
    std::vector<SurfaceAround> beside;
    for (const uint32_t point : place.cloud->points_near(around, voxel))
        if (point != NO_NEIGHBOR)
            if (const SurfaceAround surface = place.cloud->at(point); surface.is_surface())
                beside.push_back(surface);
    if (beside.empty()) return false;
    for (const auto& surface : beside)
        take_surface(surface, local, weight / static_cast<double>(beside.size()));
    return true;
}

void SurfaceRows::take_surface(const SurfaceAround& s, const Vector3d& local, double weight)
{
    const auto add = [&](int axis, double w, Pairings& to)
    {
        const Vector3d n = s.axes.col(axis);
        add_plane(n, s.mean, s.mean + n * n.dot(local - s.mean), w, to);
    };
    add(0, weight, out_.pairings);
    if (s.shape == SurfaceShape::Linear)
    {
        add(1, weight, out_.pairings);
        return add(2, weight * (s.tilt.sum() + MISJUDGED), out_.feigned);
    }
    add(1, weight * (s.tilt[0] + MISJUDGED), out_.feigned);
    add(2, weight * (s.tilt[1] + MISJUDGED), out_.feigned);
}

void SurfaceRows::compare(const SurfaceAround& surface, const Vector3d& local)
{
    if (surface.shape != SurfaceShape::Planar) return;
    const Vector3d normal = surface.axes.col(0);
    out_.distances.push_back({normal, normal.dot(local - surface.mean), surface.thickness});
}

void SurfaceRows::add_plane(const Vector3d& normal, const Vector3d& at, const Vector3d& local, double weight,
                            Pairings& to)
{
    point_plane_pair_t pair;
    pair.pl_global.plane.coefs = {normal.x(), normal.y(), normal.z(), -normal.dot(at)};
    pair.pl_global.centroid = to_mrpt(at);
    pair.pt_local = to_mrpt(R_.transpose() * (local - t_));
    to.paired_pt2pl.push_back(pair);
    to.pt2pl_weights.emplace_back(1, weight);
}
}  // namespace

SurfacePairings pairings_on_surfaces(const Pairings& pairings, const metric_map_t& global,
                                     const std::map<layer_name_t, double>& layers,
                                     const mrpt::poses::CPose3D& pose)
{
    return SurfaceRows(pairings, global, layers, pose).take();
}

CloudGrain grain_of(const metric_map_t& map, const std::map<layer_name_t, double>& layers)
{
    CloudGrain grain;
    for (const auto& [layer, voxel] : layers)
    {
        const SurfaceScales cloud(map, layer, voxel);
        grain.spacing = std::max(grain.spacing, cloud.spacing());
        grain.thickness = std::max(grain.thickness, cloud.typical_thickness());
    }
    return grain;
}

}  // namespace mp2p_icp
