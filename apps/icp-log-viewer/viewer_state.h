#pragma once

#include <string>

namespace mp2p_icp_apps
{
/// What the window remembers of a user.
struct ViewerState
{
    int width = 1280, height = 800;  ///< of the window, pixels
    float point_size = 3;            ///< pixels
    std::string color = "side";      ///< side, height, residual
    bool pairings = false, frames = true, covariance = false, orthographic = false;
    int tab = 0;
};

/// In $XDG_CONFIG_HOME, else ~/.config; empty if neither is known.
std::string viewer_state_path();

/// Defaults for what the file does not hold, or holds in a way that makes no sense.
ViewerState load_viewer_state(const std::string& path);
/// Makes the folders, too. Returns false if it cannot be written.
bool save_viewer_state(const ViewerState& state, const std::string& path);

}  // namespace mp2p_icp_apps
