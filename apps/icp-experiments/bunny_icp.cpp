#include <mp2p_icp/Solver_Certified.h>
#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/Solver_OLAE.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/load_obj_mesh.h>
#include <mp2p_icp/synthetic/random_pose.h>
#include <mp2p_icp/synthetic/sample_by_area.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "experiment.h"
#include "thread_time.h"
#include "workshop.h"

namespace mp2p_icp_apps::experiments
{
using namespace mp2p_icp;
using mrpt::poses::CPose3D;

namespace
{
constexpr size_t POINTS = 1000;
constexpr double DEG = M_PI / 180;
// An alignment that is worse ended in another minimum, or nowhere.
constexpr double SUCCESS_RAD = 2 * DEG, SUCCESS_OF_SIZE = 0.02;

// ---- What is run ------------------------------------------------------------------------------------------

/// A kind of start.
struct Start
{
    std::string id, about;
    double translation;  ///< limit of each axis, of the model's longest side
    double angle;        ///< limit of yaw, pitch and roll, rad
    bool resampled;      ///< are the two clouds drawn independently, or are they the same points?
    size_t usual_repetitions;
};
std::vector<Start> starts()
{
    return {{"report", "the same points, starts within 0.25 b and 20°", .25, 20 * DEG, false, 10},
            {"resampled", "two independent samples, starts within 0.25 b and 20°", .25, 20 * DEG, true, 10},
            {"larger", "the same points, starts within 0.5 b and 60°", .5, 60 * DEG, false, 1000}};
}

struct IcpSolver
{
    std::string id, label;
    Solver::Ptr solver;
};
std::vector<IcpSolver> icp_solvers()
{
    return {{"olae", "OLAE", std::make_shared<Solver_OLAE>()},
            {"horn", "Horn", std::make_shared<Solver_Horn>()},
            {"gauss-newton", "Gauss–Newton", std::make_shared<Solver_GaussNewton>()},
            {"certified", "Certified", std::make_shared<Solver_Certified>()}};
}
constexpr size_t HORN = 1;

struct Alignment
{
    double start_angle = 0, start_translation = 0;  ///< rad; of the size
    double rotation = 0, translation = 0;           ///< errors, rad; of the size
    double rotation_from_horn = 0, translation_from_horn = 0;
    size_t iterations = 0;
    std::string verdict;
    double cpu_ms = 0;

    bool success() const { return rotation < SUCCESS_RAD && translation < SUCCESS_OF_SIZE; }
};

metric_map_t map_of(const mrpt::maps::CSimplePointsMap& points)
{
    metric_map_t map;
    map.layers[metric_map_t::PT_LAYER_RAW] = mrpt::maps::CSimplePointsMap::Create(points);
    return map;
}

/// The pipeline for objects that pairs points, with this solver, from the identity. The rest of what is found
/// goes to `out`.
CPose3D align(const mrpt::maps::CSimplePointsMap& local_points,
              const mrpt::maps::CSimplePointsMap& global_points, const Solver::Ptr& solver, Alignment& out)
{
    const metric_map_t local = map_of(local_points), global = map_of(global_points);
    Pipeline pipeline = pipeline_from_yaml(yaml_from_text(shipped_pipeline("icp-object-points")), {},
                                           mrpt::system::LVL_ERROR);
    pipeline.icp->solvers() = {solver};
    ParameterSource variables;
    variables.updateVariables(extent_variables(local, global));
    pipeline.attachToParameterSource(variables);
    Results found;
    const double began = thread_time();
    pipeline.icp->align(local, global, {}, pipeline.parameters, found);
    out.cpu_ms = 1e3 * (thread_time() - began);
    out.iterations = found.nIterations, out.verdict = to_string(found.verdict);
    return found.optimal_tf.mean;
}

/// All solvers, from one start.
std::vector<Alignment> run_start(const synthetic::ObjectMesh& model, const Start& start, SeededRandom random)
{
    const auto global = synthetic::sample_by_area(model.mesh, POINTS, random());
    const auto local = synthetic::sample_by_area(model.mesh, POINTS, random());
    const double shift = start.translation * model.size;
    const CPose3D truth =
        synthetic::random_pose({shift, shift, shift, start.angle, start.angle, start.angle}, random);
    if (!start.resampled) *local = *global;
    local->changeCoordinatesReference(-truth);

    std::vector<CPose3D> poses;
    std::vector<Alignment> out;
    for (const auto& with : icp_solvers())
    {
        Alignment a;
        poses.push_back(align(*local, *global, with.solver, a));
        const auto angle_to = [&](const CPose3D& other)
        { return rotation_angle(rotation_of(other).transpose() * rotation_of(poses.back())); };
        a.start_angle = rotation_angle(rotation_of(truth));
        a.start_translation = translation_of(truth).norm() / model.size;
        a.rotation = angle_to(truth);
        a.translation = (translation_of(poses.back()) - translation_of(truth)).norm() / model.size;
        out.push_back(a);
    }
    for (size_t k = 0; k < out.size(); k++)
    {
        out[k].rotation_from_horn =
            rotation_angle(rotation_of(poses[HORN]).transpose() * rotation_of(poses[k]));
        out[k].translation_from_horn =
            (translation_of(poses[HORN]) - translation_of(poses[k])).norm() / model.size;
    }
    return out;
}

/// All alignments of one kind of start: [repetition][solver].
struct StartResult
{
    Start start;
    std::vector<std::vector<Alignment>> runs;

