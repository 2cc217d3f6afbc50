#include "refine_with_prior.h"

#include <mp2p_icp/se3.h>

#include "pose_prior.h"
#include "rotation_vector.h"

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
    PosePrior prior;

    double cost(const CPose3D& p) const
    {
        const Eigen::Matrix3d R = rotation_of(p);
        const double offset_sq = (R * points.b_mean + translation_of(p) - points.a_mean).squaredNorm();
        return points.weight * offset_sq + points.aa + points.bb.trace() -
               2 * (R.transpose() * points.B).trace() + prior.cost(p);
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
        const Matrix6 J = PosePrior::jacobian(p, points.b_mean);
        H += J.transpose() * prior.information() * J;
        g += J.transpose() * prior.information() * prior.error(p);
    }

    CPose3D moved(const CPose3D& p, const Vector6& twist) const
    {
        const Eigen::Matrix3d dR = rotation_by(twist.tail<3>());
        const Eigen::Matrix3d R = rotation_of(p);
        const Eigen::Vector3d mean_of_local = R * points.b_mean + translation_of(p) + twist.head<3>();
        return make_pose(dR * R, mean_of_local - dR * R * points.b_mean);
    }
};
}  // namespace

CPose3D refine_with_prior(const PointMoments& points, const mrpt::poses::CPose3DPDFGaussianInf& prior,
                          const CPose3D& start)
{
    const Problem problem{points, PosePrior(prior)};
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
