#include "pose_quadratic.h"

#include <mp2p_icp/errors.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "euler_rates.h"
#include "pose_prior.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Of a sum, relative to that of the terms' sizes: some roundings.
constexpr double SUM_ROUNDING = 1e-15;

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

bool PoseQuadratic::is_finite() const
{
    return K.allFinite() && k.allFinite() && a_centre.allFinite() && b_centre.allFinite() &&
           points_centre.allFinite() &&
           std::isfinite(qq + position_weight + points_weight + radius + rounding);
}

double PoseQuadratic::cost(const OriginPose& pose) const
{
    Vector12 X;
    X << pose.R.col(0), pose.R.col(1), pose.R.col(2), pose.c;
    return std::max(0.0, X.dot(K * X) - 2 * k.dot(X) + qq);
}

double PoseQuadratic::cost(const mrpt::poses::CPose3D& pose) const
{
    return cost(relative(pose));
}

OriginPose PoseQuadratic::relative(const mrpt::poses::CPose3D& pose) const
{
    return relative_to(a_centre, b_centre, pose);
}

mrpt::poses::CPose3D PoseQuadratic::absolute(const OriginPose& pose) const
{
    return mp2p_icp::absolute(a_centre, b_centre, pose);
}

Matrix6 PoseQuadratic::information(const Matrix3d& R) const
{
    Eigen::Matrix<double, 12, 6> J = Eigen::Matrix<double, 12, 6>::Zero();
    for (int j = 0; j < 3; j++) J.block<3, 3>(3 * j, 3) = -skew(R.col(j)) / L();
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
        c += u * (value > RESOLVED_INFORMATION * eigen.eigenvalues()(2) ? u.dot(rhs) / value : u.dot(kept));
    }
    return c;
}

/// z -> T z, T = (I, -b; 0, 1), and q -> q - a.
void PoseQuadratic::move_origins(const Vector3d& a, const Vector3d& b)
{
    const Matrix3d Ktt = K.bottomRightCorner<3, 3>();
    const Vector3d Ka = Ktt * a;
    qq += -2 * a.dot(k.tail<3>()) + a.dot(Ka);
    k -= K.rightCols<3>() * a;
    const auto subtract = [&b](auto&& blocks)
    {
        for (int j = 0; j < 3; j++) blocks.middleRows(3 * j, 3) -= b(j) * blocks.bottomRows(3);
    };
    subtract(K), subtract(K.transpose()), subtract(k);
    a_centre += a, b_centre += b;
    rounding += SUM_ROUNDING * Ktt.trace() * (a.squaredNorm() + b.squaredNorm());
}

void PoseQuadratic::add_radius(const PoseQuadratic& o)
{
    const double sum = points_weight + o.points_weight;
    if (!(sum > 0)) return;
    const double share = o.points_weight / sum;
    const Vector3d between = o.points_centre - points_centre;
    radius = std::sqrt((1 - share) * radius * radius + share * o.radius * o.radius +
                       share * (1 - share) * between.squaredNorm());
    points_centre += share * between, points_weight = sum;
}

PoseQuadratic& PoseQuadratic::operator+=(const PoseQuadratic& o)
{
    const double sum = position_weight + o.position_weight;
    PoseQuadratic other = o;
    if (sum > 0)
    {
        // The centroid of both; where one set has no position, its origins mean nothing.
        const double share = o.position_weight / sum;
        const Vector3d a = share * (o.a_centre - a_centre), b = share * (o.b_centre - b_centre);
        move_origins(a, b);
        other.move_origins(a_centre - o.a_centre, b_centre - o.b_centre);
    }
    add_radius(o);
    K += other.K, k += other.k, qq += other.qq, rounding += other.rounding;
    position_weight = sum, rows += o.rows, skipped += o.skipped;
    return *this;
}

namespace
{
constexpr uint8_t VERSION = 0;

/// Calls f(number) for all doubles.
template <class Quadratic, class F>
void for_each_number(Quadratic& q, const F& f)
{
    const auto all = [&f](auto& matrix)
    {
        for (Eigen::Index i = 0; i < matrix.size(); i++) f(matrix.data()[i]);
    };
    all(q.K), all(q.k), f(q.qq), all(q.a_centre), all(q.b_centre), f(q.position_weight), f(q.points_weight),
        all(q.points_centre), f(q.radius), f(q.rounding);
}
}  // namespace

void PoseQuadratic::serializeTo(mrpt::serialization::CArchive& out) const
{
    out.WriteAs<uint8_t>(VERSION);
    for_each_number(*this, [&out](double number) { out << number; });
    out.WriteAs<uint64_t>(rows);
    out.WriteAs<uint64_t>(skipped);
}

void PoseQuadratic::serializeFrom(mrpt::serialization::CArchive& in)
{
    const auto version = in.ReadAs<uint8_t>();
    if (version != VERSION)
        throw DataError("sums of pairings", "", "version " + std::to_string(VERSION),
                        "version " + std::to_string(version));
    PoseQuadratic read;
    bool finite = true;
    try
    {
        for_each_number(read,
                        [&](double& number)
                        {
                            in >> number;
                            finite = finite && std::isfinite(number);
                        });
        read.rows = static_cast<size_t>(in.ReadAs<uint64_t>());
        uint64_t last = 0;  // MRPT does not fail on a read that begins before the end of the data
        if (in.ReadBufferFixEndianness(&last, 1) != sizeof(last))
            throw std::runtime_error("the data ends too early");
        read.skipped = static_cast<size_t>(last);
    }
    catch (const std::exception& e)
    {
        throw DataError("sums of pairings", short_reason(e));
    }
    if (!finite) throw DataError("sums of pairings", "", "finite numbers", "one that is not");
    *this = read;
}

