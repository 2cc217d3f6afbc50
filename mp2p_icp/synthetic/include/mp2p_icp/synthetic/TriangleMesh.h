#pragma once

#include <mrpt/math/TBoundingBox.h>
#include <mrpt/math/TPoint3D.h>

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <vector>

namespace mp2p_icp::synthetic
{
/// The three corners of a triangle, metres.
struct Triangle
{
    Eigen::Vector3d a, b, c;

    double area() const;
    /// Unit normal, a -> b -> c counter-clockwise seen from its tip; zero for a triangle without area.
    Eigen::Vector3d normal() const;
    /// From a point to the nearest point of the triangle, border and inside.
    double distance_to(const Eigen::Vector3d& point) const;
};

/** Triangles over shared vertices, metres. Nothing is assumed about them: they may be open, cross each
 * other, or have no area. Indices must be below the number of vertices.
 */
struct TriangleMesh
{
    std::vector<mrpt::math::TPoint3D> vertices;
    std::vector<std::array<uint32_t, 3>> triangles;

    size_t size() const { return triangles.size(); }
    Triangle triangle(size_t index) const;

    /// Of all triangles together, m^2.
    double area() const;
    /// Around all vertices that a triangle uses. \exception std::invalid_argument if there is no triangle.
    mrpt::math::TBoundingBox bounding_box() const;

    /// Adds the triangles of another mesh.
    void append(const TriangleMesh& other);
};

}  // namespace mp2p_icp::synthetic
