#include "report_shapes.h"

#include <mp2p_icp/se3.h>

#include <cmath>

namespace mp2p_icp
{
namespace
{
using Eigen::Vector3d;

void add_border(PackedPoints& out, const fitted_plane_t& plane, const Vector3d& centre, double square_size)
{
    const Vector3d n = plane.normal().normalized(), c = to_eigen(plane.centroid) - centre;
    const double half = 0.5 * square_size;
    const bool fitted = plane.fit && plane.fit->is_sound();
    const Vector3d u = fitted ? plane.fit->axis_u : n.unitOrthogonal(), v = n.cross(u);
    const double u0 = fitted ? plane.fit->u_min : -half, u1 = fitted ? plane.fit->u_max : half,
                 v0 = fitted ? plane.fit->v_min : -half, v1 = fitted ? plane.fit->v_max : half;
    const Vector3d a = c + u * u0 + v * v0, b = c + u * u1 + v * v0, d = c + u * u1 + v * v1,
                   e = c + u * u0 + v * v1;
    out.add(a, b, b, d, d, e, e, a);
}

/// From `from` to `to`, with a head of four strokes.
void add_arrow(PackedPoints& out, const Vector3d& from, const Vector3d& to, double head)
{
    const Vector3d along = (to - from).normalized(), side = along.unitOrthogonal(), up = along.cross(side);
    out.add(from, to);
    for (const Vector3d& across : {side, Vector3d(-side), up, Vector3d(-up)})
        out.add(to, Vector3d(to - along * head + across * (0.4 * head)));
}

/// Most of a circle around the axis, with a head at its end.
void add_turning_arrow(PackedPoints& out, const Vector3d& centre, const Vector3d& axis, double radius,
                       double head)
{
    constexpr int PIECES = 36;
    constexpr double ANGLE = 1.6 * M_PI;
    const Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
    const auto at = [&](int i)
    {
        const double angle = ANGLE * i / PIECES;
        return Vector3d(centre + (u * std::cos(angle) + v * std::sin(angle)) * radius);
    };
    for (int i = 0; i + 1 < PIECES; i++) out.add(at(i), at(i + 1));
    add_arrow(out, at(PIECES - 1), at(PIECES), head);
}
}  // namespace

PackedPoints border_segments(const std::vector<fitted_plane_t>& planes, const Vector3d& centre,
                             double square_size)
{
    PackedPoints out;
    for (const auto& plane : planes) add_border(out, plane, centre, square_size);
    return out;
}

PackedPoints line_segments(const std::vector<fitted_line_t>& lines, const Vector3d& centre,
                           double piece_length)
{
    PackedPoints out;
    for (const auto& line : lines)
    {
        const Vector3d base = to_eigen(line.pBase) - centre, along = to_eigen(line.director).normalized();
        const bool fitted = line.fit && line.fit->is_sound();
        const double begin = fitted ? line.fit->begin : -0.5 * piece_length,
                     end = fitted ? line.fit->end : 0.5 * piece_length;
        out.add(Vector3d(base + along * begin), Vector3d(base + along * end));
    }
    return out;
}

MotionArrow motion_arrow(const FreeTwist& twist, double size)
{
    MotionArrow out;
    const Vector3d axis = to_eigen(twist.axis).normalized();
    const bool translates = twist.kind != FreeTwist::Kind::Rotation,
               rotates = twist.kind != FreeTwist::Kind::Translation;
    const double head = 0.12 * size;
    Vector3d middle = Vector3d::Zero();
    if (rotates)
    {
        middle = to_eigen(twist.through);
        middle -= axis * axis.dot(middle);  // where the axis is nearest
        out.segments.add(Vector3d(middle - axis * size), Vector3d(middle + axis * size));
        add_turning_arrow(out.segments, middle, axis, 0.4 * size, head);
    }
    if (translates)
        for (const double sign : {-1.0, 1.0})
            add_arrow(out.segments, middle, middle + axis * (sign * size), head);
    out.label_at = middle + axis * (1.08 * size);
    return out;
}

}  // namespace mp2p_icp
