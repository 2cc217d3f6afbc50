#pragma once

#include <string>
#include <vector>

#include "statistics.h"

namespace mp2p_icp_apps::experiments
{
/** \file What the plotting script draws. It gets numbers that are ready to be drawn: all statistics are made
 * here, none there.
 */

/// How a series looks, wherever it is drawn.
struct SeriesStyle
{
    std::string id, label;
    std::string color;   ///< of Okabe and Ito's palette, safe for the colour-blind
    std::string marker;  ///< of matplotlib
    bool dashed = false;
};
/// \exception std::logic_error for an id that has none. Ids are those of PoseMethod, and `bound`.
SeriesStyle style_of(const std::string& id, const std::string& label);

/// A box: quartiles and median, whiskers to 5 and 95 % of the runs, a diamond for the RMSE.
struct Box
{
    double x = 0;  ///< index of the category
    Statistics statistics;
};
struct BoxSeries
{
    std::string style;
    std::vector<Box> boxes;
};
/// A line through points, with a band if `low` and `high` are given.
struct LineSeries
{
    std::string style;
    std::vector<double> x, y, low, high;
};

struct Panel
{
    std::string title, x_label, y_label;  ///< labels with units
    std::string x_scale = "category";     ///< category, linear or log
    std::string y_scale = "log";
    std::vector<std::string> categories;  ///< may have two lines
    std::vector<BoxSeries> boxes;
    std::vector<LineSeries> lines;
    double y_from = 0, y_to = 0;  ///< limits; equal: from the data
    std::string note;             ///< one short line under the title
};

/// Panels row by row, and one legend above them: it covers none.
struct Figure
{
    std::string name;  ///< of its files, without suffix
    std::string title;
    size_t columns = 2;
    std::vector<SeriesStyle> legend;  ///< all styles that occur
    std::vector<Panel> panels;
};

/// For the script, with all numbers that are not finite as null.
std::string figures_json(const std::vector<Figure>& figures);

}  // namespace mp2p_icp_apps::experiments
