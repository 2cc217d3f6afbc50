#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>

#include <functional>
#include <optional>
#include <string>

namespace mp2p_icp_apps::experiments
{
/// What a method is given.
struct PoseProblem
{
    const mp2p_icp::Pairings& pairings;
    mp2p_icp::PairWeights likely;   ///< inverse variances of the noise
    mrpt::poses::CPose3D estimate;  ///< for those that need one
    double outlier_threshold = 0;   ///< m: five deviations of a coordinate
    double kernel_scale = 1;        ///< m

    // Set by methods that go around others.
    std::optional<double> scale_threshold = {};
    mp2p_icp::RobustKernel kernel = mp2p_icp::RobustKernel::None;  ///< at the estimate
};

/// A way from pairings to a pose. Its id names it in files, and gives its colour in figures.
struct PoseMethod
{
    std::string id, label;
    std::function<bool(const PoseProblem&, mp2p_icp::OptimalTF_Result&)> solve;
};

/// How much kinds of pairings weigh.
enum class Weighting
{
    /// Every vector of the report's lists weighs 1, positions of planes and lines nothing: m against units of
    /// length 1 for Horn and Gauss-Newton, unit vectors throughout for OLAE.
    Report,
    Likely  ///< inverse variances
};

// ---- The report's three -----------------------------------------------------------------------------------
PoseMethod olae(Weighting weighting);
PoseMethod horn(Weighting weighting);
PoseMethod gauss_newton(Weighting weighting);  ///< from the estimate

// ---- What the report lacks --------------------------------------------------------------------------------
PoseMethod olae_least_squares(Weighting weighting);  ///< OLAE's own system, instead of the report's
PoseMethod olae_newton(Weighting weighting);         ///< with Newton steps on the eigenvalue
PoseMethod certified(Weighting weighting);           ///< the best of all poses
PoseMethod gauss_newton_unit();                      ///< all rows, each of weight 1

// ---- Against outliers -------------------------------------------------------------------------------------
PoseMethod with_scale_test(const PoseMethod& closed_form);  ///< the report's, s_t = 0.2
PoseMethod horn_with(mp2p_icp::OutlierRejection rejection);
/// Geman-McClure's at the given estimate; more than once: each time at the pose of the one before.
PoseMethod with_loss(const PoseMethod& closed_form, int times = 1);

}  // namespace mp2p_icp_apps::experiments
