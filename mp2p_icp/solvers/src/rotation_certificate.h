#pragma once

#include <Eigen/Dense>
#include <limits>
#include <optional>

namespace mp2p_icp
{
/** What can be proven about a rotation R0 as the minimum of f(R) = x' Q x, x = (columns of R, 1).
 *
 * With q = (w, v) the unit quaternion of a turn about the pose's own axes, f(R0 R(q)) is a quartic form in q.
 * With z = (r wx, r wy, r wz, xx, yy, zz, r xy, r xz, r yz), r = sqrt 2, |z| <= 1, it is
 *
 *     f(R0 R(q)) = f(R0) + scale z' G z + 2 w^3 g . v
 *
 * g being the gradient at R0 and scale the mean of f over all rotations minus f(R0) (|Q| where R0 is no
 * better than the mean; any will do for the identity). G is not unique: products of entries of z coincide (wx
 * yz = wy xz), which leaves 14 free numbers. If any G of that family is positive semidefinite, and g = 0,
 * then no rotation is lower than R0. In general
 *
 *     min f >= f(R0) - scale max(0, -lambda_min(G)) - 2 max(w^3 |v|) |g|
 *
 * The converse does not hold: forms that are nonnegative without being sums of squares cannot be certified,
 * as that of Choi and Lam, 1977. The relaxation is that of Lasserre, "Global optimization with polynomials
 * and the problem of moments", 2001, or Briales and Gonzalez-Jimenez, "Convex global 3D registration with
 * Lagrangian duality", 2017 (whose dual is the same problem).
 */
struct RotationCertificate
{
    /// f(R0) - min f <= gap, whatever else is said here; in units of the cost. Rounding is allowed for.
    double gap = std::numeric_limits<double>::infinity();
    bool holds = false;  ///< gap <= tolerance * scale, and R0 is better than the mean
    double cost = 0;     ///< f(R0)
    double scale = 0;    ///< see above
    double slope = 0;    ///< |g| / scale: if large, R0 is no minimum at all and steps down from it are due
    /// The member found. Class sums and a Cholesky factorisation of it are all that a check needs.
    Eigen::Matrix<double, 9, 9> G = Eigen::Matrix<double, 9, 9>::Zero();
    /// Where to look for a lower minimum, if it does not hold: nearly always in the basin of the lowest.
    std::optional<Eigen::Matrix3d> better_start;
    int barrier_steps = 0;  ///< 0: closed forms sufficed

    /** The least eigenvalue of G. If positive, R0 is the only minimum: at the angle theta from it f is higher
     * by scale * margin * (1 - cos(theta/2)^4), but for the slope. At most that of the Hessian over scale, so
     * not positive where the minimum is a valley or has equals.
     */
    double margin() const;
};

struct CertificateOptions
{
    double tolerance = 1e-9;  ///< relative to `scale`
    /// Look for a G with this margin, too, so that R is the only minimum. The proof does not depend on it.
    double wanted_margin = -std::numeric_limits<double>::infinity();
    bool search = true;  ///< beyond the closed forms
};

/** The proof for R, which is made orthonormal first.
 *
 * It is about this Q: not about the pairings, nor what rounding did before; where f hardly depends on R (see
 * RotationQuadratic::depends_on_rotation) there is nothing to prove. It does not hold for numbers that are
 * not finite, for an R that is no rotation (the gap is infinite then), nor where rounding (2e-14 |Q|) is
 * above the tolerance.
 */
RotationCertificate certify_rotation(const Eigen::Matrix<double, 10, 10>& Q, const Eigen::Matrix3d& R,
                                     const CertificateOptions& options = {});

}  // namespace mp2p_icp
