#pragma once

#include <mp2p_icp/optimal_tf_gauss_newton.h>

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "pose_prior.h"
#include "pose_quadratic.h"
#include "prepared_pairings.h"

namespace mp2p_icp
{
/// Pairings relative to a reference point on each side, so that coordinates far from the origin lose nothing.
struct CentredPairings
{
    const PreparedPairings& pairings;
    Eigen::Vector3d local_mean = Eigen::Vector3d::Zero(), global_mean = Eigen::Vector3d::Zero();
    double L = 1;  ///< what turns rad into m

    explicit CentredPairings(const PreparedPairings& in);
};

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
    GaussNewtonProblem(const PreparedPairings& pairings, const OptimalTF_GN_Parameters& parameters);

    const CentredPairings& centred() const { return in_; }
    Linearised linearise(const OriginPose& pose) const;
    /// `scaled` is (v, omega L).
    OriginPose moved(const OriginPose& pose, const Vector6& scaled) const;

 private:
    CentredPairings in_;
    RobustKernel kernel_;
    double kernel_scale_;
    std::optional<PosePrior> prior_;
};

/** Of each pairing (in the order of pairing_id()), in m^2: the square of its position's residual plus that of
 * its direction by the ratio of their weights (by L^2 where the position has none). What a robust kernel
 * sees.
 */
std::vector<double> squared_residuals(const PreparedPairings& in, const mrpt::poses::CPose3D& pose);

/** The pose where the descent from `start` ends; `report` says how. Start, kernel scale and prior must be
 * valid; pairings all finite. The start itself if no pairing has a weight.
 */
mrpt::poses::CPose3D descend(const PreparedPairings& in, const OptimalTF_GN_Parameters& parameters,
                             const mrpt::poses::CPose3D& start, GaussNewtonReport& report);

/// optimal_tf_gauss_newton() of prepared pairings.
bool gauss_newton(PreparedPairings& in, const OptimalTF_GN_Parameters& parameters, OptimalTF_Result& result,
                  GaussNewtonReport* report = nullptr);

/// How many motions H determines.
int rank_of(const Matrix6& H);
/// An orthonormal basis (columns) of those that it does not.
Eigen::Matrix<double, 6, Eigen::Dynamic> free_motions(const Matrix6& H);

/// The scaled twist of least norm that minimises the linearised cost + damping |twist|^2; none of it along
/// what neither H nor prior determines. `damping` is relative to the mean of H's diagonal.
Vector6 least_squares_step(const Linearised& at, double damping);

}  // namespace mp2p_icp
