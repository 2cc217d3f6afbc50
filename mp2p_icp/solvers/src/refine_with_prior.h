#pragma once

#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>

#include "point_moments.h"

namespace mp2p_icp
{
/** Minimises sum w |a - (R b + t)|^2 + e' Lambda e, e = coordinates(pose) - coordinates(prior mean), from
 * `start`: damped Gauss-Newton on the moments, so that its cost does not depend on the number of pairings.
 */
mrpt::poses::CPose3D refine_with_prior(const PointMoments& points,
                                       const mrpt::poses::CPose3DPDFGaussianInf& prior,
                                       const mrpt::poses::CPose3D& start);

}  // namespace mp2p_icp
