#include "pose_quadratic.h"

#include <mp2p_icp/se3.h>

#include "euler_rates.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Second moments only.
void add_points(const PointSums& s, PoseQuadratic& out)
{
    for (int j = 0; j < 3; j++)
    {
        for (int l = 0; l < 3; l++) out.K.block<3, 3>(3 * j, 3 * l).diagonal().array() += s.bb(j, l);
        out.k.segment<3>(3 * j) += s.B.col(j);
    }
    out.qq += s.aa.trace();
}

void add_rows(const RowSums& s, PoseQuadratic& out)
{
    for (int j = 0, column = 0; j < 4; j++)
        for (int l = 0; l <= j; l++, column++)
        {
            const Matrix3d block = unpacked(s.zzC.col(column));
            out.K.block<3, 3>(3 * j, 3 * l) += block;
            if (l < j) out.K.block<3, 3>(3 * l, 3 * j) += block;
        }
    for (int j = 0; j < 4; j++) out.k.segment<3>(3 * j) += s.zCq.col(j);
    out.qq += s.qq;
}

void add_directions(const DirectionSums& s, double weight, PoseQuadratic& out)
{
    PointSums oriented = s.oriented;
    oriented *= weight;
    add_points(oriented, out);
    static constexpr int column[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (int j = 0; j < 3; j++)
        for (int l = 0; l < 3; l++)
            out.K.block<3, 3>(3 * j, 3 * l) += weight * unpacked(s.free.col(column[j][l]));
}

/// To new origins, at these places relative to the old ones. z -> T z, T = (I, -b; 0, 1), and q -> q - a.
void move_origins(const Vector3d& a, const Vector3d& b, PoseQuadratic& q)
{
    const Vector3d Ka = q.K.bottomRightCorner<3, 3>() * a;
    q.qq += -2 * a.dot(q.k.tail<3>()) + a.dot(Ka);
    q.k -= q.K.rightCols<3>() * a;
    const auto subtract = [&b](auto&& blocks)
    {
        for (int j = 0; j < 3; j++) blocks.middleRows(3 * j, 3) -= b(j) * blocks.bottomRows(3);
    };
    subtract(q.K), subtract(q.K.transpose()), subtract(q.k);
}
}  // namespace

OriginPose relative_to(const Vector3d& a_origin, const Vector3d& b_origin, const mrpt::poses::CPose3D& pose)
{
    const Matrix3d R = rotation_of(pose);
    return {R, R * b_origin + (translation_of(pose) - a_origin)};
}

mrpt::poses::CPose3D absolute(const Vector3d& a_origin, const Vector3d& b_origin, const OriginPose& pose)
{
    return make_pose(pose.R, pose.c + (a_origin - pose.R * b_origin));
}

double PoseQuadratic::cost(const OriginPose& pose) const
{
    Vector12 X;
    X << pose.R.col(0), pose.R.col(1), pose.R.col(2), pose.c;
    return X.dot(K * X) - 2 * k.dot(X) + qq;
}

Matrix6 PoseQuadratic::information(const Matrix3d& R) const
{
    Eigen::Matrix<double, 12, 6> J = Eigen::Matrix<double, 12, 6>::Zero();
    for (int j = 0; j < 3; j++) J.block<3, 3>(3 * j, 3) = -skew(R.col(j)) / L;
    J.bottomLeftCorner<3, 3>().setIdentity();
    return J.transpose() * K * J;
}

Vector3d PoseQuadratic::best_translation(const Matrix3d& R, const Vector3d& kept) const
{
    Vector3d rhs = k.tail<3>();
    for (int j = 0; j < 3; j++) rhs -= K.block<3, 3>(9, 3 * j) * R.col(j);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(K.bottomRightCorner<3, 3>());
    Vector3d c = Vector3d::Zero();
    for (int i = 0; i < 3; i++)
    {
        const Vector3d u = eigen.eigenvectors().col(i);
        const double value = eigen.eigenvalues()(i);
        c += u * (value > 1e-10 * eigen.eigenvalues()(2) ? u.dot(rhs) / value : u.dot(kept));
    }
    return c;
}

PoseQuadratic pose_quadratic(const PairingSums& sums, const PreparedPairings& of)
{
    PoseQuadratic out;
    out.L = sums.L;
    double w = sums.points.w;
    Vector3d b = w * sums.b_mean;
    if (const auto& o = sums.others; o)
    {
        add_rows(o->point_rows, out), add_rows(o->base_rows, out);
        w += o->point_rows.w + o->base_rows.w, b += o->point_rows.b + o->base_rows.b;
        move_origins(sums.a_mean, sums.b_mean, out);
        add_directions(o->lines, of.direction_weight(PairingKind::Line2Line, sums.L), out);
        add_directions(o->planes, of.direction_weight(PairingKind::Plane2Plane, sums.L), out);
    }
    add_points(sums.points, out);
    out.K.bottomRightCorner<3, 3>().diagonal().array() += sums.points.w;
    // Where the global origin lies does not matter as long as it is near.
    const Vector3d b_mean = w > 0 ? Vector3d(b / w) : Vector3d::Zero();
    move_origins(Vector3d::Zero(), b_mean - sums.b_mean, out);
    out.a_centre = sums.a_origin + sums.a_mean, out.b_centre = sums.b_origin + b_mean;
    return out;
}

}  // namespace mp2p_icp
