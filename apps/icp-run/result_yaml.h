#pragma once

#include <mp2p_icp/Results.h>
#include <mp2p_icp/load_map.h>
#include <mrpt/poses/CPose3D.h>

#include <optional>
#include <string>

namespace mp2p_icp_apps
{
/// How far a pose is from the true one.
struct PoseError
{
    double translation_m = 0;  ///< between the places where both poses put the local cloud's stored origin
    double rotation_deg = 0;   ///< 0..180
};
/** \param local_offset coordinate_offset() of the local map: the stored origin. Zero: the error is that of
 * the poses' translations; far from zero, these would mostly show the lever arm of the rotation's error.
 */
PoseError pose_error(const mrpt::poses::CPose3D& pose, const mrpt::poses::CPose3D& truth,
                     const mrpt::math::TPoint3D& local_offset);

/// Wall-clock times, s.
struct StageTimes
{
    double load = 0, filters = 0, align = 0, total = 0;
};

/// What is told about one input.
struct InputSummary
{
    mp2p_icp::LoadReport report;
    uint64_t points_used = 0;  ///< by the matchers
};

/// One alignment, as it is reported.
struct AlignmentRecord
{
    mp2p_icp::Results results;
    InputSummary local, global;
    StageTimes time_s;
    std::optional<PoseError> error;
};

/** The result file of icp-run; docs/formats.md has its keys. Doubles have 17 significant digits, so that they
 * read back with the same bits; `.inf` where infinite. The same record gives the same bytes, in any locale.
 */
std::string result_yaml(const AlignmentRecord& record);

}  // namespace mp2p_icp_apps
