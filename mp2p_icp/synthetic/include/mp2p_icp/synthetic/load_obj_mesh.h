#pragma once

#include <mp2p_icp/synthetic/TriangleMesh.h>

#include <istream>
#include <string>

namespace mp2p_icp::synthetic
{
/** Reads vertices and faces of a Wavefront OBJ file: corners as `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted
 * from 1, or from the last vertex so far if negative; lines continued by a backslash. Polygons become fans
 * of triangles (right for convex ones). Everything else in the file (normals, textures, groups, materials)
 * is skipped.
 * \exception DataError if the file cannot be read, holds no face, or has a bad line: names the line.
 */
TriangleMesh load_obj_mesh(const std::string& path);

/// \overload `source` is the name used in messages.
TriangleMesh read_obj_mesh(std::istream& in, const std::string& source);

/// A mesh around its middle, so that turning it does not move it away.
struct ObjectMesh
{
    TriangleMesh mesh;
    double size = 0;  ///< the longest side of its bounding box, m
};
/// As load_obj_mesh(), moved so that the middle of its bounding box is the origin.
ObjectMesh load_object_mesh(const std::string& path);

}  // namespace mp2p_icp::synthetic
