#pragma once

#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/plane_patch.h>
#include <mrpt/maps/CPointsMap.h>

#include <cstdint>
#include <vector>

namespace mp2p_icp_filters
{
/// What counts as a plane.
struct PlaneParameters : public mp2p_icp::Parameterizable
{
    double voxel_size = 0.25;       ///< side of the smallest cells, m
    uint32_t voxel_levels = 3;      ///< cells of 1, 2, 4... times that side are tried
    uint32_t minimum_inliers = 50;  ///< points
    double minimum_area = 0.25;     ///< m^2; see ExtractedPlane::area
    double maximum_noise = 0.05;    ///< standard deviation of the distance to the plane, m
    double roughness = 0;           ///< of flat surfaces and of the sensor, apart from noise, m; see below
    double maximum_angle_deg = 12;  ///< between the normals of a cell and of the plane that takes it in
    double maximum_angle_deviation_deg = 1;  ///< predicted standard deviation of the normal
    double maximum_unevenness =
        0.5;  ///< rms height of bends, waves and steps of a surface, over its noise or roughness

    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
};

/// A plane found in a cloud.
struct ExtractedPlane
{
    mp2p_icp::fitted_plane_t plane;  ///< with a fit, axis_u being the direction of the widest spread
    /// The points it was fitted to: near the plane, where nothing else is near. Indices, increasing.
    std::vector<uint32_t> inliers;
    double area = 0;  ///< of a rectangle in which the points would be spread as the inliers are, m^2
};

/** The planes in a cloud, that with most inliers first, with normals towards the sensor.
 *
 * Cells that are flat grow into regions; a region becomes a plane through the points near it, by least
 * squares along its normal, once its footprint (connected in the plane) is freed of the places where
 * something stands beside it; then edges with other surfaces do not bend it. What remains is tried again with
 * cells of twice the side. The covariance of a fit makes no assumption on how the noise depends on the place:
 * it is the "sandwich" of squared residuals of H. White, "A heteroskedasticity-consistent covariance matrix
 * estimator", Econometrica 48(4), 1980.
 *
 * Plaster, paving and the rings of a LiDAR are off by some mm over decimetres, which is more than the noise
 * of a good sensor: what is within `roughness` of a plane counts as if noise had put it there. With 0.01 m
 * the walls and floors of such scans are found, where 0 finds hardly one; but their covariances know nothing
 * of it, and are too small then.
 *
 * Refused are: too few or too thick inliers, no extent in two directions, a surface that is bent more than
 * its noise or roughness explains (spheres, pipes), a slab in a volume full of points, planes seen edge-on
 * (within 2 degrees).
 *
 * A point belongs to one plane at most. Points that are not finite are left out, and so are those whose cell
 * has no number (beyond 2^62 times the voxel size). The order of the points decides ties only. The result
 * does not depend on the number of threads: one is used. Reads the cloud only, so that several threads may
 * read it. Some microseconds per point. \param sensor Where the cloud was seen from, in its frame, m.
 * \exception std::invalid_argument for parameters out of range.
 */
std::vector<ExtractedPlane> extract_planes(const mrpt::maps::CPointsMap& cloud,
                                           const PlaneParameters& parameters = {},
                                           const Eigen::Vector3d& sensor = Eigen::Vector3d::Zero());

}  // namespace mp2p_icp_filters
