#include "report_summary.h"

#include <mp2p_icp/pose_step.h>
#include <mp2p_icp/run_curves.h>
#include <mrpt/core/bits_math.h>

#include <cmath>
#include <sstream>

#include "html_text.h"
#include "stored_run.h"

namespace mp2p_icp
{
namespace
{
using mrpt::poses::CPose3D;

struct VerdictLook
{
    const char *css_class, *sign;
};

VerdictLook look_of(Verdict verdict)
{
    if (verdict == Verdict::aligned) return {"good", "✓"};
    if (verdict == Verdict::under_constrained) return {"fair", "!"};
    return {"bad", "✕"};
}

std::string explained(IterTermReason reason)
{
    switch (reason)
    {
        case IterTermReason::Stalled:
            return "converged";
        case IterTermReason::Cycled:
            return "went round in a circle";
        case IterTermReason::MaxIterations:
            return "no more were allowed";
        case IterTermReason::NoPairings:
            return "too little to pair";
        case IterTermReason::SolverError:
            return "no pose was found";
        case IterTermReason::QualityCheckpointFailed:
            return "quality too low at a checkpoint";
        case IterTermReason::HookRequest:
            return "stopped by the program";
        default:
            return "";
    }
}

std::string tile(const std::string& name, const std::string& value, const std::string& note)
{
    return "<div class=\"tile\"><span>" + html_escaped(name) + "</span><b>" + html_escaped(value) +
           "</b><small>" + html_escaped(note) + "</small></div>";
}

/// A row of a table of two columns; the value is HTML.
std::string row(const std::string& name, const std::string& value)
{
    return "<tr><th scope=\"row\">" + html_escaped(name) + "</th><td>" + value + "</td></tr>\n";
}

std::string cells(const std::string& name, const std::vector<std::string>& values, const char* css_class = "")
{
    std::string out =
        std::string("<tr class=\"") + css_class + "\"><th scope=\"row\">" + html_escaped(name) + "</th>";
    for (const auto& value : values) out += "<td>" + html_escaped(value) + "</td>";
    return out + "</tr>\n";
}

std::string pose_row(const std::string& name, const CPose3D& p, const char* css_class = "")
{
    std::vector<std::string> values;
    for (const double metres : {p.x(), p.y(), p.z()}) values.push_back(fixed_text(metres, 4));
    for (const double radians : {p.yaw(), p.pitch(), p.roll()})
        values.push_back(fixed_text(mrpt::RAD2DEG(radians), 4));
    return cells(name, values, css_class);
}

std::string poses_table(const LogRecord& log)
{
    const Results& r = log.icpResult;
    std::string out =
        "<div class=\"scroll\"><table class=\"poses\"><thead><tr><th></th><th>x, m</th><th>y, m</th><th>z, "
        "m</th><th>yaw, °</th><th>pitch, °</th><th>roll, °</th></tr></thead><tbody>\n";
    out += pose_row("guess", CPose3D(log.initialGuessLocalWrtGlobal));
    out += pose_row(r.rejected_pose ? "result (the guess)" : "result", r.optimal_tf.mean, "result");
    std::vector<std::string> sigmas;
    for (int i = 0; i < 6; i++)
    {
        const double sigma = std::sqrt(r.optimal_tf.cov(i, i));
        sigmas.push_back("± " + (i < 3 ? distance_text(sigma) : degrees_text(sigma)));
    }
    out += cells("standard deviation", sigmas);
    if (r.rejected_pose) out += pose_row("rejected pose", *r.rejected_pose);
    return out + "</tbody></table></div>\n";
}

std::string vector_text(const mrpt::math::TPoint3D& v, int decimals)
{
    return "(" + fixed_text(v.x, decimals) + ", " + fixed_text(v.y, decimals) + ", " +
           fixed_text(v.z, decimals) + ")";
}

std::string free_motions(const std::vector<FreeTwist>& twists)
{
    if (twists.empty()) return "none: the pairings determine all six degrees of freedom";
    std::string out = "<ul>";
    for (const auto& twist : twists)
    {
        const bool translation = twist.kind == FreeTwist::Kind::Translation;
        std::string text = to_string(twist.kind);
        if (!twist.name.empty()) text += " " + twist.name;
        text += ", axis " + vector_text(twist.axis, 3);
        if (!translation) text += " through " + vector_text(twist.through, 3);
        text += ", known to ± " + (translation ? distance_text(twist.sigma) : degrees_text(twist.sigma));
        out += "<li>" + html_escaped(text) + "</li>";
    }
    return out + "</ul>";
}

std::string pairings_text(const Results& r)
{
    const auto counts = pairing_counts(r.finalPairings);
    std::string out;
    for (size_t kind = 0; kind < PAIRING_KIND_COUNT; kind++)
        if (counts[kind] > 0)
            out += (out.empty() ? "" : ", ") + count_text(counts[kind]) + " " + PAIRING_KIND_NAMES[kind];
    return html_escaped((out.empty() ? "none" : out) + " of " +
                        count_text(r.finalPairings.potential_pairings) + " possible");
}

std::string map_text(const metric_map_t::ConstPtr& map, const DrawnShare& share)
{
    if (!map) return "not in the log";
    std::string name = map->label.value_or("");
    if (map->id) name += (name.empty() ? "id " : ", id ") + std::to_string(*map->id);
    std::string out = name.empty() ? "" : html_escaped(name) + "<br>";
    out += html_escaped(map->contents_summary());
    if (share.drawn < share.finite)
        out += "<br>" + html_escaped("drawn here: a random " + count_text(share.drawn) + " of " +
                                     count_text(share.finite) + " points");
    if (const auto offset = map->coordinate_offset(); offset != mrpt::math::TPoint3D(0, 0, 0))
        out += "<br>coordinate offset " + html_escaped(vector_text(offset, 0)) + " m";
    return out;
}

std::string parameters_text(const LogRecord& log)
{
    std::stringstream yaml;
    log.icpParameters.save_parameters().printAsYAML(yaml);
    return "<details><summary>Parameters</summary><pre>" + html_escaped(yaml.str()) + "</pre></details>\n";
}
}  // namespace

std::string headline_html(const LogRecord& log)
{
    const Results& r = log.icpResult;
    const VerdictLook look = look_of(r.verdict);
    const StoredRun run(log);
    const PoseStep moved = step_between(run.guess, run.end);
    return std::string("<section class=\"verdict ") + look.css_class + "\"><b>" + look.sign + " " +
           html_escaped(to_string(r.verdict)) + "</b><span>" + html_escaped(r.verdict_reason) +
           "</span></section>\n<section class=\"tiles\">" +
           tile("moved from the guess", distance_text(moved.metres), "and " + degrees_text(moved.radians)) +
           tile("quality", fixed_text(100 * r.quality, 1) + " %",
                "with " + count_text(r.finalPairings.size()) + " pairings") +
           tile("residual rms", distance_text(r.residual_rms), "of these pairings") +
           tile("iterations", count_text(r.nIterations),
                to_string(r.terminationReason) + ": " + explained(r.terminationReason)) +
           "</section>\n";
}

std::string tables_html(const LogRecord& log, const ReportScene& scene)
{
    const Results& r = log.icpResult;
    return "<section class=\"card\"><h2>Pose of local with respect to global</h2>\n" + poses_table(log) +
           "</section>\n<section class=\"card\"><h2>More</h2>\n<table class=\"facts\"><tbody>\n" +
           row("free motions", free_motions(r.unobservable)) + row("final pairings", pairings_text(r)) +
           row("mean truncated cost",
               html_escaped(rounded_text(r.cost_at_guess, 4) + " m² at the guess, " +
                            rounded_text(r.cost_at_end, 4) + " m² where the iterations ended")) +
           row("global map", map_text(log.pcGlobal, scene.global)) +
           row("local map", map_text(log.pcLocal, scene.local)) + "</tbody></table>\n" +
           parameters_text(log) + "</section>\n";
}

}  // namespace mp2p_icp
