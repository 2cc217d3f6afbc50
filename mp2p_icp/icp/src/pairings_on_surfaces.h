#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/metricmap.h>
#include <mrpt/poses/CPose3D.h>

#include <map>
#include <vector>

#include "surface_agreement.h"

namespace mp2p_icp
{
/// What pairings say of a pose when points stand for the surfaces on which they lie.
struct SurfacePairings
{
    Pairings pairings;
    Pairings feigned;  ///< the errors of their normals and directions, see ObservabilityParameters::feigned
    /// Of the points that are paired with planes of clouds. Not with the walls of a 2-D scan: two or three
    /// beams in a row, or what was filled in between them, look thinner than the laser's noise.
    std::vector<SurfaceDistance> distances;
    double spacing = 0;  ///< typical distance of neighbours in the widest-spaced of the layers, m
};

/** A point that is paired with a point always fixes three coordinates, so that a corridor would be seen as
 * well along its length as across. Here a pairing with a point (plane, line) of a cloud counts as one with
 * the plane or line that the cloud looks like there (SurfaceScales). Along an edge, it counts as pairings
 * with the planes a little farther away, together as much as one; where there are none either (leaves of a
 * tree), it stays what it is. Where the cloud is too sparse, or bent, to tell, it does not count.
 *
 * Pairs are taken at the local point that would lie exactly over the middle of the surface: else a normal and
 * the place at which it is used would differ, and a tunnel would seem to resist being turned about its axis.
 *
 * Pairings of primitives of the maps are left as they are.
 *
 * \param layers of the global map, those with which points were paired; with the side (m) of the voxels in
 * which their surfaces were seen already, 0 if in none \param pose of local with respect to global, for the
 * pairings. All in stored coordinates.
 */
SurfacePairings pairings_on_surfaces(const Pairings& pairings, const metric_map_t& global,
                                     const std::map<layer_name_t, double>& layers,
                                     const mrpt::poses::CPose3D& pose);

/// Of the clouds of a map, m: the largest typical distance of neighbours, and rms thickness of surfaces.
struct CloudGrain
{
    double spacing = 0, thickness = 0;
};
CloudGrain grain_of(const metric_map_t& map, const std::map<layer_name_t, double>& layers);

}  // namespace mp2p_icp
