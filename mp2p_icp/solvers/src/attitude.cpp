#include "attitude.h"

#include <cmath>

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::Vector4d;

Vector3d axial(const Matrix3d& M)
{
    return {M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1)};
}

/** The largest eigenvalue of horn_matrix(B), for B scaled so that it is 1 at most: Newton steps from above on
 * its characteristic polynomial, (l^2 - |B|^2)^2 - 8 l det B - 4 |adj B|^2. F. L. Markley, "Attitude
 * determination using vector observations: a fast optimal matrix algorithm", 1993.
 */
double largest_eigenvalue(const Matrix3d& B)
{
    const Vector3d c0 = B.col(1).cross(B.col(2)), c1 = B.col(2).cross(B.col(0)),
                   c2 = B.col(0).cross(B.col(1));
    const double F = B.squaredNorm(), det = B.col(0).dot(c0),
                 A = c0.squaredNorm() + c1.squaredNorm() + c2.squaredNorm();
    double l = 1;
    for (int k = 0; k < 10; k++)
    {
        const double v = l * l - F, slope = 4 * l * v - 8 * det;
        if (!(slope > 0)) break;
        const double step = (v * v - 8 * l * det - 4 * A) / slope;
        l -= step;
        if (!(std::abs(step) > 1e-5)) break;  // the error is of the order of its square now
    }
    return l;
}

constexpr int OTHERS[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};

/// A minor of a matrix without row r and column c.
inline double minor_of(const Matrix4d& M, int r, int c)
{
    const int* i = OTHERS[r];
    const int* j = OTHERS[c];
    return M(i[0], j[0]) * (M(i[1], j[1]) * M(i[2], j[2]) - M(i[1], j[2]) * M(i[2], j[1])) -
           M(i[0], j[1]) * (M(i[1], j[0]) * M(i[2], j[2]) - M(i[1], j[2]) * M(i[2], j[0])) +
           M(i[0], j[2]) * (M(i[1], j[0]) * M(i[2], j[1]) - M(i[1], j[1]) * M(i[2], j[0]));
}

/** The quaternion that solves (lambda I - K) q = 0 but for one row: for lambda above the largest eigenvalue,
 * that is the Gibbs vector of the report's system in the frame of that row. The four diagonal minors are the
 * determinants of the four frames' systems; the largest is taken (`determinant`).
 */
Vector4d frozen_eigenvector(const Matrix4d& K, double lambda, double& determinant)
{
    const Matrix4d M = lambda * Matrix4d::Identity() - K;
    const double d[4] = {minor_of(M, 0, 0), minor_of(M, 1, 1), minor_of(M, 2, 2), minor_of(M, 3, 3)};
    int k = 0;
    for (int i = 1; i < 4; i++)
        if (std::abs(d[i]) > std::abs(d[k])) k = i;
    determinant = d[k];
    switch (k)
    {
        case 0:
            return {d[0], -minor_of(M, 1, 0), minor_of(M, 2, 0), -minor_of(M, 3, 0)};
        case 1:
            return {-minor_of(M, 0, 1), d[1], -minor_of(M, 2, 1), minor_of(M, 3, 1)};
        case 2:
            return {minor_of(M, 0, 2), -minor_of(M, 1, 2), d[2], -minor_of(M, 3, 2)};
        default:
            return {-minor_of(M, 0, 3), minor_of(M, 1, 3), -minor_of(M, 2, 3), d[3]};
    }
}

/// The rotation matrix of a quaternion of any length.
Matrix3d rotation(const Vector4d& q)
{
    const double s = 2 / q.squaredNorm(), w = q(0), x = q(1), y = q(2), z = q(3);
    Matrix3d R;
    R << 1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),  //
        s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x),   //
        s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y);
    return R;
}

/// Newton steps on the rotation group, quadratic, from a rotation near the optimum; q of any length. \return
/// is it a clear maximum?
bool polish(const Matrix3d& B, Vector4d& q)
{
    for (int k = 0; k < 4; k++)
    {
        const Matrix3d M = B * rotation(q).transpose();
        const double trace = M.trace();
        const Matrix3d H = trace * Matrix3d::Identity() - 0.5 * (M + M.transpose());
        const Vector3d c0 = H.col(1).cross(H.col(2)), c1 = H.col(2).cross(H.col(0)),
                       c2 = H.col(0).cross(H.col(1));
        const double det = H.col(0).dot(c0), sum = 2 * trace;
        // Positive definite, and its least eigenvalue (above 4 det / trace^2) not small, nor what noise can
        // feign.
        const double least = 1e-3 * sum + 6 * std::max(0.0, 1 - trace);
        if (!(H(0, 0) > 0 && c2(2) > 0 && 4 * det > least * sum * sum)) return false;
        const Vector3d v = axial(M), half = Vector3d(c0.dot(v), c1.dot(v), c2.dot(v)) * (0.5 / det);
        const double w = q(0);
        const Vector3d u = q.tail<3>();
        q(0) -= half.dot(u), q.tail<3>() += w * half + half.cross(u);
        if (half.squaredNorm() < 2e-17) return true;
    }
    return false;
}

/** With lambda = 1 the determinant is large for two reasons: the eigenvalues are apart, or all of them are
 * far below 1 (noise, contradiction). The largest eigenvalue is 1 - e at least, e = 1 - q' K q / q' q for any
 * q; the other three terms of the determinant are then 4 e at most, so that the second eigenvalue is lower by
 * (determinant - 8 e) / 4 at least.
 */
