#include "plane_overlap.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace mp2p_icp
{
using Eigen::Vector2d;
using Eigen::Vector3d;

PlaneBox box_of(const Vector3d& centroid, const Vector3d& normal, const plane_fit_t& fit)
{
    PlaneBox box{centroid, fit.axis_u, normal.cross(fit.axis_u), {}};
    const double u[4] = {fit.u_min, fit.u_max, fit.u_max, fit.u_min},
                 v[4] = {fit.v_min, fit.v_min, fit.v_max, fit.v_max};
    for (size_t i = 0; i < 4; i++) box.corners[i] = centroid + u[i] * box.axis_u + v[i] * box.axis_v;
    return box;
}

namespace
{
using Polygon = std::vector<Vector2d>;

Polygon projected(const PlaneBox& box, const PlaneBox& into)
{
    Polygon p;
    for (const auto& corner : box.corners)
        p.emplace_back(into.axis_u.dot(corner - into.centroid), into.axis_v.dot(corner - into.centroid));
    return p;
}

double area(const Polygon& p)
{
    double twice = 0;
    for (size_t i = 0; i < p.size(); i++)
    {
        const Vector2d &a = p[i], &b = p[(i + 1) % p.size()];
        twice += a.x() * b.y() - a.y() * b.x();
    }
    return std::abs(twice) / 2;
}

/// The part of the polygon left of the line from a to b (I. Sutherland, G. Hodgman, "Reentrant polygon
/// clipping", CACM 17(1), 1974).
Polygon left_of(const Vector2d& a, const Vector2d& b, const Polygon& polygon)
{
    const auto side = [&](const Vector2d& p)
    { return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x()); };
    Polygon out;
    for (size_t i = 0; i < polygon.size(); i++)
    {
        const Vector2d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        const double at_p = side(p), at_q = side(q);
        if (at_p >= 0) out.push_back(p);
        if ((at_p < 0) != (at_q < 0)) out.push_back(p + (q - p) * (at_p / (at_p - at_q)));
    }
    return out;
}
}  // namespace

double shared_area(const PlaneBox& a, const PlaneBox& b)
{
    const Polygon of_a = projected(a, a), of_b = projected(b, a);
    Polygon shared = of_b;
    for (size_t i = 0; i < 4 && !shared.empty(); i++) shared = left_of(of_a[i], of_a[(i + 1) % 4], shared);
    const double smaller = std::min(area(of_a), area(of_b));
    return smaller > 0 ? area(shared) / smaller : 0;
}

}  // namespace mp2p_icp
