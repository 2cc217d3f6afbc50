#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/** The whole of icp-log-viewer, as its arguments (without the program's name) say: pictures of logs or of a
 * map, or the window. Never throws: every trouble is one line on `err`. \return 0, or 1 for wrong usage or
 * input, an output that cannot be written, or a window without a display.
 */
int icp_log_viewer(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) noexcept;

}  // namespace mp2p_icp_apps