bool is_clear(const Matrix4d& K, const Vector4d& q, double determinant)
{
    const double square = q.squaredNorm(), e = 1 - q.dot(K * q) / square;
    return square > 0 && determinant > 1e-2 + 8 * e;
}

Quaterniond quaternion(const Vector4d& q)
{
    return Quaterniond(q(0), q(1), q(2), q(3)).normalized();
}
}  // namespace

Matrix4d horn_matrix(const Matrix3d& B)
{
    Matrix4d K;
    const double trace = B.trace();
    K(0, 0) = trace;
    K.block<3, 1>(1, 0) = axial(B);  // sum w b x a
    K.block<1, 3>(0, 1) = K.block<3, 1>(1, 0).transpose();
    K.block<3, 3>(1, 1) = B + B.transpose() - trace * Matrix3d::Identity();
    return K;
}

double attitude_scale(const PointSums& vectors)
{
    return 0.5 * (vectors.aa.trace() + vectors.bb.trace());
}

Attitude fast_attitude(const PointSums& vectors, AttitudeMethod method)
{
    const double scale = attitude_scale(vectors);
    Attitude out;
    if (!(scale > 0)) return out;
    const Matrix3d B = vectors.B * (1 / scale);
    const bool iterate = method == AttitudeMethod::Horn || method == AttitudeMethod::OlaeNewton;
    double determinant = 0;
    const Matrix4d K = horn_matrix(B);
    Vector4d q = frozen_eigenvector(K, iterate ? largest_eigenvalue(B) : 1.0, determinant);
    if (iterate)
        out.sure = determinant > 1e-3 && polish(B, q);
    else
        out.sure = is_clear(K, q, determinant);
    out.q = quaternion(q);
    if (!out.sure || method != AttitudeMethod::OlaeLeastSquares) return out;
    const OlaeFrame frame(vectors, out.q);
    const Vector3d g = frame.solve(OlaeSystem::LeastSquares);
    out.q = frame.rotation(g), out.sure = g.allFinite();
    return out;
}

EigenAttitude eigen_attitude(const Matrix3d& B, double scale, const Matrix3d& guess)
{
    const Eigen::SelfAdjointEigenSolver<Matrix4d> eigen(horn_matrix(B));
    const Vector4d& values = eigen.eigenvalues();  // increasing
    const Quaterniond q0(guess);
    const Vector4d start(q0.w(), q0.x(), q0.y(), q0.z());
    // Relative spreads below 1e-5 are float rounding, and moments are their squares.
    const double equal = 1e-10 * scale;
    Vector4d q = Vector4d::Zero();
    int multiplicity = 0;
    for (int i = 3; i >= 0 && values(3) - values(i) <= equal; i--, multiplicity++)
        q += eigen.eigenvectors().col(i).dot(start) * eigen.eigenvectors().col(i);
    // Alone, or with a guess exactly opposite to all optima: any of them.
    if (multiplicity == 1 || q.norm() < 1e-9) q = eigen.eigenvectors().col(3);
    return {quaternion(q).toRotationMatrix(), multiplicity == 1, (values(3) - values(2)) / scale};
}

OlaeFrame::OlaeFrame(const PointSums& vectors, const Quaterniond& q) : axis_(1, 0, 0, 0), flip_(1, 1, 1)
{
    Vector4d c(std::abs(q.w()), std::abs(q.x()), std::abs(q.y()), std::abs(q.z()));
    int k = 0;
    c.maxCoeff(&k);
    if (k > 0)
    {
        const Vector3d axis = Vector3d::Unit(k - 1);
        axis_ = Quaterniond(0, axis.x(), axis.y(), axis.z());
        flip_ = 2 * axis - Vector3d::Ones();
    }
    sums_ = vectors;
    sums_.B = vectors.B * flip_.asDiagonal();
    sums_.bb = flip_.asDiagonal() * vectors.bb * flip_.asDiagonal();
}

Matrix3d OlaeFrame::matrix(OlaeSystem system) const
{
    const Matrix3d& B = sums_.B;
    const double sum = 2 * attitude_scale(sums_);
    if (system == OlaeSystem::LeastSquares)
        return (sum + 2 * B.trace()) * Matrix3d::Identity() - B - B.transpose() - sums_.aa - sums_.bb;
    return (0.5 * sum + B.trace()) * Matrix3d::Identity() - B - B.transpose();
}

Vector3d OlaeFrame::correction(OlaeSystem system, const Vector3d& rhs) const
{
    return matrix(system).ldlt().solve(rhs);
}

Vector3d OlaeFrame::solve(OlaeSystem system) const
{
    const Matrix3d M = matrix(system);
    const Vector3d c0 = M.col(1).cross(M.col(2)), c1 = M.col(2).cross(M.col(0)),
                   c2 = M.col(0).cross(M.col(1)),
                   z = (system == OlaeSystem::LeastSquares ? 2 : 1) * axial(sums_.B);
    return Vector3d(c0.dot(z), c1.dot(z), c2.dot(z)) / M.col(0).dot(c0);
}

Vector3d OlaeFrame::gibbs(const Quaterniond& q) const
{
    const Quaterniond here = q * axis_.conjugate();
    return here.vec() / here.w();
}

Quaterniond OlaeFrame::rotation(const Vector3d& g) const
{
    return (Quaterniond(1, g.x(), g.y(), g.z()) * axis_).normalized();
}

}  // namespace mp2p_icp
