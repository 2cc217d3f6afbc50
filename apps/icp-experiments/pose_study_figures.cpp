#include "pose_study_figures.h"

#include <algorithm>

#include "number_text.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
std::vector<size_t> noisy_levels(const PoseStudyResult& r)
{
    std::vector<size_t> out;
    for (size_t level = 0; level < r.study.levels.size(); level++)
        if (!r.study.levels[level].exact()) out.push_back(level);
    return out;
}

std::vector<std::string> ids_of(const PoseStudyResult& r)
{
    std::vector<std::string> out;
    for (const auto& method : r.study.methods) out.push_back(method.id);
    return out;
}

/// The one line's worth of a label that has two.
std::string one_line(std::string label)
{
    const auto end = label.find('\n');
    return end == std::string::npos ? label : label.replace(end, 1, " / ");
}

std::vector<SeriesStyle> legend(const PoseStudyResult& r, const std::vector<std::string>& methods,
                                const std::string& bound_label)
{
    std::vector<SeriesStyle> out;
    for (const auto& id : methods) out.push_back(style_of(id, r.study.methods[r.method_index(id)].label));
    if (!bound_label.empty()) out.push_back(style_of("bound", bound_label));
    return out;
}

/// Axes, without anything in them.
Panel empty_panel(const PoseStudyResult& r, const Quantity& q, const std::string& title)
{
    Panel panel;
    panel.title = title, panel.x_label = r.study.x_label, panel.y_label = q.name + " [" + q.unit + "]";
    for (const size_t level : noisy_levels(r)) panel.categories.push_back(r.study.levels[level].label);
    return panel;
}

/// What a logarithmic axis cannot show: the errors without noise.
std::string exact_note(const PoseStudyResult& r, const std::vector<std::string>& methods, const Quantity& q)
{
    double largest_error = -1;
    for (size_t level = 0; level < r.study.levels.size(); level++)
        if (r.study.levels[level].exact())
            for (const auto& id : methods)
                largest_error = std::max(largest_error, r.statistics(level, r.method_index(id), q).largest);
    if (largest_error < 0) return "";
    return "(without noise: at most " + number_text(largest_error, 1) + " " + q.unit + ")";
}

BoxSeries boxes_of(const PoseStudyResult& r, const std::string& id, const Quantity& q)
{
    BoxSeries out{id, {}};
    for (const size_t level : noisy_levels(r))
        out.boxes.push_back(
            {static_cast<double>(out.boxes.size()), r.statistics(level, r.method_index(id), q)});
    return out;
}

/// A number per level with noise.
template <class Value>
LineSeries line_of(const PoseStudyResult& r, const std::string& style, const Value& value)
{
    LineSeries out;
    out.style = style;
    for (const size_t level : noisy_levels(r))
        out.x.push_back(static_cast<double>(out.x.size())), out.y.push_back(value(level));
    return out;
}
LineSeries bound_line(const PoseStudyResult& r, const Quantity& q)
{
    return line_of(r, "bound", [&](size_t level) { return r.bound(level, q); });
}
LineSeries rmse_line(const PoseStudyResult& r, const std::string& id, const Quantity& q)
{
    return line_of(r, id, [&](size_t level) { return r.statistics(level, r.method_index(id), q).rmse; });
}

Panel box_panel(const PoseStudyResult& r, const std::vector<std::string>& methods, const Quantity& q,
                const std::string& title, bool with_bound)
{
    Panel panel = empty_panel(r, q, title);
    panel.note = exact_note(r, methods, q);
    for (const auto& id : methods) panel.boxes.push_back(boxes_of(r, id, q));
    if (with_bound) panel.lines.push_back(bound_line(r, q));
    return panel;
}

constexpr const char* BOUND = "Cramér–Rao bound (RMS)";
}  // namespace

Figure report_noise_figure(const PoseStudyResult& r, const std::string& name,
                           const std::vector<std::string>& methods)
{
    Figure figure{name, r.study.about, 2, legend(r, methods, BOUND), {}};
    for (const auto& q : quantities()) figure.panels.push_back(box_panel(r, methods, q, q.name, true));
    for (const auto& id : methods)
        for (const auto& q : quantities())
            figure.panels.push_back(box_panel(
                r, {id}, q, q.name + ", " + one_line(r.study.methods[r.method_index(id)].label) + " only",
                true));
    return figure;
}

