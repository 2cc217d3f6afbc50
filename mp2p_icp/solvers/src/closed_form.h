#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/observability.h>

#include <optional>

#include "attitude.h"
#include "pairing_sums.h"
#include "pose_quadratic.h"
#include "vector_set.h"

namespace mp2p_icp
{
struct ClosedForm
{
    AttitudeMethod method = AttitudeMethod::Horn;
    PointVectors points = PointVectors::Lengths;
    std::optional<mrpt::poses::CPose3D> guess;
    std::optional<double> sigma;  ///< for the predicted deviations of free motions
};

/** The pose of `pairings` by a closed form, into pose, status, rank, free and skipped of `result`; its
 * outliers are left alone. Drops what is not finite from `pairings`. \return false if there is nothing to
 * solve with; the pose is unchanged then.
 */
bool solve_closed_form(PreparedPairings& pairings, const ClosedForm& how, OptimalTF_Result& result);

/// Is the information positive definite with room to spare, above what noise can feign (see analyse())? Then
/// there is no need to find its null space.
bool clearly_determined(const PoseQuadratic& q, const OriginPose& pose);
/// Status, rank and free motions.
void set_determined(OptimalTF_Result& result);
void set_rank(const Observability& seen, OptimalTF_Result& result);
/// The same of the result's pose.
void describe_pose(const PreparedPairings& pairings, const std::optional<double>& sigma,
                   OptimalTF_Result& result);

/// Which of these poses, minima that cost the same as far as sums can tell, costs least by residuals; of
/// several, the one nearest to the guess.
size_t lowest_by_residuals(const PreparedPairings& in, const PoseQuadratic& q,
                           const std::vector<mrpt::poses::CPose3D>& poses, const Eigen::Matrix3d& guess);

/** The pose that minimises the sum of squares of all rows of all kinds, over all rotations: a start for
 * Gauss-Newton. Horn's for points alone, a search on sums otherwise. False as above.
 */
bool solve_globally(PreparedPairings& pairings, const mrpt::poses::CPose3D& guess,
                    mrpt::poses::CPose3D& pose);

}  // namespace mp2p_icp
