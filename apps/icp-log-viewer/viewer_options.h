#pragma once

#include <mp2p_icp/log_snapshot.h>

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/// The command line of icp-log-viewer. Empty texts: not given.
struct ViewerOptions
{
    std::vector<std::string> inputs;  ///< logs, folders of logs, or one map

    std::string sort = "name";  ///< name, quality or verdict
    std::string verdict;        ///< only logs with that one
    double min_quality = 0, max_quality = 1;

    std::string snapshot, snapshot_dir, html;
    std::string iteration = "final";  ///< number, `guess`, `rejected`, `final` or `all`
    std::string view = "fit";
    std::string color = "side";  ///< side, height or residual
    std::string size = "1280x800";
    std::vector<std::string> hide;
    double voxels = 0;         ///< side of cubes, m; 0: points
    std::vector<double> clip;  ///< what is kept before and behind the middle, m; or nothing
    bool pairings = false, frames = false, covariance = false;

    bool wants_pictures() const { return !snapshot.empty() || !snapshot_dir.empty() || !html.empty(); }
    mp2p_icp::LogSnapshotOptions picture() const;             ///< size and view
    void apply_to(mp2p_icp::LogSceneOptions& options) const;  ///< what is drawn, and how
};

/// Empty if help or the version was asked for, and written to `out`. \exception std::invalid_argument
std::optional<ViewerOptions> parse_viewer_options(const std::vector<std::string>& arguments,
                                                  std::ostream& out);

}  // namespace mp2p_icp_apps
