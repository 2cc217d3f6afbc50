#pragma once

#include <optional>
#include <vector>

#include "certificate_file.h"
#include "wide_numbers.h"

namespace mp2p_icp_certify
{
/// u = (the columns of R one after the other, t, 1)
using PoseVector = Eigen::Matrix<Real, 13, 1>;
using PoseForm = Eigen::Matrix<Real, 13, 13>;
/// x = (the columns of R one after the other, 1)
using RotationVector = Eigen::Matrix<Real, 10, 1>;
using RotationForm = Eigen::Matrix<Real, 10, 10>;

/** The cost of all pairings and the prior, sum of weight * residual^2, as a quadratic form of the pose.
 *
 * Coordinates are relative to the weighted mean of the points on each side: those of a far place would leave
 * no digits for the residuals. They are not scaled, as nothing here compares a length with an angle or a
 * number.
 */
struct CostForm
{
    Vec3 global_centre = Vec3::Zero(), local_centre = Vec3::Zero();
    PoseForm of_pose = PoseForm::Zero();              ///< u' of_pose u, t between the centred frames
    RotationForm of_rotation = RotationForm::Zero();  ///< x' of_rotation x, at the best t
    Mat3 determined = Mat3::Zero();      ///< projection to the directions of t that any row determines
    Real worst_translation = 1;          ///< how well the worst of these is known, relative to the best one
    Mat3 prior_rotation = Mat3::Zero();  ///< what the prior tells about rotations alone, along global axes
    Real size = 0;                       ///< mean over all rotations, t being 0: what rounding is relative to

    /// The least cost at this rotation.
    Real at(const Mat3& R) const;
    /// The cost at this pose.
    Real at(const Pose& pose) const;
    /// The mean of at(R) over all rotations.
    Real mean() const;
    /// What the roundings of R, of t and of far coordinates can add to at(pose), which is flat in t.
    Real rounding_of_translation(const Pose& pose) const;
    /// How well the worst determined motion is known, relative to the best one: 0 is not at all.
    Real weakest_motion(const Mat3& R) const;
};

/// \exception std::invalid_argument if the information matrix of the prior is none.
CostForm cost_form(const std::vector<Pairing>& pairings, const std::optional<Prior>& prior);

/// Largest entry of R'R - I; infinite if R mirrors.
Real distance_to_rotation(const Mat3& R);
/// For a matrix that is nearly a rotation.
Mat3 nearest_rotation(Mat3 R);
/// rad
Real angle_between(const Mat3& R1, const Mat3& R2);

}  // namespace mp2p_icp_certify
