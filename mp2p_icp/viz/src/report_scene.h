#pragma once

#include <mp2p_icp/html_report.h>

#include <string>

namespace mp2p_icp
{
/// How many points of a map there are, and how many of them are drawn.
struct DrawnShare
{
    size_t drawn = 0, finite = 0;
};

/// What the script of the page draws.
struct ReportScene
{
    /** An object of JSON. Coordinates are float, relative to a centre (of the global map for all that stands
     * in its frame, of the local one for all that moves with it), so that they are exact far from the origin,
     * too; the states' poses are between these.
     */
    std::string json;
    DrawnShare global, local;
};

ReportScene report_scene(const LogRecord& log, const HtmlReportOptions& options);

}  // namespace mp2p_icp
