#pragma once

#include <Eigen/Core>

namespace mp2p_icp_certify
{
/** All sums are taken with more digits than those of a file (19 instead of 16 on x86-64), so that a
 * difference of the last digits is the rounding of whoever wrote the file, and not one of this program.
 */
using Real = long double;

using Vec3 = Eigen::Matrix<Real, 3, 1>;
using Mat3 = Eigen::Matrix<Real, 3, 3>;
using Mat6 = Eigen::Matrix<Real, 6, 6>;
using Mat9 = Eigen::Matrix<Real, 9, 9>;

/// A pose of the local frame in the global one: p_global = R p_local + t.
struct Pose
{
    Mat3 R = Mat3::Identity();
    Vec3 t = Vec3::Zero();
};

}  // namespace mp2p_icp_certify
