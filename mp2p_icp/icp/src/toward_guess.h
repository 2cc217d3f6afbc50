#pragma once

#include <mp2p_icp/FreeTwist.h>
#include <mrpt/poses/CPose3D.h>

#include <vector>

namespace mp2p_icp
{
/** Moves a pose along motions that are free there until nothing of the way from the guess lies along them:
 * the rotation between them has no component along the axes of free rotations and screws, and then the
 * displacement of the local frame's origin none along free translations. What is determined stays as it is.
 */
mrpt::poses::CPose3D toward_guess(const mrpt::poses::CPose3D& pose, const mrpt::poses::CPose3D& guess,
                                  const std::vector<FreeTwist>& free);

}  // namespace mp2p_icp
