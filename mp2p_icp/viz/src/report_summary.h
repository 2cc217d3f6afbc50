#pragma once

#include <string>

#include "report_scene.h"

namespace mp2p_icp
{
/// The verdict with its reason, and the numbers that matter most.
std::string headline_html(const LogRecord& log);

/// Tables of poses, free motions, pairings, maps and parameters.
std::string tables_html(const LogRecord& log, const ReportScene& scene);

}  // namespace mp2p_icp
