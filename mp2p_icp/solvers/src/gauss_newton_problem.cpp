#include "gauss_newton_problem.h"

#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <cmath>
#include <limits>
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

std::vector<double> given_weights(const Pairings& in, const PairWeights& kinds)
{
    std::vector<double> weights = in.expanded_point_weights();
    for (double& w : weights) w *= kinds.pt2pt;
    weights.insert(weights.end(), in.paired_pt2ln.size(), kinds.pt2ln);
    weights.insert(weights.end(), in.paired_pt2pl.size(), kinds.pt2pl);
    weights.insert(weights.end(), in.paired_ln2ln.size(), kinds.ln2ln);
    weights.insert(weights.end(), in.paired_pl2pl.size(), kinds.pl2pl);
    for (const double w : weights)
        if (!(w >= 0) || w > std::numeric_limits<double>::max())
            throw std::invalid_argument("weights of pairings must be finite and not negative");
    return weights;
}

struct Means
{
    double w = 0;
    Vector3d local = Vector3d::Zero(), global = Vector3d::Zero();
    Means& operator+=(const Means& o)
    {
        w += o.w, local += o.local, global += o.global;
        return *this;
    }
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
};

/// A residual term at a pose: its value and its Jacobian by the scaled twist, both in metres.
struct Rows
{
    Vector3d r = Vector3d::Zero();
    Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
};

Rows position_rows(const ResidualTerm& term, const CentredPose& pose, const WeightedPairings& in)
{
    const Vector3d lever = pose.R * (term.b - in.local_mean);
    Rows out;
    out.r = term.C * (lever + (pose.c - (term.q - in.global_mean)));
    out.J << term.C, -term.C * skew(lever) / in.L;
    return out;
}

Rows direction_rows(const ResidualTerm& term, const CentredPose& pose, double L)
{
    const Vector3d rotated = pose.R * term.b;
    Rows out;
    out.r = L * (term.C * (rotated - term.q));
    out.J << Matrix3d::Zero(), -term.C * skew(rotated);  // L per rad, and the twist's unit is rad / L
    return out;
}

/// Below this part of the largest eigenvalue, a motion is free.
constexpr double RELATIVE_INFORMATION = 1e-10;
}  // namespace

WeightedPairings::WeightedPairings(const Pairings& in, const PairWeights& kinds)
    : pairings(in), weights(given_weights(in, kinds))
{
    for (size_t i = 0; i < weights.size(); i++)
        if (weights[i] > 0 && !terms_of(in, i).finite()) weights[i] = 0, skipped++;
    const auto means = block_sum<Means>(weights.size(),
                                        [&](size_t from, size_t to)
                                        {
                                            Means m;
                                            for (size_t i = from; i < to; i++)
                                            {
                                                if (weights[i] == 0) continue;
                                                const ResidualTerm term = terms_of(in, i).position;
                                                m.w += weights[i];
                                                m.local += weights[i] * term.b;
                                                m.global += weights[i] * term.q;
                                            }
                                            return m;
                                        });
    weight_sum = means.w;
    if (!(weight_sum > 0)) return;
    local_mean = means.local / weight_sum, global_mean = means.global / weight_sum;
    const double squares = block_sum<double>(
        weights.size(),
        [&](size_t from, size_t to)
        {
            double sum = 0;
            for (size_t i = from; i < to; i++)
                if (weights[i] > 0)
                    sum += weights[i] * (terms_of(in, i).position.b - local_mean).squaredNorm();
            return sum;
        });
    const double rms = std::sqrt(squares / weight_sum);
    // As in optimal_tf_horn: below this, points coincide but for the rounding of their mean.
    if (rms > 1e-12 * local_mean.norm()) L = rms;
}

CentredPose centred(const mrpt::poses::CPose3D& pose, const WeightedPairings& about)
{
    const Matrix3d R = rotation_of(pose);
    return {R, R * about.local_mean + (translation_of(pose) - about.global_mean)};
}

mrpt::poses::CPose3D uncentred(const CentredPose& pose, const WeightedPairings& about)
{
    return make_pose(pose.R, pose.c + (about.global_mean - pose.R * about.local_mean));
}

GaussNewtonProblem::GaussNewtonProblem(const WeightedPairings& pairings,
                                       const OptimalTF_GN_Parameters& parameters)
    : in_(pairings), kernel_(parameters.kernel), kernel_scale_(parameters.kernelParam)
{
    if (kernel_ != RobustKernel::None && !(kernel_scale_ > 0))
        throw std::invalid_argument("optimal_tf_gauss_newton: kernelParam must be positive");
    if (parameters.prior) prior_.emplace(*parameters.prior);
}

Linearised GaussNewtonProblem::linearise(const CentredPose& pose) const
{
    const auto sums = block_sum<Sums>(
        in_.weights.size(),
        [&](size_t from, size_t to)
        {
            Sums s;
            for (size_t i = from; i < to; i++)
            {
                if (in_.weights[i] == 0) continue;
                const PairingTerms terms = terms_of(in_.pairings, i);
                const Rows position = position_rows(terms.position, pose, in_);
                const Rows direction =
                    terms.direction ? direction_rows(*terms.direction, pose, in_.L) : Rows();
                const double square = position.r.squaredNorm() + direction.r.squaredNorm();
                const double w = in_.weights[i] * robust_weight(kernel_, square, kernel_scale_);
                s.cost += in_.weights[i] * robust_loss(kernel_, square, kernel_scale_);
                s.H += w * (position.J.transpose() * position.J);
                s.g += w * (position.J.transpose() * position.r);
                if (!terms.direction) continue;
                s.H += w * (direction.J.transpose() * direction.J);
                s.g += w * (direction.J.transpose() * direction.r);
            }
            return s;
        });
    Linearised out;
    out.cost = sums.cost, out.H = sums.H, out.g = sums.g;
    if (!prior_) return out;
    const auto absolute = uncentred(pose, in_);
    out.cost += prior_->cost(absolute);
    out.prior_e = prior_->sqrt_information() * prior_->error(absolute);
    out.prior_J = prior_->sqrt_information() * PosePrior::jacobian(absolute, in_.local_mean);
    out.prior_J.rightCols<3>() /= in_.L;
    return out;
}

CentredPose GaussNewtonProblem::moved(const CentredPose& pose, const Vector6& scaled) const
{
    return {rotation_by(scaled.tail<3>() / in_.L) * pose.R, pose.c + scaled.head<3>()};
}

int rank_of(const Matrix6& H)
{
    const Vector6 values = Eigen::SelfAdjointEigenSolver<Matrix6>(H, Eigen::EigenvaluesOnly).eigenvalues();
    int rank = 0;
    for (int i = 0; i < 6; i++) rank += values(i) > 0 && values(i) > RELATIVE_INFORMATION * values(5);
    return rank;
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
