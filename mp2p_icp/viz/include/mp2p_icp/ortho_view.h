#pragma once

#include <mrpt/math/TPoint2D.h>
#include <mrpt/math/TPoint3D.h>
#include <mrpt/opengl/CCamera.h>

#include <optional>
#include <vector>

namespace mp2p_icp
{
/// Points in one frame, metres.
using PointSet = std::vector<mrpt::math::TPoint3D>;

/** A parallel view of the world: what is looked at, from which side, and how much of it fills the picture.
 * Lengths that are parallel to the picture are the same everywhere in it, so that one scale bar is right
 * for all of them.
 */
struct OrthoView
{
    mrpt::math::TPoint3D focus;  ///< what is at the centre of the picture, world frame
    double azimuth_deg = -70;    ///< where the eye stands, seen from the focus: 0 is +x, 90 is +y
    double elevation_deg = 60;   ///< 0: from the side, 90: from above; in [-90, 90]
    double height = 1;           ///< from the bottom to the top of the picture, m
    double depth = 1;            ///< how far before and behind the focus things are shown, m

    mrpt::math::TVector3D towards_eye() const;  ///< unit vector
    mrpt::math::TVector3D right() const;        ///< unit vector, along the picture's rows
    mrpt::math::TVector3D up() const;           ///< unit vector, along the picture's columns

    /// Where a world point falls in a picture of that size: pixels from the left and top borders.
    mrpt::math::TPoint2D project(const mrpt::math::TPoint3D& point, int width_px, int height_px) const;

    /** \name The same view of an MRPT scene
     * In the scene, the origin is the focus and the unit of length is the height of the picture: MRPT's float
     * cameras can neither hold points far from the origin nor scenes of tens of kilometres.
     */
    ///@{
    mrpt::math::TPoint3D in_scene(const mrpt::math::TPoint3D& point) const;  ///< a world point, in the scene
    /// The eye is as far from the focus as things are shown: clip at 0 and at twice that distance.
    mrpt::opengl::CCamera camera(int width_px, int height_px) const;
    ///@}
};

/// From where to look; what is empty is chosen from the data.
struct ViewDirection
{
    std::optional<double> azimuth_deg, elevation_deg;
};

/** The view that shows all the sets, whatever their size, in a picture with this ratio of width to height.
 *
 * A few far points do not shrink the rest: what lies far outside the middle 96 % of a set, along the
 * picture's axes, may fall outside the picture. Flat data (a 2-D scan, a wall) is looked at along its
 * normal, a flat floor from above with y upwards; anything else obliquely from above.
 * \exception std::invalid_argument if there is no point at all, if a point is not finite, or the ratio is
 * not positive.
 * O(number of points).
 */
OrthoView fit_view(const std::vector<PointSet>& sets, double width_over_height,
                   const ViewDirection& direction = {});

}  // namespace mp2p_icp
