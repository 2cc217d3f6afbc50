#pragma once

#include <mp2p_icp/metricmap.h>

#include <memory>
#include <optional>

#include "log_browser.h"
#include "shown_log.h"
#include "viewer_state.h"

namespace mp2p_icp_apps
{
/** What the window shows, without the window: the logs and which of them are on show, or a map; and how they
 * are drawn.
 */
class ViewerModel
{
 public:
    /// \exception as LogBrowser and mp2p_icp::load_map()
    ViewerModel(const ViewerOptions& options, const ViewerState& state);

    LogBrowser* browser() { return browser_ ? &*browser_ : nullptr; }  ///< null for a map
    ShownLog& first() { return *first_; }
    ShownLog* second() { return second_.get(); }  ///< null: one log is shown
    std::vector<mp2p_icp::LogScene*> scenes();

    void go_to_log(long index);  ///< at its final pose
    void step_log(long by);
    void show_second(std::optional<long> index);
    size_t second_index() const { return second_index_; }
    /// Of both logs, as far as they have moments.
    void go_to_moment(long index);
    void play();  ///< to the next moment, or the next log; after the last log the first

    /// To sort and filter, as listing() says. That may take many calls of arrange_some().
    void arrange() { arranging_ = true; }
    /// Goes on with it for about so long; problem() says how far it is, or that no log is left. Returns
    /// whether anything is different now.
    bool arrange_some(double seconds);
    ViewerOptions& listing() { return listing_; }

    mp2p_icp::LogSceneOptions& drawing() { return drawing_; }
    void redraw();  ///< after a change of drawing()

    /// Changes the shown pose of the first log: metres along x, y, z, then degrees of yaw, pitch, roll, added
    /// to those of the moment.
    void set_manual_pose(const std::array<double, 6>& change);

    /// Writes a map of the first log (or the map): `.mm`, or each of its drawn cloud layers as `.ply`, into
    /// the current folder. Returns a sentence that says what was done.
    std::string export_map(bool global, const std::string& suffix);

    std::string problem();  ///< of anything that is on show; empty: none
    std::string title();    ///< of the window

 private:
    std::unique_ptr<ShownLog> read_log(size_t index);

    ViewerOptions listing_;
    mp2p_icp::LogSceneOptions drawing_;
    std::optional<LogBrowser> browser_;
    std::unique_ptr<ShownLog> first_, second_;
    size_t second_index_ = 0;
    bool arranging_ = false;
    std::string problem_;
};

}  // namespace mp2p_icp_apps
