#pragma once

#include <mrpt/math/TPlane.h>
#include <mrpt/math/TPoint3D.h>

namespace mp2p_icp
{
/** A plane and the centroid of the patch of it that was seen. The normal (a,b,c of `plane`) is a unit vector
 * that points out of the measured surface, towards the sensor, where its side is known.
 */
struct plane_patch_t
{
    mrpt::math::TPlane plane;
    mrpt::math::TPoint3D centroid = {0, 0, 0};

    plane_patch_t() = default;
    plane_patch_t(const mrpt::math::TPlane& p, const mrpt::math::TPoint3D& c) : plane(p), centroid(c) {}
};

}  // namespace mp2p_icp
