#pragma once

#include <mp2p_icp/diagnosis.h>

#include "map_fit.h"

namespace mp2p_icp
{
/// How a run was started, and where it ended; stored coordinates.
struct RunEnds
{
    mrpt::poses::CPose3D guess, found;
    double first_gate = 0, last_gate = 0;  ///< matching distances, m; infinite: none
    bool trusted = false;                  ///< the verdict is `aligned`
    bool ran_out = false;                  ///< of iterations, while it was still moving
};

/** Tries alternatives to what a run found, and fills the overlap and the better pose of `out`. See
 * diagnosis.cpp. Of the causes, NoOverlap and DifferentPlaces are left to the caller: Unknown.
 */
DiagnosisCause search_cause(const MapFit& maps, const RunEnds& run, Diagnosis& out);

}  // namespace mp2p_icp
