#pragma once

#include <mp2p_icp/synthetic/TriangleMesh.h>
#include <mrpt/poses/CPose3D.h>

namespace mp2p_icp::synthetic
{
/// The six faces of a box of this size (all sides above zero) with its centre at `pose`: 12 triangles,
/// normals outwards.
TriangleMesh box_mesh(const mrpt::poses::CPose3D& pose, const mrpt::math::TPoint3D& size);

/// A closed, empty room, centred on the origin in x and y, its floor at z = 0: 12 triangles, normals inwards.
TriangleMesh box_room(double length_x, double width_y, double height_z);

/** A box_room() with boxes (0.3 to 1.2 m wide, 0.4 m to `height_z` high) standing on its floor at random
 * places and headings. None comes nearer than 1 m to the centre of the room, so that a sensor may stand
 * there.
 * \exception std::invalid_argument if the room is narrower than 5 m or lower than 0.5 m.
 */
TriangleMesh room_with_boxes(double length_x, double width_y, double height_z, size_t box_count,
                             uint64_t seed);

/// Floor, ceiling and two long walls along x, open at both ends: the position along x cannot be seen from
/// within.
TriangleMesh corridor(double length_x, double width_y, double height_z);

/** A street along x with its middle at the origin: flat ground at z = 0, on both sides houses of different
 * sizes with gaps between them, and poles 0.3 m thick. The roadway, |y| < 6 m, is free.
 * \exception std::invalid_argument if it is shorter than 20 m.
 */
TriangleMesh street(double length_x, uint64_t seed);

}  // namespace mp2p_icp::synthetic
