#include "report_plots.h"

#include <mp2p_icp/run_curves.h>
#include <mrpt/core/bits_math.h>

#include <functional>

#include "html_text.h"
#include "svg_plot.h"

namespace mp2p_icp
{
namespace
{
PlotSeries series_of(const RunCurves& curves, const std::string& name, const char* css_class,
                     const char* unit, const std::function<double(const RunCurvePoint&)>& value)
{
    PlotSeries out{name, css_class, unit, {}};
    for (const auto& point : curves)
        out.points.push_back({static_cast<double>(point.iteration), value(point)});
    return out;
}

std::string distance_plot(const std::string& title, const RunCurves& curves, PoseStep RunCurvePoint::*step)
{
    return line_plot(
        title,
        {series_of(curves, "translation, m", "metres", "m", [&](const auto& p) { return (p.*step).metres; }),
         series_of(curves, "rotation, °", "degrees", "°",
                   [&](const auto& p) { return mrpt::RAD2DEG((p.*step).radians); })},
        PlotScale::Logarithmic);
}

std::string cost_plot(const RunCurves& curves)
{
    return line_plot(
        "Fit to its pairings",
        {series_of(curves, "cost, m²", "cost", "m²", [](const auto& p) { return p.cost; }),
         series_of(curves, "residual rms, m", "rms", "m", [](const auto& p) { return p.rms_residual; })},
        PlotScale::Logarithmic);
}

std::string pairings_plot(const RunCurves& curves)
{
    std::vector<PlotSeries> series;
    for (size_t kind = 0; kind < PAIRING_KIND_COUNT; kind++)
    {
        bool any = false;
        for (const auto& point : curves) any = any || point.pairings[kind] > 0;
        if (any)
            series.push_back(series_of(curves, PAIRING_KIND_NAMES[kind], PAIRING_KIND_NAMES[kind], "pairings",
                                       [&](const auto& p) { return static_cast<double>(p.pairings[kind]); }));
    }
    return line_plot("Number of pairings", series, PlotScale::Linear);
}

std::string histogram_plot(const Results& result)
{
    const auto histogram = residual_histogram(result.finalPairings, result.optimal_tf.mean);
    std::vector<BarSeries> series;
    size_t beyond = 0, not_finite = 0;
    for (size_t kind = 0; kind < PAIRING_KIND_COUNT; kind++)
    {
        const auto& counts = histogram.kinds[kind];
        series.push_back({PAIRING_KIND_NAMES[kind], PAIRING_KIND_NAMES[kind], counts.bins});
        beyond += counts.beyond, not_finite += counts.not_finite;
    }
    const bool small = histogram.upper < 0.5;
    std::string note = std::string("distance, ") + (small ? "mm" : "m");
    if (beyond > 0) note += "; " + count_text(beyond) + " more are farther";
    if (not_finite > 0) note += "; " + count_text(not_finite) + " are not finite";
    return bar_plot("Residuals of the final pairings", note, series, histogram.upper * (small ? 1000 : 1),
                    small ? "mm" : "m");
}
}  // namespace

std::string plots_html(const LogRecord& log)
{
    const RunCurves curves = run_curves(log);
    return "<section class=\"plots\">\n" + distance_plot("Step", curves, &RunCurvePoint::step) +
           distance_plot("Distance to the final pose", curves, &RunCurvePoint::to_final) + cost_plot(curves) +
           pairings_plot(curves) + histogram_plot(log.icpResult) + "</section>\n";
}

}  // namespace mp2p_icp
