#pragma once

#include <mp2p_icp/synthetic/TriangleMesh.h>
#include <mrpt/maps/CSimplePointsMap.h>

namespace mp2p_icp::synthetic
{
/** Points drawn independently and uniformly by area from the triangles of a mesh. Two draws with different
 * seeds share no point: as two scans of one surface.
 * \exception std::invalid_argument if the mesh has no area. O(triangles + count log triangles).
 */
mrpt::maps::CSimplePointsMap::Ptr sample_by_area(const TriangleMesh& mesh, size_t count, uint64_t seed);

}  // namespace mp2p_icp::synthetic