    std::vector<double> values(size_t solver, double Alignment::*member) const
    {
        std::vector<double> out;
        for (const auto& run : runs) out.push_back(run[solver].*member);
        return out;
    }
    Share success(size_t solver) const
    {
        size_t hits = 0;
        for (const auto& run : runs) hits += run[solver].success();
        return share_of(hits, runs.size());
    }
};

StartResult run_all(const synthetic::ObjectMesh& model, const Start& start, uint64_t number,
                    const ExperimentOptions& options, const Repetitions& workers)
{
    StartResult result{start, {}};
    result.runs.resize(options.repetitions.value_or(start.usual_repetitions));
    workers.run("bunny-icp: " + start.about, result.runs.size(),
                [&](size_t i) {
                    result.runs[i] = run_start(model, start, stream_of(options.seed, {number, i}));
                });
    return result;
}

// ---- Files ------------------------------------------------------------------------------------------------

const std::vector<Column>& columns()
{
    static const std::vector<Column> all = {
        {"start", "which kind of start; see `starts`"},
        {"repetition", "index of the start, from 0; the same for all solvers"},
        {"solver", "see `solvers`"},
        {"start_angle_rad", "angle of the true rotation: the guess is the identity"},
        {"start_translation_b", "length of the true translation, in units of b"},
        {"rotation_error_rad", "norm of the logarithm of the rotation's error"},
        {"translation_error_b", "distance from the true translation, in units of b"},
        {"rotation_from_horn_rad", "angle between this pose and Horn's from the same start"},
        {"translation_from_horn_b", "distance between the two, in units of b"},
        {"iterations", "how often pairings were solved"},
        {"verdict", "of the alignment"},
        {"success", "1 if the errors are below 2 degrees and 0.02 b"}};
    return all;
}

void write_csv(const std::vector<StartResult>& results, const std::string& path)
{
    CsvFile csv(path, columns());
    for (const auto& r : results)
        for (size_t i = 0; i < r.runs.size(); i++)
            for (size_t k = 0; k < r.runs[i].size(); k++)
            {
                const Alignment& a = r.runs[i][k];
                csv << r.start.id << i << icp_solvers()[k].id << a.start_angle << a.start_translation
                    << a.rotation << a.translation << a.rotation_from_horn << a.translation_from_horn
                    << a.iterations << a.verdict << a.success();
                csv.end_row();
            }
    csv.close();
}

/// Apart from the rest: times are not the same twice.
void write_times(const std::vector<StartResult>& results, const std::string& path)
{
    CsvFile csv(path, {{"start", ""}, {"repetition", ""}, {"solver", ""}, {"cpu_ms", ""}});
    for (const auto& r : results)
        for (size_t i = 0; i < r.runs.size(); i++)
            for (size_t k = 0; k < r.runs[i].size(); k++)
            {
                csv << r.start.id << i << icp_solvers()[k].id << r.runs[i][k].cpu_ms;
                csv.end_row();
            }
    csv.close();
}

void write_statistics(const std::string& key, const Statistics& s, YamlWriter& yaml)
{
    yaml.numbers(
        key,
        {{"median", s.median}, {"q25", s.q25}, {"q75", s.q75}, {"rmse", s.rmse}, {"largest", s.largest}});
}

void write_summary(const std::vector<StartResult>& results, const synthetic::ObjectMesh& model,
                   YamlWriter& yaml)
{
    yaml.value("points", POINTS), yaml.value("b_m", model.size);
    yaml.open_map("solvers");
    for (const auto& s : icp_solvers()) yaml.value(s.id, s.label);
    yaml.close();
    yaml.open_list("starts");
    for (const auto& r : results)
    {
        yaml.open_item();
        yaml.value("start", r.start.id), yaml.value("about", r.start.about),
            yaml.value("runs", r.runs.size());
        yaml.open_map("solvers");
        for (size_t k = 0; k < icp_solvers().size(); k++)
        {
            yaml.open_map(icp_solvers()[k].id);
            const Share success = r.success(k);
            yaml.numbers("success", {{"share", success.value}, {"low", success.low}, {"high", success.high}});
            write_statistics("rotation_rad", statistics_of(r.values(k, &Alignment::rotation)), yaml);
            write_statistics("translation_b", statistics_of(r.values(k, &Alignment::translation)), yaml);
            write_statistics("rotation_from_horn_rad",
                             statistics_of(r.values(k, &Alignment::rotation_from_horn)), yaml);
            yaml.close();
        }
        yaml.close(), yaml.close();
    }
    yaml.close();
}

// ---- Figures ----------------------------------------------------------------------------------------------

std::vector<SeriesStyle> legend()
{
    std::vector<SeriesStyle> out;
    for (const auto& s : icp_solvers()) out.push_back(style_of(s.id, s.label));
    return out;
}

Panel box_panel(const StartResult& r, const std::string& title, const std::string& y_label,
                double Alignment::*member)
{
    Panel panel;
    panel.title = title, panel.y_label = y_label, panel.x_label = "solver";
    for (size_t k = 0; k < icp_solvers().size(); k++)
    {
        panel.categories.push_back(icp_solvers()[k].label);
        panel.boxes.push_back(
            {icp_solvers()[k].id, {{static_cast<double>(k), statistics_of(r.values(k, member))}}});
    }
    return panel;
}

/// The report's three panels.
Figure report_figure(const StartResult& r, const std::string& name)
{
    Figure f{name, "ICP on 1000 points: " + r.start.about, 3, legend(), {}};
    f.panels = {box_panel(r, "SO(3) error", "SO(3) error [rad]", &Alignment::rotation),
                box_panel(r, "Translation error", "translation error / b [–]", &Alignment::translation),
                box_panel(r, "Time", "CPU time [ms]", &Alignment::cpu_ms)};
    return f;
}

/// Share of successes in ten bins of a distance.
Panel success_panel(const StartResult& r, const std::string& title, const std::string& x_label,
                    double Alignment::*distance, double unit)
{
    constexpr size_t BINS = 10;
    const double farthest = statistics_of(r.values(HORN, distance)).largest;
    Panel panel;
    panel.title = title, panel.x_label = x_label, panel.y_label = "success rate [–]";
    panel.x_scale = panel.y_scale = "linear", panel.y_from = -0.03, panel.y_to = 1.03;
    for (size_t k = 0; k < icp_solvers().size(); k++)
    {
        std::vector<size_t> hits(BINS), runs(BINS);
        for (const auto& run : r.runs)
        {
            const auto bin = std::min(BINS - 1, static_cast<size_t>(BINS * (run[k].*distance / farthest)));
            runs[bin]++, hits[bin] += run[k].success();
        }
        LineSeries line;
        line.style = icp_solvers()[k].id;
        for (size_t bin = 0; bin < BINS; bin++)
        {
            if (runs[bin] == 0) continue;
            const Share share = share_of(hits[bin], runs[bin]);
            line.x.push_back((static_cast<double>(bin) + .5) * farthest / BINS / unit);
            line.y.push_back(share.value), line.low.push_back(share.low), line.high.push_back(share.high);
        }
        panel.lines.push_back(line);
    }
    return panel;
}

Figure success_figure(const StartResult& r)
{
    Figure f{"bunny-icp-success", "Success (errors below 2° and 0.02 b): " + r.start.about, 2, legend(), {}};
    f.panels = {
        success_panel(r, "against the rotation", "angle of the start [°]", &Alignment::start_angle, DEG),
        success_panel(r, "against the translation", "distance of the start / b [–]",
                      &Alignment::start_translation, 1)};
    return f;
}

// ---- Findings ---------------------------------------------------------------------------------------------

template <class Value>
Finding per_solver(const StartResult& r, const std::string& what, const Value& value)
{
    Finding finding{what + " (" + r.start.about + ")", {}};
    for (size_t k = 0; k < icp_solvers().size(); k++)
        finding.values.emplace_back(icp_solvers()[k].id, value(k));
    return finding;
}

std::vector<Finding> findings_of(const StartResult& r)
{
    const auto stats = [&](double Alignment::*member)
    { return [&r, member](size_t k) { return statistics_of(r.values(k, member)); }; };
    const auto rotation = stats(&Alignment::rotation), translation = stats(&Alignment::translation),
               from_horn = stats(&Alignment::rotation_from_horn);
    return {
        per_solver(r, "rotation RMSE, rad", [&](size_t k) { return rotation(k).rmse; }),
        per_solver(r, "translation RMSE, of b", [&](size_t k) { return translation(k).rmse; }),
        per_solver(r, "median rotation error, rad", [&](size_t k) { return rotation(k).median; }),
        per_solver(r, "median angle from Horn's pose, rad", [&](size_t k) { return from_horn(k).median; }),
        per_solver(r, "largest angle from Horn's pose, rad", [&](size_t k) { return from_horn(k).largest; }),
        per_solver(r, "share of successes", [&](size_t k) { return r.success(k).value; })};
}
}  // namespace

/// The report's experiment on a whole ICP, and starts that are farther away.
Experiment bunny_icp()
{
    Experiment e{"bunny-icp", "Whole ICP on the Stanford bunny, with each solver at its core", {}};
    e.run = [e](const ExperimentOptions& options, Workshop& workshop)
    {
        const synthetic::ObjectMesh model = synthetic::load_object_mesh(options.model);
        std::vector<StartResult> results;
        for (const auto& start : starts())
            results.push_back(run_all(model, start, 20 + results.size(), options, workshop.repetitions()));
        write_csv(results, workshop.path(e.name + ".csv"));
        write_times(results, workshop.path(e.name + "-times.csv"));
        YamlWriter yaml = workshop.summary(e, results[0].runs.size(), columns());
        write_summary(results, model, yaml);
        std::vector<Finding> findings;
        for (const auto& r : results)
            for (const auto& finding : findings_of(r)) findings.push_back(finding);
        workshop.deliver(
            e, yaml, findings,
            {report_figure(results[0], "bunny-icp"), report_figure(results[1], "bunny-icp-resampled"),
             report_figure(results[2], "bunny-icp-larger"), success_figure(results[2])});
    };
    return e;
}

}  // namespace mp2p_icp_apps::experiments
