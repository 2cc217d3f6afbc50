#pragma once

#include "solver_test_tools.h"

namespace mp2p_icp_test
{
inline mrpt::math::TLine3D line(const Vector3d& base, const Vector3d& director)
{
    mrpt::math::TLine3D l;
    l.pBase = mp2p_icp::to_mrpt(base), l.director = mp2p_icp::to_mrpt(director);
    return l;
}
inline mp2p_icp::plane_patch_t patch(const Vector3d& centroid, const Vector3d& normal)
{
    mp2p_icp::plane_patch_t p;
    for (int i = 0; i < 3; i++) p.plane.coefs[i] = normal(i);
    p.plane.coefs[3] = -normal.dot(centroid), p.centroid = mp2p_icp::to_mrpt(centroid);
    return p;
}
}  // namespace mp2p_icp_test
