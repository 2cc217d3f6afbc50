#pragma once

#include <mp2p_icp/log_scene.h>

#include "scene_frame.h"

namespace mp2p_icp
{
struct PairingObjects
{
    mrpt::opengl::CSetOfObjects::Ptr objects;
    double residual_scale = 0;  ///< metres that are drawn red
};

/** What is drawn of pairings, in scene coordinates. Both sides are first moved to metres from the scene's
 * origin: the global ones by a shift, the local ones by a pose.
 */
PairingObjects make_pairing_objects(const Pairings& pairings, const mrpt::math::TPoint3D& global_shift,
                                    const mrpt::poses::CPose3D& T_origin_local, double unit,
                                    const LogSceneOptions& options);

}  // namespace mp2p_icp
