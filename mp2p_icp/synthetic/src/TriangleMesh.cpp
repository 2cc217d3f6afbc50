#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/TriangleMesh.h>

#include <algorithm>
#include <stdexcept>

namespace mp2p_icp::synthetic
{
namespace
{
double distance_to_segment(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
                           const Eigen::Vector3d& to)
{
    const Eigen::Vector3d along = to - from;
    const double length_sq = along.squaredNorm();
    const double s = length_sq > 0 ? std::clamp((point - from).dot(along) / length_sq, 0.0, 1.0) : 0.0;
    return (point - from - s * along).norm();
}
}  // namespace

double Triangle::area() const
{
    return 0.5 * (b - a).cross(c - a).norm();
}

Eigen::Vector3d Triangle::normal() const
{
    const Eigen::Vector3d n = (b - a).cross(c - a);
    const double length = n.norm();
    return length > 0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

double Triangle::distance_to(const Eigen::Vector3d& point) const
{
    const Eigen::Vector3d n = normal();
    // The foot on the plane is inside if it is on the same side of all three edges.
    const auto inside_of = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to)
    { return n.dot((to - from).cross(point - from)) >= 0; };
    if (n != Eigen::Vector3d::Zero() && inside_of(a, b) && inside_of(b, c) && inside_of(c, a))
        return std::abs(n.dot(point - a));
    return std::min({distance_to_segment(point, a, b), distance_to_segment(point, b, c),
                     distance_to_segment(point, c, a)});
}

Triangle TriangleMesh::triangle(size_t index) const
{
    const auto& t = triangles.at(index);
    return {to_eigen(vertices.at(t[0])), to_eigen(vertices.at(t[1])), to_eigen(vertices.at(t[2]))};
}

double TriangleMesh::area() const
{
    double sum = 0;
    for (size_t i = 0; i < size(); i++) sum += triangle(i).area();
    return sum;
}

mrpt::math::TBoundingBox TriangleMesh::bounding_box() const
{
    if (triangles.empty())
        throw std::invalid_argument("TriangleMesh::bounding_box: the mesh must have a triangle");
    auto box = mrpt::math::TBoundingBox::PlusMinusInfinity();
    for (const auto& t : triangles)
        for (const uint32_t v : t) box.updateWithPoint(vertices.at(v));
    return box;
}

void TriangleMesh::append(const TriangleMesh& other)
{
    const auto shift = static_cast<uint32_t>(vertices.size());
    vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const auto& t : other.triangles) triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
}

}  // namespace mp2p_icp::synthetic
