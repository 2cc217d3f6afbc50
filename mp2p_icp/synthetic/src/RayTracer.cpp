#include <mp2p_icp/synthetic/RayTracer.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mp2p_icp::synthetic
{
using Eigen::Vector3d;

namespace
{
constexpr size_t LEAF_SIZE = 4;
constexpr double BORDER =
    1e-12;  // barycentric: rays that rounding puts beside a shared edge hit one of its triangles

/// Range at which a ray meets a triangle (Moeller and Trumbore, 1997).
std::optional<double> range_to(const Triangle& t, const Vector3d& origin, const Vector3d& direction)
{
    const Vector3d ab = t.b - t.a, ac = t.c - t.a, p = direction.cross(ac);
    const double determinant = ab.dot(p);
    if (determinant == 0) return std::nullopt;  // parallel, or a triangle without area
    const Vector3d from_a = origin - t.a;
    const double u = from_a.dot(p) / determinant;
    if (!(u >= -BORDER && u <= 1 + BORDER)) return std::nullopt;
    const Vector3d q = from_a.cross(ab);
    const double v = direction.dot(q) / determinant;
    if (!(v >= -BORDER && u + v <= 1 + BORDER)) return std::nullopt;
    const double range = ac.dot(q) / determinant;
    if (!(range >= 0)) return std::nullopt;
    return range;
}

/// Does the ray meet the box within [0, max_range]?
bool meets_box(const Vector3d& lo, const Vector3d& hi, const Vector3d& origin, const Vector3d& direction,
               double max_range)
{
    double enter = 0, leave = max_range;
    for (int axis = 0; axis < 3; axis++)
    {
        if (direction[axis] == 0)
        {
            if (origin[axis] < lo[axis] || origin[axis] > hi[axis]) return false;
            continue;
        }
        const double a = (lo[axis] - origin[axis]) / direction[axis],
                     b = (hi[axis] - origin[axis]) / direction[axis];
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave;
}

Vector3d centroid(const Triangle& t)
{
    return (t.a + t.b + t.c) / 3;
}
}  // namespace

RayTracer::RayTracer(const TriangleMesh& mesh) : order_(mesh.size())
{
    triangles_.reserve(mesh.size());
    for (size_t i = 0; i < mesh.size(); i++) triangles_.push_back(mesh.triangle(i));
    std::iota(order_.begin(), order_.end(), 0u);
    if (!order_.empty()) build(0, order_.size());
}

void RayTracer::build(size_t first, size_t last)
{
    const size_t self = nodes_.size();
    nodes_.emplace_back();
    Vector3d lo = triangles_[order_[first]].a, hi = lo;
    Vector3d centroid_lo = centroid(triangles_[order_[first]]), centroid_hi = centroid_lo;
    for (size_t i = first; i < last; i++)
    {
        const Triangle& t = triangles_[order_[i]];
        lo = lo.cwiseMin(t.a).cwiseMin(t.b).cwiseMin(t.c);
        hi = hi.cwiseMax(t.a).cwiseMax(t.b).cwiseMax(t.c);
        centroid_lo = centroid_lo.cwiseMin(centroid(t));
        centroid_hi = centroid_hi.cwiseMax(centroid(t));
    }
    // Boxes grow a little, so that what range_to() accepts on the border of a triangle is never outside its
    // box.
    const Vector3d rounding =
        Vector3d::Constant(1e-9 * (1 + std::max(lo.cwiseAbs().maxCoeff(), hi.cwiseAbs().maxCoeff())));
    nodes_[self].lo = lo - rounding;
    nodes_[self].hi = hi + rounding;
    if (last - first <= LEAF_SIZE)
    {
        nodes_[self].first = static_cast<uint32_t>(first);
        nodes_[self].count = static_cast<uint32_t>(last - first);
        return;
    }
    int axis = 0;
    (centroid_hi - centroid_lo).maxCoeff(&axis);
    const size_t middle = (first + last) / 2;
    const auto at = [this](size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(first), at(middle), at(last),
                     [&](uint32_t i, uint32_t j)
                     { return centroid(triangles_[i])[axis] < centroid(triangles_[j])[axis]; });
    build(first, middle);
    nodes_[self].first = static_cast<uint32_t>(nodes_.size());
    build(middle, last);
}

std::optional<RayTracer::Hit> RayTracer::first_hit(const Vector3d& origin, const Vector3d& direction,
                                                   double max_range) const
{
    std::optional<Hit> best;
    double limit = max_range;
    std::array<uint32_t, 64> pending;  // halving 2^32 triangles needs no more
    size_t count = 0;
    if (!nodes_.empty()) pending[count++] = 0;
    while (count > 0)
    {
        const uint32_t index = pending[--count];
        const Node& node = nodes_[index];
        if (!meets_box(node.lo, node.hi, origin, direction, limit)) continue;
        if (node.count == 0)
        {
            pending[count++] = node.first;
            pending[count++] = index + 1;
        }
        for (uint32_t i = 0; i < node.count; i++)
        {
            const uint32_t triangle = order_[node.first + i];
            const auto range = range_to(triangles_[triangle], origin, direction);
            if (!range || *range > limit) continue;
            best = Hit{*range, triangle};
            limit = *range;
        }
    }
    return best;
}

}  // namespace mp2p_icp::synthetic
