// The plots of ViewerTabs: how the run went, and how the pairings fit.

#include <mp2p_icp/run_curves.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "viewer_tabs.h"

namespace mp2p_icp_apps
{
namespace
{
std::string text(double value, const char* unit)
{
    char number[48];
    std::snprintf(number, sizeof(number), "%.2g %s", value, unit);
    return number;
}

/// Fills a graph from its bottom to its top: values relative to the largest. What is not finite is drawn as
/// 0.
void fill(nanogui::Graph& graph, const std::vector<double>& values)
{
    double largest = 0;
    for (const double v : values)
        if (std::isfinite(v)) largest = std::max(largest, v);
    Eigen::VectorXf heights(static_cast<Eigen::Index>(values.size()));
    for (size_t i = 0; i < values.size(); i++)
        heights(static_cast<Eigen::Index>(i)) =
            largest > 0 && std::isfinite(values[i]) ? static_cast<float>(0.75 * values[i] / largest) : 0.0f;
    graph.setValues(heights);
}

/// Of steps that shrink by orders of magnitude: 0 at the smallest, and one more for each factor of ten.
std::vector<double> decades(const std::vector<double>& values)
{
    double smallest = 0;
    for (const double v : values)
        if (v > 0 && std::isfinite(v)) smallest = smallest > 0 ? std::min(smallest, v) : v;
    std::vector<double> out;
    for (const double v : values) out.push_back(v > 0 && std::isfinite(v) ? std::log10(v / smallest) : 0);
    return out;
}

void show_range(nanogui::Graph& graph, const std::vector<double>& values, const char* unit)
{
    graph.setHeader(values.empty() ? "no iterations were logged"
                                   : text(values.front(), "...") + " " + text(values.back(), unit));
}
}  // namespace

nanogui::Graph* ViewerTabs::add_graph(nanogui::Widget* tab)
{
    auto* graph = new nanogui::Graph(tab, "");
    graph->setFixedSize({width_ - 24, 125});
    graph->setForegroundColor(nanogui::Color(86, 180, 233, 200));
    return graph;
}

void ViewerTabs::make_plots()
{
    auto* tab = add_tab("Plots");
    step_plot_ = add_graph(tab), cost_plot_ = add_graph(tab), histogram_ = add_graph(tab);
    step_plot_->setCaption("step of each iteration (log)");
    cost_plot_->setCaption("cost of each iteration");
}

void ViewerTabs::draw_plots()
{
    std::vector<double> steps, costs;
    if (const auto* log = model_.first().log(); log)
        for (const auto& iteration : log->iterations)
            steps.push_back(iteration.step_trans), costs.push_back(iteration.cost);
    fill(*step_plot_, decades(steps));
    show_range(*step_plot_, steps, "m");
    fill(*cost_plot_, costs);
    show_range(*cost_plot_, costs, "m2");
}

void ViewerTabs::draw_histogram()
{
    const auto& shown = model_.first();
    bool stored = false;
    const auto* pairings =
        shown.log() ? pairings_at(*shown.log(), shown.moments()[shown.moment_index()], stored) : nullptr;
    histogram_->setCaption(pairings ? "residuals" : "residuals: no pairings here");
    histogram_->setHeader("");
    std::vector<double> bars;
    if (pairings)
    {
        const auto pose = stored
                              ? shown.log()
                                    ->iterationsDetails->at(shown.moments()[shown.moment_index()].iteration)
                                    .optimalPose
                              : pose_at(*shown.log(), shown.moments()[shown.moment_index()]);
        const auto histogram = mp2p_icp::residual_histogram(*pairings, pose);
        for (size_t bin = 0; bin < histogram.kinds[0].bins.size(); bin++)
        {
            size_t count = 0;
            for (const auto& kind : histogram.kinds) count += kind.bins[bin];
            for (int i = 0; i < 8; i++) bars.push_back(static_cast<double>(count));  // upright sides
        }
        histogram_->setHeader("0 ... " + text(histogram.upper, "m"));
    }
    fill(*histogram_, bars);
}

}  // namespace mp2p_icp_apps
