#include "decorations.h"

#include <mrpt/opengl/CArrow.h>
#include <mrpt/opengl/CDisk.h>
#include <mrpt/opengl/CEllipsoid3D.h>
#include <mrpt/opengl/stock_objects.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
using mrpt::math::TPoint3D;
using mrpt::opengl::CSetOfObjects;

namespace
{
constexpr float FRAME_SIZE = 0.1f, ARROW_LENGTH = 0.25f, RING_RADIUS = 0.15f;  // units

/// z along the axis.
mrpt::poses::CPose3D pose_along(const Eigen::Vector3d& axis, const TPoint3D& at)
{
    Eigen::Matrix3d R;
    R.col(2) = axis;
    R.col(0) = axis.unitOrthogonal();
    R.col(1) = R.col(2).cross(R.col(0));
    return make_pose(R, to_eigen(at));
}

mrpt::opengl::CRenderizable::Ptr arrow_with_two_heads(const Eigen::Vector3d& axis, const TPoint3D& middle)
{
    auto set = CSetOfObjects::Create();
    const Eigen::Vector3d from = to_eigen(middle);
    for (const double sign : {-1.0, 1.0})
    {
        const Eigen::Vector3d to = from + sign * ARROW_LENGTH * axis;
        set->insert(mrpt::opengl::CArrow::Create(to_mrpt(from).cast<float>(), to_mrpt(to).cast<float>(), 0.2f,
                                                 0.003f, 0.012f));
    }
    set->setColor_u8(FREE_MOTION_COLOR);
    return set;
}

mrpt::opengl::CRenderizable::Ptr ring(const Eigen::Vector3d& axis, const TPoint3D& centre)
{
    auto disk = mrpt::opengl::CDisk::Create(RING_RADIUS, 0.95f * RING_RADIUS, 50);
    disk->setPose(pose_along(axis, centre));
    disk->setColor_u8(FREE_MOTION_COLOR);
    return disk;
}
}  // namespace

CSetOfObjects::Ptr frame_object(const mrpt::poses::CPose3D& pose_in_scene)
{
    auto frame = mrpt::opengl::stock_objects::CornerXYZSimple(FRAME_SIZE, 2.0f);
    frame->setPose(pose_in_scene);
    return frame;
}

mrpt::opengl::CRenderizable::Ptr covariance_object(const Eigen::Matrix3d& covariance,
                                                   const TPoint3D& centre_in_scene, double unit,
                                                   double& scale)
{
    scale = 1;
    if (!covariance.allFinite()) return nullptr;
    const Eigen::Vector3d variances =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues();
    if (!(variances(0) > 0)) return nullptr;
    const double longest = std::sqrt(variances(2)) / unit;
    scale = std::pow(10.0, std::floor(std::log10(ELLIPSOID_SIZE / longest)));
    scale = std::max(scale, 1.0);
    auto ellipsoid = mrpt::opengl::CEllipsoid3D::Create();
    const double per_unit = scale / unit;
    ellipsoid->setCovMatrix(mrpt::math::CMatrixDouble33(per_unit * per_unit * covariance));
    ellipsoid->setQuantiles(3);
    ellipsoid->enableDrawSolid3D(false);
    ellipsoid->setColor_u8(ELLIPSOID_COLOR);
    ellipsoid->setLocation(centre_in_scene);
    return ellipsoid;
}

mrpt::opengl::CRenderizable::Ptr free_motion_object(const FreeTwist& twist, const SceneFrame& frame,
                                                    const TPoint3D& middle_in_scene)
{
    const Eigen::Vector3d axis(twist.axis.x, twist.axis.y, twist.axis.z);
    if (!axis.allFinite() || !(axis.stableNorm() > 0)) return nullptr;
    const Eigen::Vector3d unit_axis = axis.stableNormalized();
    if (twist.kind == FreeTwist::Kind::Translation) return arrow_with_two_heads(unit_axis, middle_in_scene);
    // The point of the axis that is nearest to the data.
    const Eigen::Vector3d through = to_eigen(frame.in_scene(twist.through)),
                          middle = to_eigen(middle_in_scene);
    const Eigen::Vector3d nearest = through + unit_axis * unit_axis.dot(middle - through);
    if (!(nearest.norm() < FARTHEST_DRAWN)) return nullptr;
    auto set = CSetOfObjects::Create();
    set->insert(ring(unit_axis, to_mrpt(nearest)));
    if (twist.kind == FreeTwist::Kind::Screw) set->insert(arrow_with_two_heads(unit_axis, to_mrpt(nearest)));
    return set;
}

}  // namespace mp2p_icp
