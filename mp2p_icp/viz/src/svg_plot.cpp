#include "svg_plot.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "html_text.h"

namespace mp2p_icp
{
namespace
{
constexpr double WIDTH = 440, HEIGHT = 230, LEFT = 50, RIGHT = 14, TOP = 10, BOTTOM = 26;
constexpr double LOWEST_SHARE = 1e-9;  // of the largest value, that a logarithmic plot shows

std::string px(double value)
{
    return fixed_text(value, 1);
}

/// Where data lie in the picture.
struct PlotFrame
{
    double x0 = 0, x1 = 1, y0 = 0, y1 = 1;  ///< y0, y1: logarithms if logarithmic
    bool logarithmic = false;

    double x(double value) const { return LEFT + (value - x0) / (x1 - x0) * (WIDTH - LEFT - RIGHT); }
    double y(double value) const
    {
        const double v = std::clamp(logarithmic ? std::log10(value) : value, y0, y1);
        return HEIGHT - BOTTOM - (v - y0) / (y1 - y0) * (HEIGHT - TOP - BOTTOM);
    }
};

/// Round numbers (1, 2 or 5 times a power of ten apart, at least `least`) from 0 or lo to hi.
std::vector<double> round_ticks(double lo, double hi, int wanted, double least = 0)
{
    const double rough = std::max((hi - lo) / wanted, least);
    const double power = std::pow(10, std::floor(std::log10(rough)));
    const double in_powers = rough / power;
    const double step = power * (in_powers <= 1 ? 1 : in_powers <= 2 ? 2 : in_powers <= 5 ? 5 : 10);
    std::vector<double> ticks;
    for (int i = 0; i < 20; i++)
        if (const double tick = (std::ceil(lo / step - 1e-9) + i) * step; tick <= hi + 1e-9 * step)
            ticks.push_back(tick);
    return ticks;
}

std::vector<double> decade_ticks(double log_lo, double log_hi)
{
    std::vector<double> ticks;
    const int every = std::max(1, static_cast<int>(std::ceil((log_hi - log_lo) / 6)));
    for (int decade = static_cast<int>(std::floor(log_lo)); decade <= log_hi; decade++)
        for (const int digit : {1, 2, 5})
        {
            const double tick = digit * std::pow(10, decade), log = std::log10(tick);
            const bool wanted = digit == 1 ? decade % every == 0 : log_hi - log_lo < 1.5;
            if (wanted && log >= log_lo - 1e-9 && log <= log_hi + 1e-9) ticks.push_back(tick);
        }
    return ticks.size() >= 2 ? ticks : round_ticks(std::pow(10, log_lo), std::pow(10, log_hi), 4);
}

/// Such as 20000, 0.05 or 1e-8.
std::string tick_text(double tick)
{
    const double size = std::abs(tick);
    if (size == 0 || (size >= 1e-4 && size < 1e6)) return rounded_text(tick, 7);
    const double exponent = std::floor(std::log10(size) + 1e-9);
    return rounded_text(tick / std::pow(10, exponent), 3) + "e" + fixed_text(exponent, 0);
}

std::string text_at(double x, double y, const char* anchor, const std::string& text)
{
    return "<text x=\"" + px(x) + "\" y=\"" + px(y) + "\" text-anchor=\"" + anchor + "\">" +
           html_escaped(text) + "</text>";
}

std::string line_from(double x0, double y0, double x1, double y1, const char* css_class)
{
    return std::string("<line class=\"") + css_class + "\" x1=\"" + px(x0) + "\" y1=\"" + px(y0) +
           "\" x2=\"" + px(x1) + "\" y2=\"" + px(y1) + "\"/>";
}

std::string axes(const PlotFrame& frame, const std::vector<double>& x_ticks,
                 const std::vector<double>& y_ticks)
{
    std::string out;
    for (const double tick : y_ticks)
        out += line_from(LEFT, frame.y(tick), WIDTH - RIGHT, frame.y(tick), "grid") +
               text_at(LEFT - 6, frame.y(tick) + 4, "end", tick_text(tick));
    for (const double tick : x_ticks) out += text_at(frame.x(tick), HEIGHT - 8, "middle", tick_text(tick));
    return out + line_from(LEFT, HEIGHT - BOTTOM, WIDTH - RIGHT, HEIGHT - BOTTOM, "axis");
}

template <class Series>
std::string legend_of(const std::vector<Series>& series)
{
    std::string out = "<div class=\"legend\">";
    for (const auto& s : series)
        out += "<span class=\"" + s.css_class + "\"><i></i>" + html_escaped(s.name) + "</span>";
    return out + "</div>";
}

std::string figure(const std::string& title, const std::string& legend, const std::string& attributes,
                   const std::string& content)
{
    return "<figure class=\"plot\"><figcaption>" + html_escaped(title) + "</figcaption>" + legend +
           "<svg viewBox=\"0 0 " + px(WIDTH) + " " + px(HEIGHT) + "\" role=\"img\" aria-label=\"" +
           html_escaped(title) + "\"" + attributes + ">" + content + "</svg></figure>\n";
}

std::string figure_without_data(const std::string& title, const std::string& why)
{
    return "<figure class=\"plot\"><figcaption>" + html_escaped(title) + "</figcaption><p class=\"none\">" +
           html_escaped(why) + "</p></figure>\n";
}

bool is_drawable(const PlotPoint& p, PlotScale scale)
{
    constexpr double LARGEST = 1e300;  // leaves room for margins
    return std::isfinite(p.x) && std::abs(p.y) < LARGEST && (scale == PlotScale::Linear || p.y > 0);
}

template <class Unwanted>
void remove_points(std::vector<PlotSeries>& series, const Unwanted& unwanted)
{
    for (auto& s : series)
        s.points.erase(std::remove_if(s.points.begin(), s.points.end(), unwanted), s.points.end());
}

/// The series with drawable points alone.
std::vector<PlotSeries> drawable(std::vector<PlotSeries> series, PlotScale scale)
{
    remove_points(series, [&](const PlotPoint& p) { return !is_drawable(p, scale); });
    double largest = 0;
    for (const auto& s : series)
        for (const auto& p : s.points) largest = std::max(largest, p.y);
    if (scale == PlotScale::Logarithmic)
        remove_points(series, [&](const PlotPoint& p) { return p.y < LOWEST_SHARE * largest; });
    series.erase(std::remove_if(series.begin(), series.end(), [](const auto& s) { return s.points.empty(); }),
                 series.end());
    return series;
}

PlotFrame frame_of(const std::vector<PlotSeries>& series, PlotScale scale)
{
    constexpr double INF = std::numeric_limits<double>::infinity();
    double x0 = INF, x1 = -INF, y0 = INF, y1 = -INF;
    for (const auto& s : series)
        for (const auto& p : s.points)
            x0 = std::min(x0, p.x), x1 = std::max(x1, p.x), y0 = std::min(y0, p.y), y1 = std::max(y1, p.y);
    PlotFrame frame;
    frame.x0 = x0, frame.x1 = x1 > x0 ? x1 : x0 + 1;
    frame.logarithmic = scale == PlotScale::Logarithmic;
    if (!frame.logarithmic)
    {
        frame.y1 = y1 > 0 ? 1.05 * y1 : 1;
        return frame;
    }
    const double lo = std::log10(y0), hi = std::log10(y1);
    const double margin = std::max(0.05 * (hi - lo), 0.1);
    frame.y0 = lo - margin, frame.y1 = hi + margin;
    return frame;
}

std::string curve(const PlotSeries& series, const PlotFrame& frame)
{
    std::string path, dots;
    for (const auto& p : series.points)
    {
        const std::string x = px(frame.x(p.x)), y = px(frame.y(p.y));
        path += (path.empty() ? "M" : "L") + x + " " + y;
        dots += "<circle cx=\"" + x + "\" cy=\"" + y + "\" r=\"2.6\"><title>" +
                html_escaped("iteration " + rounded_text(p.x, 9) + ": " + rounded_text(p.y, 4) +
                             (series.unit.empty() ? "" : " " + series.unit)) +
                "</title></circle>";
    }
    return "<g class=\"" + series.css_class + "\"><path d=\"" + path + "\"/>" + dots + "</g>";
}
}  // namespace

std::string line_plot(const std::string& title, const std::vector<PlotSeries>& all, PlotScale scale)
{
    const auto series = drawable(all, scale);
    if (series.empty()) return figure_without_data(title, "nothing was logged");
    const PlotFrame frame = frame_of(series, scale);
    std::string content =
        axes(frame, round_ticks(frame.x0, frame.x1, 8, 1),
             frame.logarithmic ? decade_ticks(frame.y0, frame.y1) : round_ticks(0, frame.y1, 5, 1));
    content += line_from(LEFT, TOP, LEFT, HEIGHT - BOTTOM, "now");
    for (const auto& s : series) content += curve(s, frame);
    // Where the script finds an iteration.
    const std::string mapping =
        " data-at0=\"" + px(frame.x(0)) + "\" data-step=\"" + rounded_text(frame.x(1) - frame.x(0), 9) + "\"";
    return figure(title, legend_of(series), mapping, content);
}

std::string bar_plot(const std::string& title, const std::string& note, const std::vector<BarSeries>& all,
                     double upper, const std::string& unit)
{
    std::vector<BarSeries> series;
    std::vector<size_t> sums;
    for (const auto& s : all)
    {
        if (std::all_of(s.counts.begin(), s.counts.end(), [](size_t n) { return n == 0; })) continue;
        series.push_back(s);
        sums.resize(s.counts.size(), 0);
        for (size_t bin = 0; bin < sums.size(); bin++) sums[bin] += s.counts[bin];
    }
    if (series.empty()) return figure_without_data(title, "there are no pairings");

    PlotFrame frame;
    frame.x1 = upper > 0 ? upper : 1;
    frame.y1 = 1.05 * static_cast<double>(*std::max_element(sums.begin(), sums.end()));
    std::string content = axes(frame, round_ticks(0, frame.x1, 6), round_ticks(0, frame.y1, 5, 1));
    std::vector<size_t> below(sums.size(), 0);
    const double width = frame.x1 / static_cast<double>(sums.size());
    for (const auto& s : series)
    {
        content += "<g class=\"" + s.css_class + " bars\">";
        for (size_t bin = 0; bin < sums.size(); bin++)
        {
            if (s.counts[bin] == 0) continue;
            const double from = width * static_cast<double>(bin), to = from + width;
            const double y0 = frame.y(static_cast<double>(below[bin]));
            below[bin] += s.counts[bin];
            const double y1 = frame.y(static_cast<double>(below[bin]));
            content += "<rect x=\"" + px(frame.x(from) + 0.4) + "\" y=\"" + px(y1) + "\" width=\"" +
                       px(frame.x(to) - frame.x(from) - 0.8) + "\" height=\"" + px(y0 - y1) + "\"><title>" +
                       html_escaped(rounded_text(from, 3) + " to " + rounded_text(to, 3) + " " + unit + ": " +
                                    count_text(s.counts[bin]) + " " + s.name) +
                       "</title></rect>";
        }
        content += "</g>";
    }
    const std::string legend = legend_of(series) + "<p class=\"note\">" + html_escaped(note) + "</p>";
    return figure(title, legend, "", content);
}

}  // namespace mp2p_icp
