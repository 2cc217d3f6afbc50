#include "refine_with_prior.h"

#include <mp2p_icp/se3.h>
#include <mrpt/math/wrap2pi.h>

#include "euler_rates.h"

namespace mp2p_icp
{
namespace
{
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using mrpt::poses::CPose3D;

struct Problem
{
    const PointMoments& points;
    CPose3D mean;
    Matrix6 Lambda;

    Vector6 prior_error(const CPose3D& p) const
    {
        Vector6 e;
        e << translation_of(p) - translation_of(mean), mrpt::math::wrapToPi(p.yaw() - mean.yaw()),
            mrpt::math::wrapToPi(p.pitch() - mean.pitch()), mrpt::math::wrapToPi(p.roll() - mean.roll());
        return e;
    }

    double cost(const CPose3D& p) const
    {
        const Eigen::Matrix3d R = rotation_of(p);
        const double offset_sq = (R * points.b_mean + translation_of(p) - points.a_mean).squaredNorm();
        const Vector6 e = prior_error(p);
        return points.weight * offset_sq + points.aa + points.bb.trace() -
               2 * (R.transpose() * points.B).trace() + e.dot(Lambda * e);
    }

    /// H and g of half the cost in the twist (v: of the local points' mean, omega), both along global axes.
    void normal_equations(const CPose3D& p, Matrix6& H, Vector6& g) const
    {
        const Eigen::Matrix3d R = rotation_of(p), C = R * points.bb * R.transpose(),
                              B = points.B * R.transpose();
        const Eigen::Vector3d lever = R * points.b_mean;
        H.setZero();
        H.topLeftCorner<3, 3>() = points.weight * Eigen::Matrix3d::Identity();
        H.bottomRightCorner<3, 3>() = C.trace() * Eigen::Matrix3d::Identity() - C;
        g << points.weight * (lever + translation_of(p) - points.a_mean),
            -Eigen::Vector3d(B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1));
        Matrix6 J =
            Matrix6::Identity();  // d coordinates / d twist: t = mean - R b_mean, angles' rates = E^-1 omega
        J.topRightCorner<3, 3>() = skew(lever);
        J.bottomRightCorner<3, 3>() = euler_rates(p).completeOrthogonalDecomposition().pseudoInverse();
        H += J.transpose() * Lambda * J;
        g += J.transpose() * Lambda * prior_error(p);
    }

    CPose3D moved(const CPose3D& p, const Vector6& twist) const
    {
        const Eigen::Vector3d omega = twist.tail<3>();
        const double angle = omega.norm();
        Eigen::Matrix3d dR = Eigen::Matrix3d::Identity();
        if (angle > 0) dR = Eigen::AngleAxisd(angle, omega / angle).toRotationMatrix();
        const Eigen::Matrix3d R = rotation_of(p);
        const Eigen::Vector3d mean_of_local = R * points.b_mean + translation_of(p) + twist.head<3>();
        return make_pose(dR * R, mean_of_local - dR * R * points.b_mean);
    }
};
}  // namespace

CPose3D refine_with_prior(const PointMoments& points, const mrpt::poses::CPose3DPDFGaussianInf& prior,
                          const CPose3D& start)
{
    Problem problem{points, prior.mean, {}};
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) problem.Lambda(r, c) = prior.cov_inv(r, c);
    CPose3D pose = start;
    double cost = problem.cost(pose), damping = 0;
    for (int iteration = 0; iteration < 50; iteration++)
    {
        Matrix6 H;
        Vector6 g;
        problem.normal_equations(pose, H, g);
        Matrix6 damped = H;
        damped.diagonal() *= 1.0 + damping;
        const Vector6 step = -damped.completeOrthogonalDecomposition().solve(g);
        const CPose3D next = problem.moved(pose, step);
        const double next_cost = problem.cost(next);
        if (!(next_cost <= cost))
        {
            if (damping > 1e6 || step.norm() < 1e-12) break;
            damping = damping > 0 ? damping * 10 : 1e-3;
            continue;
        }
        pose = next, cost = next_cost, damping *= 0.1;
        if (step.norm() < 1e-12) break;
    }
    return pose;
}

}  // namespace mp2p_icp
