#pragma once

#include <mrpt/poses/CPose3D.h>

#include "prepared_pairings.h"

namespace mp2p_icp
{
/** Of the poses that fit as well as `pose`, which is a minimum: along the motions that leave the residuals as
 * they are, to where the rotation is nearest to that of `guess` and, with what is free then, the local
 * centroid nearest to where `guess` puts it. `pose` itself if no motion is free.
 */
mrpt::poses::CPose3D nearest_to_guess(const PreparedPairings& in, const mrpt::poses::CPose3D& pose,
                                      const mrpt::poses::CPose3D& guess);

}  // namespace mp2p_icp
