#pragma once

#include <mp2p_icp/optimal_tf_olae.h>

#include <Eigen/Dense>

#include "point_sums.h"

namespace mp2p_icp
{
/// How a rotation is found from pairs of vectors.
enum class AttitudeMethod : uint8_t
{
    Horn,
    OlaeReport,
    OlaeLeastSquares,
    OlaeNewton
};

/// Horn's K: q' K q = trace(R(q)' B) for unit quaternions q = (w, x, y, z), B = sum w a b'.
Eigen::Matrix4d horn_matrix(const Eigen::Matrix3d& B);
/// What bounds the eigenvalues of horn_matrix(): half of sum w (|a|^2 + |b|^2).
double attitude_scale(const PointSums& vectors);

struct Attitude
{
    Eigen::Quaterniond q{1, 0, 0, 0};
    /// Do the vectors determine it so well that rounding of the sums does not matter? Else q is not to be
    /// used.
    bool sure = false;
};
/// The rotation of centred (or unit) vectors by their sums; some 0.1 us.
Attitude fast_attitude(const PointSums& vectors, AttitudeMethod method);

/** The rotation that maximises trace(R' B): Horn's 4x4 eigenproblem, for all cases. Where the largest
 * eigenvalue is multiple (to within 1e-10 of `scale`), the quaternion of that eigenspace nearest to `guess`.
 */
struct EigenAttitude
{
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    bool determined = false;  ///< is the eigenvalue simple?
    double distance = 0;  ///< to the next eigenvalue, relative to `scale`: the square of a relative spread
};
EigenAttitude eigen_attitude(const Eigen::Matrix3d& B, double scale, const Eigen::Matrix3d& guess);

/** OLAE's linear system in one of the four frames of the method of sequential rotations: local vectors are
 * turned by 180 degrees about an axis (frames 1, 2, 3) or not (0), which only flips signs in the sums.
 */
class OlaeFrame
{
 public:
    /// The frame in which `q` has its largest component.
    OlaeFrame(const PointSums& vectors, const Eigen::Quaterniond& q);

    /// The Gibbs vector of the least squares solution (`LeastSquares`) or of the report's system.
    Eigen::Vector3d solve(OlaeSystem system) const;
    /// Solves the system for another right-hand side: sum w s x e (LeastSquares), half of that less
    /// sum w d (d.g) (Report); see closed_form.cpp.
    Eigen::Vector3d correction(OlaeSystem system, const Eigen::Vector3d& rhs) const;
    /// A local vector as it stands in this frame.
    Eigen::Vector3d turned(const Eigen::Vector3d& b) const { return flip_.cwiseProduct(b); }
    Eigen::Vector3d gibbs(const Eigen::Quaterniond& q) const;
    Eigen::Quaterniond rotation(const Eigen::Vector3d& gibbs) const;

 private:
    Eigen::Matrix3d matrix(OlaeSystem system) const;
    Eigen::Quaterniond axis_;  ///< the half turn, or no turn
    Eigen::Vector3d flip_;     ///< +1 or -1 for each coordinate
    PointSums sums_;           ///< of the turned vectors
};

}  // namespace mp2p_icp
