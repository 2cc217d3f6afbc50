#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>
#include <mp2p_icp/random.h>
#include <mrpt/poses/CPose3D.h>

#include <Eigen/Dense>
#include <vector>

namespace mp2p_icp::synthetic
{
/** \file The random worlds of the OLAE-ICP report's experiments: points, centroids of planes and base points
 * of lines uniform in the cube (0,0,0)-(50,50,50) m of the local frame, directions uniform on the sphere, a
 * pose uniform over SO(3) and over a cube of 100 m, and the transformed set as the global one. The global set
 * has all the noise.
 */
constexpr double REPORT_CUBE = 50;  ///< side, m

struct ReportNoise
{
    double points = 0;   ///< standard deviation of a global coordinate, of all positions, m
    double normals = 0;  ///< of the angle by which a global direction is turned about a uniform axis, rad
};

struct ReportWorld
{
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< of local with respect to global
    Eigen::Vector3d t = Eigen::Vector3d::Zero();
    Pairings pairings;
    Pairings exact;                ///< the same without noise and outliers
    std::vector<size_t> outliers;  ///< of the points, increasing

    mrpt::poses::CPose3D truth() const;
};

/// So many points, planes and lines; the report has no lines.
ReportWorld report_world(size_t points, size_t planes, const ReportNoise& noise, SeededRandom& random,
                         size_t lines = 0);

/** The global points of a share `ratio` of the point pairings become uniform in the transformed cube (the
 * cube as the global frame sees it), so that outliers and inliers fill the same space and nothing but their
 * pairing tells them apart. Those nearer than `least_displacement` to the right place are drawn again.
 */
void add_outliers(ReportWorld& world, double ratio, SeededRandom& random, double least_displacement = 0);

/** Weights that are inverse variances, to first order:
 *
 * - a coordinate of a point: sigma_p^2;
 * - an offset n_g' (R c_l + t - c_g): at the true pose this is minus the noise of c_g along n_g, of variance
 *   sigma_p^2 whatever n_g is. The error of n_g has no lever, because c_l and c_g are the same point of the
 *   plane but for that noise. The same holds for the two coordinates of a base point across its line;
 * - a tangent direction of a normal or line: a turn by theta about the axis u moves n by theta u x n, of
 *   variance E[theta^2] E[u_x^2] = s^2 / 3.
 *
 * \param offsets false: planes and lines count by their directions only, as in the report.
 */
PairWeights maximum_likelihood_weights(const ReportNoise& noise, bool offsets = true);

/// The report's measures of error.
struct PoseError
{
    double rotation = 0;     ///< norm of the logarithm, rad
    double translation = 0;  ///< m
};
PoseError error_of(const mrpt::poses::CPose3D& pose, const ReportWorld& world);

}  // namespace mp2p_icp::synthetic
