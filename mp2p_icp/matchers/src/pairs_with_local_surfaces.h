#pragma once

#include <mp2p_icp/local_surfaces.h>

#include <Eigen/Dense>
#include <optional>

#include "nearest_candidates.h"

namespace mp2p_icp
{
/** A plane or line of the global layer: the one around one of its points. `Other`: none was chosen, as no
 * global point is near, or those that are have surfaces that do not fit. `Unknown`: there are global points,
 * but no surfaces around them, so that this local point says nothing.
 */
struct ChosenSurface
{
    uint32_t global_id = NO_NEIGHBOR;
    SurfaceShape shape = SurfaceShape::Other;

    bool found() const { return shape == SurfaceShape::Planar || shape == SurfaceShape::Linear; }
};

/// Scratch memory of the matchers to surfaces on one pair of layers.
struct SurfaceScratch
{
    NearestScratch nearest;
    LocalSurfaces::ConstPtr global, local;              ///< local: only where it is needed
    std::vector<SurfaceShape> global_shapes;            ///< of them, by the limits of the matcher
    std::optional<std::vector<uint32_t>> local_planar;  ///< if local points must lie on planes, too: those
    std::vector<ChosenSurface> chosen;                  ///< one per local point
    std::vector<size_t> first_plane, first_line;
    std::vector<float> distances;
};

/// Of voxels of that side (m), or, where it is 0, of the nearest points.
LocalSurfaceOptions neighbourhoods(double voxel, uint32_t knn, double radius);

/// The scratch memory of this matcher on these layers, with the index, the global surfaces and, if wanted,
/// the local ones at hand.
SurfaceScratch& surface_scratch(const Matcher_Points_Base& matcher, const layer_name_t& globalLayer,
                                const layer_name_t& localLayer, const LocalSurfaceOptions& options,
                                MatchState& state, bool local_too = false);

/// Which of them are planar.
std::vector<uint32_t> planar_points(const LocalSurfaces& surfaces, const ShapeLimits& limits);

/// Up to k global points for each local point, nearer than `max_distance` (m), into s.nearest.ids.
void find_nearest(uint32_t k, double max_distance, SurfaceScratch& s);

/// Asks that the plane around a local point has the normal of the global plane. All local points that are
/// given then lie on planes.
struct NormalAgreement
{
    Eigen::Matrix3d rotation;  ///< from the local frame to the global one
    double min_cosine = 0;
    /// Where the layers were scanned from, each in its own frame: then the sides of a plane differ.
    std::optional<Eigen::Vector3d> global_sensor, local_sensor;
};

/// The shapes that a matcher wants, and how near they must be.
struct SurfaceChoice
{
    ShapeLimits limits;
    double max_plane_distance = 0, max_line_distance = 0;  ///< m; nearer than this. 0: not wanted
    std::optional<NormalAgreement> agreement;
};

/// For each local point, the surface of the first of its k global points that fits, into s.chosen. `global`
/// and `local` are the layers.
void choose_surfaces(const mrpt::maps::CPointsMap& global, const mrpt::maps::CPointsMap& local, uint32_t k,
                     const SurfaceChoice& choice, SurfaceScratch& s);

/// How many local points are paired, or not paired for want of a surface that fits: all but the `Unknown`.
size_t potential_pairings(const SurfaceScratch& s);

/** Appends the chosen planes and lines with this weight each, and marks their local points as paired.
 * \param sensor if given, the normals point to it
 */
void append_surface_pairings(const layer_name_t& globalLayer, const layer_name_t& localLayer, double weight,
                             const std::optional<Eigen::Vector3d>& sensor, SurfaceScratch& s,
                             MatchState& state, Pairings& out);

/** Appends, for each local point, the squared distance to its chosen surface; `gate`^2 where none was chosen;
 * and NaN where it is unknown. `global` is the layer.
 */
void append_surface_costs(const mrpt::maps::CPointsMap& global, double gate, const SurfaceScratch& s,
                          std::vector<double>& costs);

inline Eigen::Vector3d point_of(const PointView& points, size_t i)
{
    return {double(points.x[i]), double(points.y[i]), double(points.z[i])};
}

/// The factor on the weights of the pairings of two layers.
double weight_of_layers(const Matcher_Points_Base& matcher, const layer_name_t& globalLayer,
                        const layer_name_t& localLayer);

/// Where a scan was taken that has its sensor at the origin of its original coordinates.
Eigen::Vector3d sensor_of(const metric_map_t& scan);

}  // namespace mp2p_icp
