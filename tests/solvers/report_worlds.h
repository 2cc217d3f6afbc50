#pragma once

#include <mp2p_icp/WeightParameters.h>

#include <cmath>
#include <vector>

#include "make_primitives.h"

namespace mp2p_icp_test
{
/** \file The random worlds of the OLAE-ICP report's experiments: points and centroids of planes uniform in
 * the cube (0,0,0)-(50,50,50) m of the local frame, normals uniform on the sphere, a pose uniform over SO(3)
 * and over a cube of 100 m, and the transformed set as the global one. The global set has all the noise.
 */
constexpr double REPORT_CUBE = 50;  ///< side, m

struct ReportNoise
{
    double points = 0;   ///< standard deviation of a global coordinate, of points and centroids of planes, m
    double normals = 0;  ///< of the angle by which a global normal is turned about a uniform axis, rad
};

struct ReportWorld
{
    Matrix3d R = Matrix3d::Identity();  ///< of local with respect to global
    Vector3d t = Vector3d::Zero();
    Pairings pairings;
    Pairings exact;                ///< the same without noise and outliers
    std::vector<size_t> outliers;  ///< of the points, increasing

    CPose3D truth() const { return mp2p_icp::make_pose(R, t); }
};

inline Vector3d in_report_cube(SeededRandom& random)
{
    return random_point(random, REPORT_CUBE / 2) + Vector3d::Constant(REPORT_CUBE / 2);
}
inline Vector3d isotropic_noise(SeededRandom& random, double sigma)
{
    const double x = random.gaussian(sigma), y = random.gaussian(sigma);
    return {x, y, random.gaussian(sigma)};
}

/** The global points of a share `ratio` of the point pairings become uniform in the transformed cube (the
 * cube as the global frame sees it), so that outliers and inliers fill the same space and nothing but their
 * pairing tells them apart. Those nearer than `least_displacement` to the right place are drawn again.
 */
inline void add_outliers(ReportWorld& world, double ratio, SeededRandom& random,
                         double least_displacement = 0)
{
    const size_t n = world.pairings.paired_pt2pt.size();
    const auto count = static_cast<size_t>(std::lround(ratio * static_cast<double>(n)));
    world.outliers = mp2p_icp::random_subset(n, count, random());
    for (const size_t i : world.outliers)
    {
        Vector3d global;
        do global = world.R * in_report_cube(random) + world.t;
        while ((global - global_of(world.exact, i)).norm() < least_displacement);
        world.pairings.paired_pt2pt[i].global = mp2p_icp::to_mrpt(global);
    }
}

inline ReportWorld report_world(size_t points, size_t planes, const ReportNoise& noise, SeededRandom& random)
{
    ReportWorld world;
    world.R = any_rotation(random), world.t = random_point(random, REPORT_CUBE);
    for (size_t i = 0; i < points; i++)
    {
        const Vector3d local = in_report_cube(random), global = world.R * local + world.t;
        add_pair(world.exact, global, local);
        add_pair(world.pairings, global + isotropic_noise(random, noise.points), local);
    }
    for (size_t i = 0; i < planes; i++)
    {
        const Vector3d local = in_report_cube(random), n_local = random_direction(random);
        const Vector3d global = world.R * local + world.t, n = world.R * n_local;
        const Vector3d turned = rotation_about(random_direction(random), random.gaussian(noise.normals)) * n;
        world.exact.paired_pl2pl.push_back({patch(global, n), patch(local, n_local)});
        world.pairings.paired_pl2pl.push_back(
            {patch(global + isotropic_noise(random, noise.points), turned), patch(local, n_local)});
    }
    return world;
}

/** Weights that are inverse variances, to first order:
 *
 * - a coordinate of a point: sigma_p^2;
 * - an offset n_g' (R c_l + t - c_g): at the true pose this is minus the noise of c_g along n_g, of variance
 *   sigma_p^2 whatever n_g is. The error of n_g has no lever, because c_l and c_g are the same point of the
 *   plane but for that noise;
 * - a tangent direction of a normal: a turn by theta about the axis u moves n by theta u x n, of variance
 *   E[theta^2] E[u_x^2] = s^2 / 3.
 *
 * \param offsets false: planes count by their normals only, as in the report.
 */
inline mp2p_icp::PairWeights maximum_likelihood_weights(const ReportNoise& noise, bool offsets = true)
{
    mp2p_icp::PairWeights w;
    w.pt2pt = 1 / (noise.points * noise.points);
    w.pl2pl = offsets ? w.pt2pt : 0.0;
    if (noise.normals > 0) w.pl2pl_direction = 3 / (noise.normals * noise.normals);
    return w;
}

/// The report's measures of error.
struct PoseError
{
    double rotation = 0;     ///< norm of the logarithm, rad
    double translation = 0;  ///< m
};
inline PoseError error_of(const CPose3D& pose, const ReportWorld& world)
{
    return {angle_between(mp2p_icp::rotation_of(pose), world.R),
            (mp2p_icp::translation_of(pose) - world.t).norm()};
}
}  // namespace mp2p_icp_test
