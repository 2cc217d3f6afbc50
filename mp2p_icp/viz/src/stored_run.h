#pragma once

#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/map_offsets.h>

namespace mp2p_icp
{
/** A logged run in the coordinates in which its maps are stored, where it happened. The poses and pairings of
 * the iterations are logged in these; what was given and returned, in the original ones.
 */
struct StoredRun
{
    metric_map_t::ConstPtr global, local;  ///< never null: empty where the log has none
    MapOffsets offsets;
    mrpt::poses::CPose3D guess;
    mrpt::poses::CPose3D end;  ///< where the iterations ended, also if the verdict rejects it

    explicit StoredRun(const LogRecord& log);
};

}  // namespace mp2p_icp
