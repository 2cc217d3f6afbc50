#pragma once

#include <mp2p_icp/se3.h>
#include <mrpt/opengl/CSetOfObjects.h>

namespace mp2p_icp
{
/** The coordinates in which things are handed to OpenGL, whose floats can hold neither points far from the
 * origin nor the widest scenes: metres from a reference point, divided by a unit of length.
 */
struct SceneFrame
{
    mrpt::math::TPoint3D origin{0, 0, 0};  ///< metres
    double unit = 1;                       ///< metres

    mrpt::math::TPoint3D in_scene(const mrpt::math::TPoint3D& p) const { return (p - origin) * (1 / unit); }

    /// The pose in the scene of what was drawn relative to `reference` (of its own frame), with this unit.
    mrpt::poses::CPose3D in_scene(const mrpt::poses::CPose3D& T_world_own,
                                  const mrpt::math::TPoint3D& reference) const
    {
        const auto at = in_scene(T_world_own.composePoint(reference));
        return make_pose(rotation_of(T_world_own), to_eigen(at));
    }
};

/// What does not lie within so many units cannot be seen, and only spoils float computations.
constexpr double FARTHEST_DRAWN = 1e5;

}  // namespace mp2p_icp