mrpt::serialization::CArchive& operator<<(mrpt::serialization::CArchive& out, const PoseQuadratic& obj)
{
    obj.serializeTo(out);
    return out;
}
mrpt::serialization::CArchive& operator>>(mrpt::serialization::CArchive& in, PoseQuadratic& obj)
{
    obj.serializeFrom(in);
    return in;
}

namespace
{
/// Of positions relative to the origins, as they were added up; `rows` holds those of all but the points.
double summed_squares(const PairingSums& sums, const PoseQuadratic& rows)
{
    const PointSums& p = sums.points;
    return p.aa.trace() + p.bb.trace() + p.w * (sums.a_mean.squaredNorm() + sums.b_mean.squaredNorm()) +
           rows.K.topLeftCorner<9, 9>().trace() + rows.qq;
}
}  // namespace

PoseQuadratic pose_quadratic(const PairingSums& sums, const PreparedPairings& of)
{
    PoseQuadratic out;
    out.radius = sums.radius, out.rows = of.rows(), out.skipped = of.skipped();
    out.a_centre = sums.a_origin, out.b_centre = sums.b_origin;
    double w = sums.points.w;
    Vector3d b = w * sums.b_mean;
    if (const auto& o = sums.others; o)
    {
        add_rows(o->point_rows, out), add_rows(o->base_rows, out);
        w += o->point_rows.w, b += o->point_rows.b;
    }
    out.points_weight = w, out.points_centre = sums.b_origin + (w > 0 ? Vector3d(b / w) : Vector3d::Zero());
    if (const auto& o = sums.others; o) w += o->base_rows.w, b += o->base_rows.b;
    out.rounding = SUM_ROUNDING * summed_squares(sums, out);
    out.move_origins(sums.a_mean, sums.b_mean);  // to where those of the points are
    if (const auto& o = sums.others; o)
    {
        add_directions(o->lines, of.direction_weight(PairingKind::Line2Line, sums.L()), out);
        add_directions(o->planes, of.direction_weight(PairingKind::Plane2Plane, sums.L()), out);
    }
    add_points(sums.points, out);
    out.K.bottomRightCorner<3, 3>().diagonal().array() += sums.points.w;
    // Where the global origin lies does not matter as long as it is near.
    const Vector3d b_mean = w > 0 ? Vector3d(b / w) : Vector3d::Zero();
    out.move_origins(Vector3d::Zero(), b_mean - sums.b_mean);
    out.b_centre = sums.b_origin + b_mean;  // the sum of both moves, but for rounding
    out.position_weight = w;
    return out;
}

PoseQuadratic pose_quadratic(const Pairings& pairings, const PairWeights& weights)
{
    PreparedPairings in(pairings, weights);
    return pose_quadratic(pairing_sums(in), in);
}

namespace
{
/// Rows C (Srow vec R + c), Srow giving axis sin(angle) of R R0'.
void add_prior_position(const Matrix3d& R0, const Matrix3d& A, const Matrix3d& Ltt, PoseQuadratic& out)
{
    Eigen::Matrix<double, 3, 12> J;
    for (int j = 0; j < 3; j++) J.middleCols<3>(3 * j) = 0.5 * A * skew(R0.col(j));
    J.rightCols<3>().setIdentity();
    out.K += J.transpose() * Ltt * J;
}

/// G with M G M = M, without what is only rounding. Coordinates that are known well do not drown the others.
Matrix3d generalised_inverse(const Matrix3d& M)
{
    Vector3d scale = Vector3d::Zero();
    for (int i = 0; i < 3; i++)
        if (M(i, i) > 0) scale(i) = 1 / std::sqrt(M(i, i));
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scale.asDiagonal() * M * scale.asDiagonal());
    Matrix3d out = Matrix3d::Zero();
    for (int i = 0; i < 3; i++)
        if (const double value = eigen.eigenvalues()(i); value > 1e-13 * eigen.eigenvalues()(2))
            out += eigen.eigenvectors().col(i) * eigen.eigenvectors().col(i).transpose() / value;
    return scale.asDiagonal() * out * scale.asDiagonal();
}

/// 4 v' S v, as oriented directions: |R u - R0 u|^2 is that of S = I - R0 u (R0 u)'.
void add_prior_rotation(const Matrix3d& R0, const Matrix3d& S, PoseQuadratic& out)
{
    const Matrix3d M = 0.5 * S.trace() * Matrix3d::Identity() - S;
    PointSums directions;
    directions.bb = R0.transpose() * M * R0, directions.B = M * R0, directions.aa = M;
    add_points(directions, out);
}
}  // namespace

PoseQuadratic pose_quadratic(const mrpt::poses::CPose3DPDFGaussianInf& prior)
{
    const Matrix6 information = twist_information(prior);
    const Vector6 eigenvalues = unitless_eigenvalues(information);
    const Matrix3d Ltt = information.topLeftCorner<3, 3>(), Ltw = information.topRightCorner<3, 3>(),
                   A = generalised_inverse(Ltt) * Ltw;
    PoseQuadratic out;
    out.a_centre = translation_of(prior.mean);
    add_prior_position(rotation_of(prior.mean), A, Ltt, out);
    add_prior_rotation(rotation_of(prior.mean), information.bottomRightCorner<3, 3>() - Ltw.transpose() * A,
                       out);
    out.position_weight = Ltt.trace() / 3;
    out.rows = static_cast<size_t>((eigenvalues.array() > 1e-12 * eigenvalues(5)).count());
    return out;
}

}  // namespace mp2p_icp
