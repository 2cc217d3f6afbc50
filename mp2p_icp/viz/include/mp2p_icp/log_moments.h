#pragma once

#include <mp2p_icp/LogRecord.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
/// One of the poses that the log of an ICP run knows.
struct LogMoment
{
    enum class Kind : uint8_t
    {
        Guess,      ///< where the run began
        Iteration,  ///< after an iteration
        Rejected,   ///< what was found, and not trusted
        Final       ///< what was returned: the guess again if nothing was found
    };
    Kind kind = Kind::Final;
    size_t iteration = 0;  ///< of Kind::Iteration, from 0

    bool operator==(const LogMoment& o) const { return kind == o.kind && iteration == o.iteration; }
};

/// Such as `guess`, `after iteration 3`, `rejected pose`, `final pose`.
std::string to_string(const LogMoment& moment);

/// All that the log knows, in the order of time: the guess first, the final pose last.
std::vector<LogMoment> log_moments(const LogRecord& log);

/** `guess`, `final`, `rejected`, or the number of an iteration.
 * \exception std::invalid_argument for anything else, and for what the log does not hold; says what it does.
 */
LogMoment moment_from_text(const LogRecord& log, const std::string& text);

/// The pose of the local map in the global one at a moment, in the maps' original coordinates.
/// \exception std::invalid_argument if the log does not hold that moment.
mrpt::poses::CPose3D pose_at(const LogRecord& log, const LogMoment& moment);

/** What was paired in that iteration, or at the end; null for the guess, a rejected pose, and
 * iterations whose details were not logged. \param[out]
 * stored whether their coordinates are those the maps store, or else the original ones.
 */
const Pairings* pairings_at(const LogRecord& log, const LogMoment& moment, bool& stored);

}  // namespace mp2p_icp
