#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/PoseQuadratic.h>
#include <mp2p_icp/WeightParameters.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>

#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp
{
/// What is known of a pose's being the best one of all.
enum class GlobalVerdict : uint8_t
{
    Unobservable,  ///< no pose costs less, but along some motion all near it cost the same, to second order
    Global,        ///< no pose costs less, and only this one costs as little: proven, but for `gap`
    GlobalAmbiguous,  ///< no pose costs less, but others, apart from it, cost as little: see `minima`
    Gap               ///< the best pose found; the proof leaves room for one that costs less by `gap` at most
};
/// `unobservable`, `global`, `global_ambiguous`, `gap`.
std::string to_string(GlobalVerdict verdict);

/// A pose that is better than all near it.
struct PoseMinimum
{
    mrpt::poses::CPose3D pose;
    double cost = 0;  ///< as CertifiedResult::cost
};

struct CertifiedParameters
{
    /** Weights and signs; a robust kernel at its estimate; outliers that other tests find first. Graduated
     * non-convexity goes around the solver, and what is certified then is the last weighted problem.
     */
    WeightParameters weights;

    /// Which of equal minima to choose, and where to stay along free motions: the nearest rotation, then the
    /// nearest place of the centroid. The search starts there, too. Empty: the identity, without a start.
    /// (Equal minima that were not met are not compared, and may be nearer; all_minima looks for all.)
    std::optional<mrpt::poses::CPose3D> guess;

    /// Enters as rows like any other, see pose_quadratic(). A weight of 1 then stands for 1/m^2.
    std::optional<mrpt::poses::CPose3DPDFGaussianInf> prior;

    /// The largest gap that counts as none, relative to CertifiedResult::scale.
    double tolerance = 1e-9;

    /// Look for all minima, not only for the lowest (some 0.3 ms more).
    bool all_minima = false;
};

struct CertifiedResult : public OptimalTF_Result
{
    GlobalVerdict verdict = GlobalVerdict::Unobservable;
    /// Of optimalPose: sum of w |r|^2 over all rows, m^2, the prior's among them. (What the guess costs along
    /// a translation with an information below 1e-12 of the largest is in `gap`, not here.)
    double cost = 0;
    double gap = 0;    ///< no pose costs less than cost - gap, m^2: that is proven, whatever the verdict
    double scale = 0;  ///< the mean cost over all rotations (each with its best translation) less `cost`, m^2
    /** If positive, no rotation but that of optimalPose has its cost: one turned from it by an angle a costs
     * at least scale * margin * (1 - cos(a/2)^4) more. At most 1. Of the translation it says nothing.
     */
    double margin = 0;

    /** Distinct local minima, the lowest first: those that were met, or all with
     * CertifiedParameters::all_minima. A valley of equal cost is represented by its place nearest to the
     * guess.
     */
    std::vector<PoseMinimum> minima;

    /** The proof: with q = (w, x, y, z) any unit quaternion, r = sqrt 2, R0 the rotation of optimalPose, and
     * u = (r wx, r wy, r wz, xx, yy, zz, r xy, r xz, r yz), the cost of R0 R(q) is cost + scale u' G u, but
     * for the slope at R0 (rounding). If G is positive semidefinite, none is lower. See write_certificate()
     * and `icp-certify`.
     */
    Eigen::Matrix<double, 9, 9> G = Eigen::Matrix<double, 9, 9>::Zero();
};

/** The pose of least squares over all rotations and translations, over any mix of pairings, with a proof that
 * no better one exists. The cost is a quadratic in (R, t), and without t it is x' Q x, x = (columns of R, 1):
 * one 10x10 matrix whatever the number of pairings. Its minima are found by descents from the guess, from the
 * best of 60 rotations spread over all of them, and, if the proof fails or the minimum may not be the only
 * one, from all 60. The proof is a positive semidefinite matrix of a 14-parameter family: the dual of the
 * semidefinite relaxation of J. Briales and J. Gonzalez-Jimenez, "Convex global 3D registration with
 * Lagrangian duality", CVPR 2017, in the frame of the pose.
 *
 * What is proven is the optimum of the weighted sum of squares of the given pairings: not that the pairings
 * are right, nor the optimum of a robust loss. Gaps are relative to what typical rotations cost: with weights
 * that differ by more than 1e6, a relative gap of 1e-9 can exceed all that the light pairings say; `gap` is
 * in m^2. Free directions have no sign, oriented ones have; see PairWeights. The relaxation is not always
 * tight: the verdict is Gap then.
 *
 * The verdict is about the cost of pairings and prior together. `rank`, `free` and `status` speak of the
 * pairings alone and judge as those of all solvers do: a motion that noise alone may have determined counts
 * as free there.
 *
 * \return false (pose unchanged, SolveStatus::NoPairings) if there is nothing to solve with. \exception
 * std::invalid_argument for weights that are not from 0 to 1e20, sums, a guess or a prior that are not
 * finite, a prior that is not positive semidefinite, a tolerance that is not positive. The same bits on any
 * number of threads. Thread-safe. Cost: one pass over the pairings, then some 20 us; 0.3 ms if all minima are
 * looked for.
 */
bool optimal_tf_certified(const Pairings& in, CertifiedResult& result,
                          const CertifiedParameters& parameters = {});

/// The same of sums. Of `parameters.weights`, only sigma counts.
bool optimal_tf_certified(const PoseQuadratic& sums, CertifiedResult& result,
                          const CertifiedParameters& parameters = {});

}  // namespace mp2p_icp
