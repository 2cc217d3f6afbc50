#pragma once

#include <iosfwd>

#include "viewer_options.h"

namespace mp2p_icp_apps
{
/** Opens the window and returns when it is closed; prints then how fast it was drawn. Remembers its settings
 * (viewer_state.h). \exception std::runtime_error without a display (naming --snapshot), and as ViewerModel.
 */
void open_viewer_window(const ViewerOptions& options, std::ostream& out);

}  // namespace mp2p_icp_apps
