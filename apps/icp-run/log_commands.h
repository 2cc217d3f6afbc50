#pragma once

#include <iosfwd>
#include <string>

#include "icp_run.h"

namespace mp2p_icp_apps
{
/** Runs a logged alignment again, and prints one line: whether the result is the same, or what differs.
 * \return 0 if it is the same, else 1. \exception mp2p_icp::DataError if the log cannot be read.
 */
int replay_log(const std::string& file_name, std::ostream& out);

/// Prints in at most ten lines why a logged alignment ended as it did. \return 0. \exception
/// mp2p_icp::DataError if the log cannot be read.
int explain_log(const std::string& file_name, std::ostream& out);

}  // namespace mp2p_icp_apps
