#pragma once

#include <mp2p_icp/synthetic/TriangleMesh.h>

#include <istream>
#include <string>

namespace mp2p_icp::synthetic
{
/** Reads the vertices and faces of a PLY file (ascii, binary little and big endian). Polygons become fans of
 * triangles (right for convex ones). Everything else in the file is skipped.
 * \exception DataError if the file cannot be read, ends early, holds no face, has a vertex that is not finite
 * or a face of a vertex that is not there.
 */
TriangleMesh load_ply_mesh(const std::string& path);

/// \overload `source` is the name used in messages.
TriangleMesh read_ply_mesh(std::istream& in, const std::string& source);

/// A PLY file by load_ply_mesh(), anything else by load_obj_mesh().
TriangleMesh load_mesh(const std::string& path);

}  // namespace mp2p_icp::synthetic
