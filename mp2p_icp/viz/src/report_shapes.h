#pragma once

#include <mp2p_icp/FreeTwist.h>
#include <mp2p_icp/metricmap.h>

#include <Eigen/Dense>

#include "packed_points.h"

namespace mp2p_icp
{
/** \file report_shapes.h Segments that stand for things that are not points, relative to a centre. What is
 * not finite is left out. Sizes in metres.
 */

/// The borders of planes: of what was seen of them where their fit says so, else squares.
PackedPoints border_segments(const std::vector<fitted_plane_t>& planes, const Eigen::Vector3d& centre,
                             double square_size);

/// What was seen of lines, where their fit says so, else pieces around their base points.
PackedPoints line_segments(const std::vector<fitted_line_t>& lines, const Eigen::Vector3d& centre,
                           double piece_length);

/// A free motion, as drawn: along its axis, and around it.
struct MotionArrow
{
    PackedPoints segments;
    Eigen::Vector3d label_at = Eigen::Vector3d::Zero();
};

/** The motion of what is near the origin (the twist's own point being relative to it, too): a double arrow
 * for a translation, an axis with a turning arrow for a rotation, both for a screw.
 * \param size from the origin to the tip.
 */
MotionArrow motion_arrow(const FreeTwist& twist, double size);

}  // namespace mp2p_icp
