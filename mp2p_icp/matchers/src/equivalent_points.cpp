#include "equivalent_points.h"

#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace
{
template <class Matrix>
Matrix information(Matrix covariance)
{
    covariance.diagonal().array() += ROUNDING_VARIANCE;
    return covariance.inverse();
}
}  // namespace

void WeightedPointPlanes::append_to(Pairings& out, const mrpt::poses::CPose3D& pose) const
{
    for (auto pair : pairs)
    {
        pair.pt_local = pose.inverseComposePoint(pair.pt_local);
        out.paired_pt2pl.push_back(pair);
    }
    out.pt2pl_weights.insert(out.pt2pl_weights.end(), weights.begin(), weights.end());
}

WeightedPointPlanes equivalent_points(const fitted_plane_t& global, const fitted_plane_t& local,
                                      double unit_variance)
{
    const Vector3d n_g = global.normal(), n_l = local.normal(), u_g = global.fit->axis_u,
                   u_l = local.fit->axis_u, v_g = n_g.cross(u_g), v_l = n_l.cross(u_l);
    const Vector3d c_g = to_eigen(global.centroid), c_l = to_eigen(local.centroid), between = c_g - c_l;
    Matrix3d to_global;  // the local plane's (a, b, h) as the global one's frame sees them
    to_global << u_l.dot(u_g), v_l.dot(u_g), 0, u_l.dot(v_g), v_l.dot(v_g), 0, u_l.dot(between),
        v_l.dot(between), 1;
    const Matrix3d W = information<Matrix3d>(global.fit->covariance +
                                             to_global * local.fit->covariance * to_global.transpose());

    // A point at (u, v) of weight w gives the information w (u, v, 1)(u, v, 1)': so points with the moments
    // of W.
    const double total = W(2, 2);
    const Vector2d mean = W.block<2, 1>(0, 2) / total;
    const Matrix2d spread = W.topLeftCorner<2, 2>() / total - mean * mean.transpose();
    const Eigen::SelfAdjointEigenSolver<Matrix2d> eigen(spread);
    WeightedPointPlanes out;
    for (int i = 0; i < 4; i++)
    {
        const double along = std::sqrt(2 * std::max(0.0, eigen.eigenvalues()(i / 2))) * (i % 2 ? 1 : -1);
        const Vector2d uv = mean + along * eigen.eigenvectors().col(i / 2);
        const Vector3d on_global = c_g + uv.x() * u_g + uv.y() * v_g;
        const Vector3d on_local = on_global - n_l * (n_l.dot(on_global - c_l) / n_l.squaredNorm());
        out.pairs.push_back({global, to_mrpt(on_local)});
    }
    out.weights.emplace_back(4, unit_variance * total / 4);
    return out;
}

namespace
{
/// A line with its axes; s = 0 at the base.
struct LineFrame
{
    explicit LineFrame(const fitted_line_t& line)
        : base(to_eigen(line.pBase)),
          d(line.director[0], line.director[1], line.director[2]),
          a(line.fit->axis_a),
          b(d.cross(a))
    {
    }
    Vector3d base, d, a, b;
};

/// The local line's errors (x, y, p, q), as the global one's frame sees them.
Matrix4d line_errors_to_global(const LineFrame& global, const LineFrame& local)
{
    const double sign = global.d.dot(local.d) < 0 ? -1 : 1,
                 s_of_base = global.d.dot(local.base - global.base);
    Matrix2d turn;
    turn << global.a.dot(local.a), global.a.dot(local.b), global.b.dot(local.a), global.b.dot(local.b);
    Matrix4d out = Matrix4d::Zero();
    out.topLeftCorner<2, 2>() = turn;
    out.topRightCorner<2, 2>() = -sign * s_of_base * turn;
    out.bottomRightCorner<2, 2>() = sign * turn;
    return out;
}

/// Information on the line's height above its place along one direction across it: as of two points at
/// s = mean -+ spread, that weigh the squared length of `across` together.
struct SideInformation
{
    Vector2d across;
    double mean, spread;
};

/** Finds two directions n with W = sum over them of (n n') kron (1, mean; mean, mean^2 + spread^2): those
 * that make its blocks of displacement and turn diagonal at once.
 */
std::array<SideInformation, 2> two_sides(const Matrix4d& W)
{
    const Matrix2d A = W.topLeftCorner<2, 2>(), B = W.topRightCorner<2, 2>(), D = W.bottomRightCorner<2, 2>();
    const Matrix2d L = A.llt().matrixL(), L_inverse = L.inverse();
    const Matrix2d relative = L_inverse * D * L_inverse.transpose();
    const Eigen::SelfAdjointEigenSolver<Matrix2d> eigen((relative + relative.transpose()) / 2);
    const Matrix2d Q = eigen.eigenvectors(), n = L * Q;
    const Matrix2d cross = Q.transpose() * L_inverse * B * L_inverse.transpose() * Q;
    std::array<SideInformation, 2> out;
    for (int k = 0; k < 2; k++)
    {
        const double mean = cross(k, k), spread_sq = eigen.eigenvalues()(k) - mean * mean;
        out[static_cast<size_t>(k)] = {n.col(k), mean, std::sqrt(std::max(0.0, spread_sq))};
    }
    return out;
}

plane_patch_t plane_with(const Vector3d& point, const Vector3d& normal)
{
    plane_patch_t out;
    out.centroid = to_mrpt(point);
    out.plane.coefs = {normal.x(), normal.y(), normal.z(), -normal.dot(point)};
    return out;
}
}  // namespace

WeightedPointPlanes equivalent_points(const fitted_line_t& global, const fitted_line_t& local,
                                      double unit_variance)
{
    const LineFrame g(global), l(local);
    const Matrix4d to_global = line_errors_to_global(g, l);
    const Matrix4d W = information<Matrix4d>(global.fit->covariance +
                                             to_global * local.fit->covariance * to_global.transpose());
    const double along_local = 1 / g.d.dot(l.d);
    WeightedPointPlanes out;
    for (const SideInformation& side : two_sides(W))
    {
        const Vector3d normal = (side.across.x() * g.a + side.across.y() * g.b).normalized();
        for (const double s : {side.mean - side.spread, side.mean + side.spread})
        {
            const Vector3d on_local = l.base + l.d * (along_local * (s - g.d.dot(l.base - g.base)));
            out.pairs.push_back({plane_with(g.base, normal), to_mrpt(on_local)});
        }
        out.weights.emplace_back(2, unit_variance * side.across.squaredNorm() / 2);
    }
    return out;
}

}  // namespace mp2p_icp
