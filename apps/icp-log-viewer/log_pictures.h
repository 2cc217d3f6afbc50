#pragma once

#include <iosfwd>

#include "viewer_options.h"

namespace mp2p_icp_apps
{
/** The pictures and pages that were asked for: of a map, of one log, or, with several logs, one picture (or
 * folder) per log, beside each other, its name added. Says on `out` what was written. \exception
 * mp2p_icp::DataError, std::invalid_argument, std::runtime_error as mp2p_icp::draw_log().
 */
void write_pictures(const ViewerOptions& options, std::ostream& out);

}  // namespace mp2p_icp_apps
