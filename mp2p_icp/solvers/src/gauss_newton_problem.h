#pragma once

#include <mp2p_icp/optimal_tf_gauss_newton.h>

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "pose_prior.h"

namespace mp2p_icp
{
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Pairings with their weights, relative to a reference point on each side, so that coordinates far from the
/// origin lose nothing.
struct WeightedPairings
{
    const Pairings& pairings;
    std::vector<double> weights;  ///< kind x pairing, in the order of terms_of(); 0 for those left out
    size_t skipped = 0;           ///< left out for numbers that are not finite
    double weight_sum = 0;
    Eigen::Vector3d local_mean = Eigen::Vector3d::Zero(), global_mean = Eigen::Vector3d::Zero();
    double L = 1;  ///< rms distance of the local positions from their mean, m

    /// \exception std::invalid_argument for a negative weight
    WeightedPairings(const Pairings& in, const PairWeights& kinds);
};

/// A pose, as its rotation and where it puts the local mean, relative to the global mean.
struct CentredPose
{
    Eigen::Matrix3d R;
    Eigen::Vector3d c;
};
CentredPose centred(const mrpt::poses::CPose3D& pose, const WeightedPairings& about);
mrpt::poses::CPose3D uncentred(const CentredPose& pose, const WeightedPairings& about);

/// The cost at a pose and, in the scaled twist (v, omega L), what a step needs: H and g of half the pairings'
/// cost, the prior's rows S (e + J twist).
struct Linearised
{
    double cost = 0;
    Matrix6 H = Matrix6::Zero();
    Vector6 g = Vector6::Zero();
    Matrix6 prior_J = Matrix6::Zero();
    Vector6 prior_e = Vector6::Zero();
};

/// Kernel, prior and pairings, as one cost.
class GaussNewtonProblem
{
 public:
    GaussNewtonProblem(const WeightedPairings& pairings, const OptimalTF_GN_Parameters& parameters);

    Linearised linearise(const CentredPose& pose) const;
    /// `scaled` is (v, omega L).
    CentredPose moved(const CentredPose& pose, const Vector6& scaled) const;

 private:
    const WeightedPairings& in_;
    RobustKernel kernel_;
    double kernel_scale_;
    std::optional<PosePrior> prior_;
};

/// How many motions H determines.
int rank_of(const Matrix6& H);

/// The scaled twist of least norm that minimises the linearised cost + damping |twist|^2; none of it along
/// what neither H nor prior determines. `damping` is relative to the mean of H's diagonal.
Vector6 least_squares_step(const Linearised& at, double damping);

}  // namespace mp2p_icp
