#pragma once

#include <mp2p_icp/LogRecord.h>

#include <string>

namespace mp2p_icp
{
/// Steps, distance to the end, cost and pairings by iteration, and the residuals of the final pairings.
std::string plots_html(const LogRecord& log);

}  // namespace mp2p_icp
