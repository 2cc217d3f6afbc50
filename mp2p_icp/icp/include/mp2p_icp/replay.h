#pragma once

#include <mp2p_icp/LogRecord.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
/// What came of running a logged alignment again.
struct ReplayOutcome
{
    /// To the last bit where library, MRPT, compiler and processor are those of the log; on others to 1e-9 (m
    /// and rad), with the same verdict.
    bool same = false;
    bool identical = false;                ///< to the last bit
    std::string sentence;                  ///< one line: same or different, and by how much
    std::vector<std::string> differences;  ///< what may explain it: versions, processor, parameters, ...
    LogRecord again;                       ///< the log of the second run
};

/** Makes the pipeline of the log again and runs it on the log's maps, guess, prior and parameters. Takes as
 * long as the run did. Never throws for what a log may hold: a run that cannot be repeated is not the same,
 * and the sentence says why. \exception std::invalid_argument if the log lacks a map.
 */
ReplayOutcome replay(const LogRecord& log);

}  // namespace mp2p_icp
