#pragma once

#include <Eigen/Dense>

namespace mp2p_icp
{
/** The rotation R that maximises trace(R' B), B = sum w a b': Horn's 4x4 eigenproblem. Where the largest
 * eigenvalue is multiple (to within 1e-10 of `scale`, which should bound |B|), the quaternion of that
 * eigenspace nearest to `guess`.
 */
Eigen::Matrix3d horn_rotation(const Eigen::Matrix3d& B, double scale, const Eigen::Matrix3d& guess);

}  // namespace mp2p_icp
