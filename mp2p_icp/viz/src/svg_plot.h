#pragma once

#include <string>
#include <vector>

namespace mp2p_icp
{
/** \file svg_plot.h Small plots as inline SVG in a <figure>, coloured by the classes of the page's style.
 * Titles and names are plain text; they are escaped here.
 */

struct PlotPoint
{
    double x = 0, y = 0;
};

struct PlotSeries
{
    std::string name;
    std::string css_class;  ///< whose variable --c is the colour
    std::string unit;       ///< of y, for tips
    std::vector<PlotPoint> points;
};

enum class PlotScale
{
    Linear,      ///< from 0
    Logarithmic  ///< what is not above 0 is left out; what is less than 1e-9 of the largest lies on the
                 ///< border
};

/** Lines over whole x (iterations), with a mark that the script moves. What is not finite is left out. A text
 * instead of the plot if nothing is left.
 */
std::string line_plot(const std::string& title, const std::vector<PlotSeries>& series, PlotScale scale);

/// Bars on top of each other.
struct BarSeries
{
    std::string name;
    std::string css_class;
    std::vector<size_t> counts;  ///< one for each bin; the same number in all series
};

/// Over bins of the same width, from 0 to `upper`.
std::string bar_plot(const std::string& title, const std::string& note, const std::vector<BarSeries>& series,
                     double upper, const std::string& unit);

}  // namespace mp2p_icp
