#pragma once

#include <mp2p_icp/LogRecord.h>
#include <mrpt/img/CImage.h>
#include <mrpt/img/TColor.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
/// A picture of a report, with a line of text below it.
struct ReportPicture
{
    std::string caption;
    mrpt::img::CImage image;
};

struct HtmlReportOptions
{
    std::string title = "ICP run";

    /// \name What the page holds at most: with these numbers it stays below 3 MB, pictures not counted
    ///@{
    size_t max_points_per_cloud = 60000;  ///< of the global map, and of the local one
    size_t max_pairings = 6000;           ///< of all iterations together
    ///@}

    std::vector<ReportPicture> pictures;  ///< such as one of each iteration

    mrpt::img::TColor global_color{0x00, 0x72, 0xB2};  ///< as in SnapshotOptions
    mrpt::img::TColor local_color{0xD5, 0x5E, 0x00};
};

/** One HTML page that tells how a run went: the verdict, the poses, and how well they are known; both clouds
 * in a view that turns, with the local one at the guess, at any logged iteration, and at the end; pairings,
 * planes, lines, and motions that are free; steps, cost, pairings and residuals as plots; and the pictures.
 *
 * The page is complete: it needs no network, no other file, no WebGL, and opens from a disk. Of clouds with
 * more points than the options allow, a random subset is drawn (the same for the same log), and the page
 * says so. Layers that are not clouds are left out, and so is what is not finite. Empty maps, logs without
 * iterations and coordinates of any size make a page, too.
 * \exception std::invalid_argument for an empty picture.
 * \exception std::runtime_error if pictures cannot be encoded. Thread-safe. About 0.2 s.
 */
std::string html_report(const LogRecord& log, const HtmlReportOptions& options = {});

/// html_report() into a file. \exception DataError if it cannot be written. Others as html_report().
void save_html_report(const LogRecord& log, const std::string& path, const HtmlReportOptions& options = {});

}  // namespace mp2p_icp