Figure box_figure(const PoseStudyResult& r, const std::string& name, const std::vector<std::string>& methods)
{
    Figure figure{name, r.study.about, 1, legend(r, methods, ""), {}};
    for (const auto& q : quantities()) figure.panels.push_back(box_panel(r, methods, q, q.name, false));
    return figure;
}

Figure bound_figure(const PoseStudyResult& r, const std::string& name)
{
    const auto methods = ids_of(r);
    Figure figure{name, r.study.about, 2, legend(r, methods, BOUND), {}};
    for (const auto& q : quantities())
    {
        Panel panel = empty_panel(r, q, q.name);
        panel.y_label = "RMSE [" + q.unit + "]";
        panel.note = exact_note(r, methods, q);
        for (const auto& id : methods) panel.lines.push_back(rmse_line(r, id, q));
        panel.lines.push_back(bound_line(r, q));
        figure.panels.push_back(panel);
    }
    for (const auto& q : quantities())
    {
        Panel panel = empty_panel(r, q, q.name + " over the bound");
        panel.y_label = "RMSE / bound [–]";
        for (const auto& id : methods)
        {
            LineSeries line = rmse_line(r, id, q);
            const LineSeries bound = bound_line(r, q);
            for (size_t i = 0; i < line.y.size(); i++) line.y[i] /= bound.y[i];
            panel.lines.push_back(line);
        }
        panel.lines.push_back(line_of(r, "bound", [](size_t) { return 1.0; }));
        figure.panels.push_back(panel);
    }
    return figure;
}

Figure median_figure(const PoseStudyResult& r, const std::string& name)
{
    const auto methods = ids_of(r);
    Figure figure{name, r.study.about, 1, legend(r, methods, "Cramér–Rao bound of the inliers (RMS)"), {}};
    for (const auto& q : quantities())
    {
        Panel panel = empty_panel(r, q, q.name);
        panel.y_label = "median [" + q.unit + "]";
        for (const auto& id : methods)
            panel.lines.push_back(line_of(
                r, id, [&](size_t level) { return r.statistics(level, r.method_index(id), q).median; }));
        panel.lines.push_back(bound_line(r, q));
        figure.panels.push_back(panel);
    }
    return figure;
}

// ---- Numbers ----------------------------------------------------------------------------------------------

namespace
{
template <class Value>
Finding per_level(const PoseStudyResult& r, const std::string& what, const Value& value)
{
    Finding finding{what + " (" + r.study.about + ")", {}};
    for (const size_t level : noisy_levels(r))
        finding.values.emplace_back(one_line(r.study.levels[level].label), value(level));
    return finding;
}
}  // namespace

Finding rmse_ratio(const PoseStudyResult& r, const std::string& of, const std::string& over,
                   const Quantity& q)
{
    const size_t a = r.method_index(of), b = r.method_index(over);
    return per_level(r, q.id + " RMSE, " + of + " over " + over,
                     [&](size_t level)
                     { return r.statistics(level, a, q).rmse / r.statistics(level, b, q).rmse; });
}

Finding median_ratio(const PoseStudyResult& r, const std::string& of, const std::string& over,
                     const Quantity& q)
{
    const size_t a = r.method_index(of), b = r.method_index(over);
    return per_level(r, q.id + " median, " + of + " over " + over,
                     [&](size_t level)
                     { return r.statistics(level, a, q).median / r.statistics(level, b, q).median; });
}

Finding bound_ratio(const PoseStudyResult& r, const std::string& of, const Quantity& q)
{
    const size_t m = r.method_index(of);
    return per_level(r, q.id + " RMSE over the bound, " + of,
                     [&](size_t level) { return r.statistics(level, m, q).rmse / r.bound(level, q); });
}

Finding largest(const PoseStudyResult& r, const std::string& of, const std::string& what,
                double PoseSample::*member)
{
    const size_t m = r.method_index(of);
    return per_level(r, what,
                     [&](size_t level) { return statistics_of(r.values(level, m, member)).largest; });
}

}  // namespace mp2p_icp_apps::experiments
