#pragma once

#include <mp2p_icp/log_scene.h>

#include "scene_frame.h"

namespace mp2p_icp
{
/// A standard deviation that is shown this many units long is easy to see, and does not hide the data.
constexpr double ELLIPSOID_SIZE = 0.05;

// The second is a colour that nothing else has.
const mrpt::img::TColor ELLIPSOID_COLOR(0x40, 0x40, 0x40), FREE_MOTION_COLOR(0xCC, 0x00, 0x99);

/// The axes of a frame: x red, y green, z blue.
mrpt::opengl::CSetOfObjects::Ptr frame_object(const mrpt::poses::CPose3D& pose_in_scene);

/** The ellipsoid of three standard deviations of the translation, enlarged by a power of ten, around a point
 * of the scene; null if the covariance is not finite and positive. \param[out] scale that power.
 */
mrpt::opengl::CRenderizable::Ptr covariance_object(const Eigen::Matrix3d& covariance,
                                                   const mrpt::math::TPoint3D& centre_in_scene, double unit,
                                                   double& scale);

/// A motion that nothing determines: an arrow with two heads along a translation, through `middle`, or a
/// ring around the axis of a rotation.
mrpt::opengl::CRenderizable::Ptr free_motion_object(const FreeTwist& twist, const SceneFrame& frame,
                                                    const mrpt::math::TPoint3D& middle_in_scene);

}  // namespace mp2p_icp
