#pragma once

#include <mp2p_icp/LogRecord.h>

#include <memory>
#include <string>
#include <vector>

#include "viewer_options.h"

namespace mp2p_icp_apps
{
/// What the list of logs shows of one, without its maps and pairings.
struct LogSummary
{
    std::string path;
    mp2p_icp::Verdict verdict = mp2p_icp::Verdict::failed;
    double quality = 0;
    std::string problem;  ///< why it cannot be read; empty if it can, as far as is known
    bool known = false;   ///< else nothing was read yet
};

/// The `.icplog` files (also `.icplog.gz`) among the paths and in the folders among them, sorted by name.
/// \exception mp2p_icp::DataError for a path that is not there, or a folder without a log.
std::vector<std::string> find_logs(const std::vector<std::string>& paths);

/// Is it a map, to be shown alone? Decided by the suffix: .mm, also .gz.
bool is_map_path(const std::string& path);

mp2p_icp::LogRecord::Ptr load_log(const std::string& path);  ///< \exception mp2p_icp::DataError
LogSummary summary_of(const std::string& path);              ///< from its first bytes; never throws

/** Those that the options ask for, in their order. A log that cannot be read stays, last, unless a verdict or
 * a quality is asked for.
 */
std::vector<LogSummary> sorted_and_filtered(std::vector<LogSummary> logs, const ViewerOptions& options);

}  // namespace mp2p_icp_apps
