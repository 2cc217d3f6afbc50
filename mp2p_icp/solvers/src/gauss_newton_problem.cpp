#include "gauss_newton_problem.h"

#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <cmath>
#include <stdexcept>

#include "euler_rates.h"
#include "residual_terms.h"
#include "rotation_vector.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A residual term at a pose: its value and its Jacobian by the scaled twist, both in metres.
struct Rows
{
    Vector3d r = Vector3d::Zero();
    Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
};

struct Sums
{
    double cost = 0;
    Matrix6 H = Matrix6::Zero();
    Vector6 g = Vector6::Zero();
    Sums& operator+=(const Sums& o)
    {
        cost += o.cost, H += o.H, g += o.g;
        return *this;
    }
    void add(double w, const Rows& rows)
    {
        H += w * (rows.J.transpose() * rows.J);
        g += w * (rows.J.transpose() * rows.r);
    }
};

Rows position_rows(const ResidualTerm& term, const OriginPose& pose, const CentredPairings& in)
{
    const Vector3d lever = pose.R * (term.b - in.local_mean);
    Rows out;
    out.r = term.C * (lever + (pose.c - (term.q - in.global_mean)));
    out.J << term.C, -term.C * skew(lever) / in.L;
    return out;
}

Rows direction_rows(const ResidualTerm& term, const OriginPose& pose, double L)
{
    const Vector3d rotated = pose.R * term.b;
    Rows out;
    out.r = term.C * (rotated - term.q);
    out.J << Matrix3d::Zero(), -term.C * skew(rotated) / L;
    return out;
}

/// A pairing at a pose.
struct SeenPairing
{
    double w = 0, direction_w = 0;  ///< of the two squared residuals
    double base_w = 0, square = 0;  ///< base_w * square = the cost without kernel; see squared_residuals()
    Rows position, direction;
};

SeenPairing see(const CentredPairings& in, size_t i, const OriginPose& pose)
{
    SeenPairing out;
    const PairingId id = pairing_id(in.pairings.pairings(), i);
    const PairingTerms terms = in.pairings.terms(id);
    out.w = in.pairings.weight(id);
    out.position = position_rows(terms.position, pose, in);
    double cost = out.w * out.position.r.squaredNorm();
    out.base_w = out.w;
    if (terms.direction)
    {
        out.direction_w = in.pairings.direction_weight(id, in.L);
        out.direction = direction_rows(*terms.direction, pose, in.L);
        cost += out.direction_w * out.direction.r.squaredNorm();
        if (!(out.w > 0)) out.base_w = out.direction_w / (in.L * in.L);
    }
    if (out.base_w > 0) out.square = cost / out.base_w;
    return out;
}

/// Below this part of the largest eigenvalue, a motion is free.
constexpr double RELATIVE_INFORMATION = 1e-10;
}  // namespace

CentredPairings::CentredPairings(const PreparedPairings& in) : pairings(in)
{
    PreparedPairings summed = in;
    const PairingSums sums = pairing_sums(summed);
    const PoseQuadratic q = pose_quadratic(sums, in);
    local_mean = q.b_centre, global_mean = q.a_centre, L = q.L();
}

GaussNewtonProblem::GaussNewtonProblem(const PreparedPairings& pairings,
                                       const OptimalTF_GN_Parameters& parameters)
    : in_(pairings), kernel_(parameters.kernel), kernel_scale_(parameters.kernelParam)
{
    if (kernel_ != RobustKernel::None && !(kernel_scale_ > 0))
        throw std::invalid_argument("optimal_tf_gauss_newton: kernelParam must be positive");
    if (parameters.prior) prior_.emplace(*parameters.prior);
}

Linearised GaussNewtonProblem::linearise(const OriginPose& pose) const
{
    const auto sums =
        block_sum<Sums>(in_.pairings.size(),
                        [&](size_t from, size_t to)
                        {
                            Sums s;
                            for (size_t i = from; i < to; i++)
                            {
                                const SeenPairing x = see(in_, i, pose);
                                if (!(x.base_w > 0)) continue;
                                const double f = robust_weight(kernel_, x.square, kernel_scale_);
                                s.cost += x.base_w * robust_loss(kernel_, x.square, kernel_scale_);
                                s.add(f * x.w, x.position);
                                if (x.direction_w > 0) s.add(f * x.direction_w, x.direction);
                            }
                            return s;
                        });
    Linearised out;
    out.cost = sums.cost, out.H = sums.H, out.g = sums.g;
    if (!prior_) return out;
    const auto in_frames = absolute(in_.global_mean, in_.local_mean, pose);
    out.cost += prior_->cost(in_frames);
    out.prior_e = prior_->sqrt_information() * prior_->error(in_frames);
    out.prior_J = prior_->sqrt_information() * PosePrior::jacobian(in_frames, in_.local_mean);
    out.prior_J.rightCols<3>() /= in_.L;
    return out;
}

OriginPose GaussNewtonProblem::moved(const OriginPose& pose, const Vector6& scaled) const
{
    const Matrix3d R = rotation_by(scaled.tail<3>() / in_.L) * pose.R;
    return {Eigen::Quaterniond(R).normalized().toRotationMatrix(), pose.c + scaled.head<3>()};
}

std::vector<double> squared_residuals(const PreparedPairings& in, const mrpt::poses::CPose3D& pose)
{
    const CentredPairings about(in);
    const OriginPose at = relative_to(about.global_mean, about.local_mean, pose);
    std::vector<double> out(in.size());
    for (size_t i = 0; i < out.size(); i++) out[i] = see(about, i, at).square;
    return out;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> free_motions(const Matrix6& H)
{
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(H);
    const Vector6 values = eigen.eigenvalues();  // increasing
    int free = 0;
    while (free < 6 && !(values(free) > 0 && values(free) > RELATIVE_INFORMATION * values(5))) free++;
    return eigen.eigenvectors().leftCols(free);
}

int rank_of(const Matrix6& H)
{
    return 6 - static_cast<int>(free_motions(H).cols());
}

Vector6 least_squares_step(const Linearised& at, double damping)
{
    // As rows, not as a sum of information matrices: a strong prior does not drown weak pairings.
    Eigen::Matrix<double, 18, 6> A = Eigen::Matrix<double, 18, 6>::Zero();
    Eigen::Matrix<double, 18, 1> b = Eigen::Matrix<double, 18, 1>::Zero();
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(at.H);
    const Vector6 values = eigen.eigenvalues();
    for (int i = 0; i < 6; i++)
    {
        if (!(values(i) > 0 && values(i) > RELATIVE_INFORMATION * values(5))) continue;
        const Vector6 u = eigen.eigenvectors().col(i);
        const double root = std::sqrt(values(i));
        A.row(i) = root * u.transpose();
        b(i) = -u.dot(at.g) / root;
    }
    A.middleRows<6>(6) = at.prior_J;
    b.segment<6>(6) = -at.prior_e;
    A.bottomRows<6>() = std::sqrt(damping * at.H.trace() / 6) * Matrix6::Identity();
    Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix<double, 18, 6>> solver;
    solver.setThreshold(1e-12);  // of a root of information: far above rounding, below any useful prior
    solver.compute(A);
    return solver.solve(b);
}

}  // namespace mp2p_icp
