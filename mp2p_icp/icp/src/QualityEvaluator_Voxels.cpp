#include <mp2p_icp/QualityEvaluator_Voxels.h>
#include <mp2p_icp/parallel.h>

#include <algorithm>

#include "QualityEvaluator_Voxels_surfaces.h"
#include "direction_weights.h"
#include "quality_points.h"

IMPLEMENTS_MRPT_OBJECT(QualityEvaluator_Voxels, mp2p_icp::QualityEvaluator, mp2p_icp)

namespace mp2p_icp
{
namespace
{
constexpr double LEAST_VOXELS = 3;      // as few points as fix a pose
constexpr double LEAST_SCORE = 0.0111;  // exp(-3^2 / 2): farther off is not there
constexpr double IN_FRONT_WEIGHT = 0.5;
/// How far behind a local point, in ranges, a global surface makes it stand in front.
constexpr double REACH = 2;
/// Measured: up to 0.15 (rims of surfaces) for sensors in rooms and streets, 0.64 for an object from outside.
constexpr double MAX_OWN_CROSSINGS = 0.35;

using Points = std::vector<Eigen::Vector3d>;

Points points_of(const PointsFromSensor& source)
{
    Points points;
    source.for_each(
        [&](const Eigen::Vector3d& p)
        {
            if (p.squaredNorm() > 0) points.push_back(p);
        });
    return points;
}

double median(std::vector<double> values)
{
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Median distance from the median point, m: what the bulk of the points spans.
double size_of(const Points& points)
{
    Eigen::Vector3d centre;
    for (int k = 0; k < 3; k++)
    {
        std::vector<double> values;
        for (const auto& p : points) values.push_back(p[k]);
        centre[k] = median(std::move(values));
    }
    std::vector<double> distances;
    for (const auto& p : points) distances.push_back((p - centre).norm());
    return median(std::move(distances));
}

size_t occupied_voxels(const Points& points, double side)
{
    const VoxelGrid grid(side);
    VoxelTable table;
    for (const auto& p : points)
        if (const auto v = grid.voxel_of(p)) table.find_or_add(*v);
    return table.voxels().size();
}

/// A sixteenth of the size, or as much more (up to a quarter) as gives each occupied voxel four points.
double resolution_for(const Points& points)
{
    constexpr double POINTS_PER_VOXEL = 4, FACTOR = 1.26;
    const double size = size_of(points);
    if (!(size > 0)) return 0.25;
    double side = size / 16;
    while (side < size / 4 && static_cast<double>(points.size()) <
                                  POINTS_PER_VOXEL * static_cast<double>(occupied_voxels(points, side)))
        side *= FACTOR;
    return side;
}

VoxelSurfaces surfaces_of(const Points& points, double side, bool flat)
{
    VoxelSurfaces surfaces(side, flat);
    for (const auto& p : points) surfaces.add(p);
    surfaces.finish();
    return surfaces;
}

/// Do the points draw lines in one plane z = const, as those of a 2-D laser scanner?
bool is_flat(const Points& points, const VoxelSurfaces& surfaces)
{
    const auto [lo, hi] = std::minmax_element(points.begin(), points.end(),
                                              [](const auto& a, const auto& b) { return a.z() < b.z(); });
    return hi->z() - lo->z() < 0.5 * surfaces.grid().side() && surfaces.planar_share() < 0.5;
}

/// The surfaces of the global map, where rays of the local one may meet them.
VoxelSurfaces surfaces_around(const PointsFromSensor& global, const Points& local, double side, bool flat)
{
    double reach_sq = 0;
    for (const auto& p : local) reach_sq = std::max(reach_sq, p.squaredNorm());
    const double reach = REACH * std::sqrt(reach_sq) + 4 * side;
    VoxelSurfaces surfaces(side, flat);
    global.for_each(
        [&](const Eigen::Vector3d& p)
        {
            if (p.squaredNorm() <= reach * reach) surfaces.add(p);
        });
    surfaces.finish();
    return surfaces;
}

/// Of each occupied voxel, the point nearest to its centre.
Points one_per_voxel(const Points& points, const VoxelGrid& grid)
{
    VoxelTable table;
    Points chosen;
    for (const auto& p : points)
    {
        const auto v = grid.voxel_of(p);
        if (!v) continue;
        const uint32_t number = table.find_or_add(*v);
        if (number == chosen.size())
            chosen.push_back(p);
        else if ((p - grid.centre_of(*v)).squaredNorm() < (chosen[number] - grid.centre_of(*v)).squaredNorm())
            chosen[number] = p;
    }
    return chosen;
}

struct Counts
{
    double score = 0, weight = 0, counted = 0;

    Counts& operator+=(const Counts& o)
    {
        score += o.score, weight += o.weight, counted += o.counted;
        return *this;
    }
    void add(double s, double w) { score += w * s, weight += w, counted += 1; }
};

bool is_behind(const Eigen::Vector3d& point, const VoxelSurfaces& surfaces)
{
    return surfaces.crosses(point, 0.0, point.norm());
}

void judge(const Eigen::Vector3d& point, double weight, const VoxelSurfaces& global, bool free_space,
           Counts& counts)
{
    const auto fit = global.fit(point);
    if (fit.score > LEAST_SCORE) return counts.add(fit.score, weight);
    if (fit.covered) return counts.add(0.0, weight);
    if (!free_space) return;
    if (is_behind(point, global)) return counts.add(0.0, weight);
    if (global.crosses(point, point.norm(), REACH * point.norm())) counts.add(0.0, IN_FRONT_WEIGHT * weight);
}

/// Is the origin where a sensor saw these points from?
bool seen_from_origin(const Points& asked, const VoxelSurfaces& own)
{
    const auto behind = block_sum<size_t>(asked.size(),
                                          [&](size_t first, size_t last)
                                          {
                                              size_t count = 0;
                                              for (size_t i = first; i < last; i++)
                                                  count += is_behind(asked[i], own);
                                              return count;
                                          });
    return static_cast<double>(behind) <= MAX_OWN_CROSSINGS * static_cast<double>(asked.size());
}

std::vector<double> weights_of(const Points& asked, const VoxelSurfaces& own)
{
    std::vector<const SurfacePiece*> pieces;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    size_t planar = 0;
    for (const auto& p : asked)
    {
        pieces.push_back(own.at(*own.grid().voxel_of(p)));
        if (!pieces.back()->planar) continue;
        sum += pieces.back()->normal() * pieces.back()->normal().transpose();
        planar++;
    }
    const DirectionWeights weights(sum, planar);
    std::vector<double> out;
    for (const auto* piece : pieces) out.push_back(piece->planar ? weights.of(piece->normal()) : 1.0);
    return out;
}
}  // namespace

void QualityEvaluator_Voxels::declare_parameters(ParameterDeclaration& declare)
{
    declare.texts("pointLayers", pointLayers, "cloud layers of both maps to compare; default: all");
    declare.number("resolution", resolution, "m", Range::not_negative(),
                   "side of a voxel; 0: a 16th of the size of the local cloud, or more where it is sparse");
    declare.flag("use_free_space", use_free_space,
                 "local points behind or in front of global surfaces, as seen by the sensor, count against");
    declare.number("minimum_overlap", minimum_overlap, "", Range::between(0, 1),
                   "with a smaller share of the local voxels in places that the global map knows there is no "
                   "overlap");
    declare.number("sensor_x", sensor_x, "m", Range::any(), "where the sensor is in the local frame");
    declare.number("sensor_y", sensor_y, "m", Range::any(), "where the sensor is in the local frame");
    declare.number("sensor_z", sensor_z, "m", Range::any(), "where the sensor is in the local frame");
}

QualityEvaluator::Result QualityEvaluator_Voxels::evaluate(const metric_map_t& pcGlobal,
                                                           const metric_map_t& pcLocal,
                                                           const mrpt::poses::CPose3D& localPose,
                                                           const Pairings&, const MatchContext&) const
{
    const Eigen::Vector3d sensor(sensor_x, sensor_y, sensor_z);
    const PointsFromSensor from_global(pcGlobal, pointLayers, sensor, localPose);
    const Points local = points_of(PointsFromSensor(pcLocal, pointLayers, sensor));
    if (local.empty() || !is_finite(localPose)) return {0.0, true};
    const double side = resolution > 0 ? resolution : resolution_for(local);
    VoxelSurfaces own = surfaces_of(local, side, false);
    const bool flat = is_flat(local, own);
    if (flat) own = surfaces_of(local, side, true);
    const VoxelSurfaces global = surfaces_around(from_global, local, side, flat);

    const Points asked = one_per_voxel(local, own.grid());
    const std::vector<double> weights = weights_of(asked, own);
    const bool free_space = use_free_space && seen_from_origin(asked, own);

    const auto counts = block_sum<Counts>(asked.size(),
                                          [&](size_t first, size_t last)
                                          {
                                              Counts part;
                                              for (size_t i = first; i < last; i++)
                                                  judge(asked[i], weights[i], global, free_space, part);
                                              return part;
                                          });
    if (counts.counted < LEAST_VOXELS || counts.counted < minimum_overlap * static_cast<double>(asked.size()))
        return {0.0, true};
    return {counts.score / counts.weight, false};
}

}  // namespace mp2p_icp
