#include "nearest_to_guess.h"

#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gauss_newton_problem.h"
#include "rotation_vector.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using mrpt::poses::CPose3D;

constexpr int MOST_STEPS = 200, MOST_HALVINGS = 6;
/// A fit is as good if its residuals are within rounding: this part of the scene's size each.
constexpr double RESIDUAL_ROUNDING = 1e-13;

/// Of a part of orthonormal columns: what is smaller than 1e-6 is rounding.
MatrixXd pseudo_inverse(const MatrixXd& A)
{
    const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
    VectorXd inverse = svd.singularValues();
    for (auto& value : inverse) value = value > 1e-6 ? 1 / value : 0;
    return svd.matrixV() * inverse.asDiagonal() * svd.matrixU().transpose();
}

/// The way to the guess along free motions, as a scaled twist; its rotation first, then the translation that
/// the remaining freedom allows.
Vector6 way_to_guess(const MatrixXd& free, double L, const OriginPose& at, const OriginPose& guess)
{
    const MatrixXd turns = free.bottomRows(3), turns_inverse = pseudo_inverse(turns);
    const VectorXd turning = turns_inverse * (L * rotation_between(at.R, guess.R));
    const MatrixXd still = MatrixXd::Identity(free.cols(), free.cols()) - turns_inverse * turns;
    const Vector3d rest = guess.c - at.c - free.topRows(3) * turning;
    return free * (turning + still * (pseudo_inverse(free.topRows(3) * still) * rest));
}

/// Walks; each step is followed by a descent back into the valley.
class Walk
{
 public:
    Walk(const PreparedPairings& in, const CPose3D& pose, const CPose3D& guess)
        : in_(in), problem_(in, parameters()), guess_(origin_pose(guess)), at_(origin_pose(pose))
    {
    }

    CPose3D run()
    {
        for (int k = 0; k < MOST_STEPS; k++)
        {
            const Linearised here = problem_.linearise(at_);
            if (k == 0) highest_cost_ = here.cost + rounding(here);
            const MatrixXd free = free_motions(here.H);
            if (free.cols() == 0) break;
            const Vector6 way = way_to_guess(free, L(), at_, guess_);
            if (way.norm() < 1e-11 * L() || !step(way)) break;
        }
        return absolute(problem_.centred().global_mean, problem_.centred().local_mean, at_);
    }

 private:
    static OptimalTF_GN_Parameters parameters()
    {
        OptimalTF_GN_Parameters p;
        p.minDelta = 1e-14, p.maxInnerLoopIterations = 10;
        return p;
    }
    double L() const { return problem_.centred().L; }
    OriginPose origin_pose(const CPose3D& pose) const
    {
        return relative_to(problem_.centred().global_mean, problem_.centred().local_mean, pose);
    }
    double rounding(const Linearised& at) const
    {
        const double residual = RESIDUAL_ROUNDING * (L() + at_.c.norm());
        return at.H.trace() * residual * residual + 1e-9 * at.cost;
    }
    /// How far from the guess: the rotation counts first.
    std::pair<double, double> distance(const OriginPose& p) const
    {
        return {rotation_between(p.R, guess_.R).norm(), (p.c - guess_.c).norm()};
    }

    /// As much of the way as leads nearer and leaves the fit as it is. Where the ways become shorter but
    /// slowly, the curvature of the valley makes them too short: more than all of it then. \return false if
    /// none of it does.
    bool step(Vector6 way)
    {
        stretch_ = way.norm() > 0.5 * last_way_ ? std::min(1.5 * stretch_, 20.0) : 1.0;
        last_way_ = way.norm();
        way *= stretch_;
        const auto before = distance(at_);
        for (int halving = 0; halving < MOST_HALVINGS; halving++, way *= 0.5)
        {
            GaussNewtonReport report;
            const OriginPose next =
                origin_pose(descend(in_, parameters(),
                                    absolute(problem_.centred().global_mean, problem_.centred().local_mean,
                                             problem_.moved(at_, way)),
                                    report));
            const auto after = distance(next);
            // Near the end, the angle changes by less than its rounding.
            const bool nearer = after.first < before.first - 1e-14 ||
                                (after.first < before.first + 1e-12 &&
                                 (after.second < before.second || way.norm() < 1e-5 * L()));
            if (!nearer || report.cost > highest_cost_) continue;
            at_ = next;
            stretch_ *= std::pow(0.5, halving);
            return true;
        }
        return false;
    }

    const PreparedPairings& in_;
    GaussNewtonProblem problem_;
    OriginPose guess_, at_;
    double highest_cost_ = 0, stretch_ = 1, last_way_ = std::numeric_limits<double>::infinity();
};
}  // namespace

CPose3D nearest_to_guess(const PreparedPairings& in, const CPose3D& pose, const CPose3D& guess)
{
    return Walk(in, pose, guess).run();
}

}  // namespace mp2p_icp
