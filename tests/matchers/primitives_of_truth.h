#pragma once

#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>

namespace mp2p_icp_test
{
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

inline Eigen::Vector3d any_direction(mp2p_icp::SeededRandom& random)
{
    const double x = random.gaussian(), y = random.gaussian();
    return Eigen::Vector3d(x, y, random.gaussian()).normalized();
}

/// With these deviations along axes that are not those of the primitive, scaled differently.
template <int N>
Eigen::Matrix<double, N, N> any_covariance(const Eigen::Matrix<double, N, 1>& deviations,
                                           mp2p_icp::SeededRandom& random)
{
    Eigen::Matrix<double, N, N> mix = Eigen::Matrix<double, N, N>::Identity();
    for (int i = 0; i < N; i++)
        for (int j = 0; j < i; j++) mix(i, j) = random.uniform(-0.5, 0.5);
    const Eigen::Matrix<double, N, N> root = deviations.asDiagonal() * mix;
    return root * root.transpose();
}

inline mp2p_icp::fitted_plane_t plane_at(const Eigen::Vector3d& centroid, const Eigen::Vector3d& normal)
{
    mp2p_icp::fitted_plane_t p;
    p.plane.coefs = {normal.x(), normal.y(), normal.z(), -normal.dot(centroid)};
    p.centroid = mp2p_icp::to_mrpt(centroid);
    return p;
}
/// A box of 2 x 2 m.
inline mp2p_icp::fitted_plane_t plane_with_fit(const Eigen::Vector3d& centroid, const Eigen::Vector3d& normal)
{
    auto p = plane_at(centroid, normal);
    auto& fit = p.fit.emplace();
    fit.axis_u = normal.unitOrthogonal();
    fit.u_min = fit.v_min = -1, fit.u_max = fit.v_max = 1;
    fit.inliers = 100, fit.sigma = 0.01;
    fit.covariance = Eigen::Vector3d(1e-6, 1e-6, 1e-6).asDiagonal();
    return p;
}
inline mp2p_icp::fitted_line_t line_at(const Eigen::Vector3d& base, const Eigen::Vector3d& direction)
{
    mp2p_icp::fitted_line_t l;
    l.pBase = mp2p_icp::to_mrpt(base), l.director = mp2p_icp::to_mrpt(direction);
    return l;
}
/// Seen from 1 m before the base point to 1 m behind it.
inline mp2p_icp::fitted_line_t line_with_fit(const Eigen::Vector3d& base, const Eigen::Vector3d& direction)
{
    auto l = line_at(base, direction);
    auto& fit = l.fit.emplace();
    fit.axis_a = direction.unitOrthogonal();
    fit.begin = -1, fit.end = 1;
    fit.inliers = 100, fit.sigma = 0.01;
    fit.covariance = Eigen::Vector4d(1e-6, 1e-6, 1e-6, 1e-6).asDiagonal();
    return l;
}

// What follows tells errors e of plane_fit_t::covariance and line_fit_t::covariance.

inline mp2p_icp::fitted_plane_t displaced(const mp2p_icp::fitted_plane_t& p, const Eigen::Vector3d& e)
{
    const Eigen::Vector3d n = p.normal(), u = p.fit->axis_u;
    const Eigen::Vector3d normal = (n - e(0) * u - e(1) * n.cross(u)).normalized();
    auto out = plane_at(mp2p_icp::to_eigen(p.centroid) + e(2) * n, normal);
    out.fit = p.fit;
    out.fit->axis_u = (u - normal * normal.dot(u)).normalized();
    return out;
}
inline mp2p_icp::fitted_line_t displaced(const mp2p_icp::fitted_line_t& l, const Eigen::Vector4d& e)
{
    const Eigen::Vector3d d = mp2p_icp::to_eigen(l.director), a = l.fit->axis_a, b = d.cross(a);
    const Eigen::Vector3d director = (d + e(2) * a + e(3) * b).normalized();
    auto out = line_at(mp2p_icp::to_eigen(l.pBase) + e(0) * a + e(1) * b, director);
    out.fit = l.fit;
    out.fit->axis_a = (a - director * director.dot(a)).normalized();
    return out;
}

/// The errors of `other`, seen as another fit of what `of` describes.
inline Eigen::Vector3d error_between(const mp2p_icp::fitted_plane_t& of,
                                     const mp2p_icp::fitted_plane_t& other)
{
    const Eigen::Vector3d N = of.normal(), u = of.fit->axis_u, v = N.cross(u), n = other.normal();
    const double height = n.dot(mp2p_icp::to_eigen(other.centroid) - mp2p_icp::to_eigen(of.centroid));
    return Eigen::Vector3d(-n.dot(u), -n.dot(v), height) / n.dot(N);
}
inline Eigen::Vector4d error_between(const mp2p_icp::fitted_line_t& of, const mp2p_icp::fitted_line_t& other)
{
    const Eigen::Vector3d D = mp2p_icp::to_eigen(of.director), a = of.fit->axis_a, b = D.cross(a);
    const Eigen::Vector3d d = mp2p_icp::to_eigen(other.director) / mp2p_icp::to_eigen(other.director).dot(D);
    const Eigen::Vector3d between = mp2p_icp::to_eigen(other.pBase) - mp2p_icp::to_eigen(of.pBase);
    const Eigen::Vector3d at_base = between - d * D.dot(between);
    return {at_base.dot(a), at_base.dot(b), d.dot(a), d.dot(b)};
}

template <int N>
Eigen::Matrix<double, N, 1> drawn(const Eigen::Matrix<double, N, N>& covariance,
                                  mp2p_icp::SeededRandom& random)
{
    Eigen::Matrix<double, N, 1> e;
    for (int i = 0; i < N; i++) e(i) = random.gaussian();
    const Eigen::Matrix<double, N, N> root = covariance.llt().matrixL();
    return root * e;
}

/// The pose, moved by a twist: translation, then a rotation vector on the left of the rotation.
inline mrpt::poses::CPose3D moved(const mrpt::poses::CPose3D& pose, const Vector6d& by)
{
    const Eigen::Vector3d w = by.tail<3>();
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    if (w.norm() > 0) turn = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
    return mp2p_icp::make_pose(turn * mp2p_icp::rotation_of(pose),
                               mp2p_icp::translation_of(pose) + by.head<3>());
}
/// Inverse of moved(): what moves `from` to `to`.
inline Vector6d twist_between(const mrpt::poses::CPose3D& from, const mrpt::poses::CPose3D& to)
{
    const Eigen::AngleAxisd turn(mp2p_icp::rotation_of(to) * mp2p_icp::rotation_of(from).transpose());
    Vector6d out;
    out << mp2p_icp::translation_of(to) - mp2p_icp::translation_of(from), turn.angle() * turn.axis();
    return out;
}

/** The Fisher information on the pose (as in moved()) of one pair of primitives with fits, by differences:
 * J' S^-1 J, J being the derivative of their difference by the pose, S the sum of both covariances.
 */
template <class Primitive>
Matrix6d information_of(const Primitive& global, const Primitive& local, const mrpt::poses::CPose3D& pose)
{
    constexpr int N = decltype(global.fit->covariance)::RowsAtCompileTime;
    using VectorN = Eigen::Matrix<double, N, 1>;
    constexpr double STEP = 1e-6;
    Eigen::Matrix<double, N, 6> J;
    for (int k = 0; k < 6; k++)
    {
        const Vector6d step = STEP * Vector6d::Unit(k);
        J.col(k) = (error_between(global, compose(moved(pose, step), local)) -
                    error_between(global, compose(moved(pose, -step), local))) /
                   (2 * STEP);
    }
    Eigen::Matrix<double, N, N> to_global;
    for (int k = 0; k < N; k++)
    {
        const VectorN step = STEP * VectorN::Unit(k);
        to_global.col(k) = (error_between(global, compose(pose, displaced(local, step))) -
                            error_between(global, compose(pose, displaced(local, VectorN(-step))))) /
                           (2 * STEP);
    }
    const Eigen::Matrix<double, N, N> S =
        global.fit->covariance + to_global * local.fit->covariance * to_global.transpose();
    return J.transpose() * S.inverse() * J;
}

/// Sums of squared errors of poses, and what the Cramer-Rao bound says of them.
struct EfficiencyTest
{
    double translation_sq = 0, rotation_sq = 0, translation_bound = 0, rotation_bound = 0, chi2 = 0;
    size_t runs = 0;

    void add(const Vector6d& error, const Matrix6d& information)
    {
        const Matrix6d bound = information.inverse();
        translation_sq += error.head<3>().squaredNorm(), rotation_sq += error.tail<3>().squaredNorm();
        translation_bound += bound.topLeftCorner<3, 3>().trace();
        rotation_bound += bound.bottomRightCorner<3, 3>().trace();
        chi2 += error.dot(information * error) / 6;
        runs++;
    }
    double translation_ratio() const { return std::sqrt(translation_sq / translation_bound); }
    double rotation_ratio() const { return std::sqrt(rotation_sq / rotation_bound); }
    void print(const char* name) const
    {
        std::printf("%-28s %zu runs: rms error over bound %.3f (translation) %.3f (rotation), chi2/6 %.3f\n",
                    name, runs, translation_ratio(), rotation_ratio(), chi2 / static_cast<double>(runs));
    }
};
}  // namespace mp2p_icp_test
