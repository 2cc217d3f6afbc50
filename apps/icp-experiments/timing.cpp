#include <mp2p_icp/synthetic/report_worlds.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiment.h"
#include "pose_method.h"
#include "thread_time.h"
#include "workshop.h"

namespace mp2p_icp_apps::experiments
{
using namespace mp2p_icp;

namespace
{
constexpr size_t USUAL_ROUNDS = 31, WORLDS = 8;
constexpr double SHORTEST_RUN_S = 2e-4;

/// Sizes on both sides of the report's "roughly less than 10".
const std::vector<size_t> SIZES = {3, 4, 5, 6, 7, 8, 10, 12, 15, 20, 30, 50, 100, 200, 500, 1000};

/// What the pairings of a set are.
struct Kind
{
    std::string id, about;
    bool planes;  ///< all but one point
};
std::vector<Kind> kinds()
{
    return {{"points", "N point pairings", false}, {"planes", "1 point and N - 1 plane pairings", true}};
}

/// The weights that each world brings: those of the report would be made anew in every call.
std::vector<PoseMethod> contenders()
{
    const auto w = Weighting::Likely;
    std::vector<PoseMethod> all = {olae(w), horn(w), gauss_newton(w), certified(w)};
    const auto plain = [](std::string& text, const std::string& end) { text.resize(text.rfind(end)); };
    for (auto& method : all) plain(method.id, "-ml"), plain(method.label, ", ML weights");
    return all;
}
/// Every vector weighs 1, as in the report; positions of planes nothing.
PairWeights unit_weights()
{
    PairWeights w;
    w.pl2pl = 0, w.pl2pl_direction = 1;
    return w;
}
enum : size_t
{
    OLAE,
    HORN
};

/// Sets of one size, and the times of all contenders on them.
class Race
{
 public:
    Race(const Kind& kind, size_t size, uint64_t seed)
    {
        const synthetic::ReportNoise noise{.01, .1 * M_PI / 180};
        for (size_t k = 0; k < WORLDS; k++)
        {
            SeededRandom random = stream_of(seed, {30, size, k});
            worlds_.push_back(
                synthetic::report_world(kind.planes ? 1 : size, kind.planes ? size - 1 : 0, noise, random));
        }
        for (const auto& world : worlds_)
            problems_.push_back({world.pairings, unit_weights(), world.truth()});
        for (const auto& method : contenders()) repeats_.push_back(calls_for(method));
        ns.resize(contenders().size());
    }

    /// Every contender once, in a random order: what else the machine does falls on all of them alike.
    void round(SeededRandom& random)
    {
        std::vector<size_t> order(ns.size());
        for (size_t k = 0; k < order.size(); k++) order[k] = k;
        for (size_t k = order.size(); k > 1; k--) std::swap(order[k - 1], order[random.index(k)]);
        for (const size_t m : order)
        {
            call_all(contenders()[m], 1);  // its data into the caches, whoever came before it
            const double start = thread_time();
            call_all(contenders()[m], repeats_[m]);
            ns[m].push_back(1e9 * (thread_time() - start) / static_cast<double>(repeats_[m] * WORLDS));
        }
    }

    std::vector<std::vector<double>> ns;  ///< per call: [contender][round]

 private:
    void call_all(const PoseMethod& method, size_t repeats) const
    {
        OptimalTF_Result result;
        for (size_t k = 0; k < repeats; k++)
            for (const auto& problem : problems_) method.solve(problem, result);
    }
    size_t calls_for(const PoseMethod& method) const
    {
        call_all(method, 1);
        const double start = thread_time();
        call_all(method, 1);
        return 1 + static_cast<size_t>(SHORTEST_RUN_S / std::max(1e-8, thread_time() - start));
    }

    std::vector<synthetic::ReportWorld> worlds_;
    std::vector<PoseProblem> problems_;  ///< refer to the worlds
    std::vector<size_t> repeats_;
};

/// All sizes of one kind: [size][contender][round], ns.
struct KindResult
{
    Kind kind;
    std::vector<std::vector<std::vector<double>>> ns;

    double median(size_t size, size_t contender) const { return statistics_of(ns[size][contender]).median; }
    /// Time = constant + slope N: ns to solve, and per pairing to accumulate.
    Line line(size_t contender) const
    {
        std::vector<double> x, y;
        for (size_t k = 0; k < SIZES.size(); k++)
            x.push_back(static_cast<double>(SIZES[k])), y.push_back(median(k, contender));
        return fitted_line(x, y);
    }
};

/// On one thread, whatever --threads says: others would disturb.
KindResult run_kind(const Kind& kind, size_t rounds, const ExperimentOptions& options, Workshop& workshop)
{
    KindResult result{kind, {}};
    const Repetitions alone = workshop.single_thread();
    alone.run("timing: " + kind.about, SIZES.size(),
              [&](size_t k)
              {
                  Race race(kind, SIZES[k], options.seed);
                  SeededRandom random = stream_of(options.seed, {31, k});
                  for (size_t r = 0; r < rounds; r++) race.round(random);
                  result.ns.push_back(std::move(race.ns));
              });
    return result;
}

// ---- Files ------------------------------------------------------------------------------------------------

const std::vector<Column>& columns()
{
    static const std::vector<Column> all = {{"kind", "what the pairings are; see `kinds`"},
                                            {"pairings", "how many of them, N"},
                                            {"round", "index of the round, from 0"},
                                            {"method", "see `methods`"},
                                            {"time_ns", "CPU time of one call, on one thread"}};
    return all;
}

void write_csv(const std::vector<KindResult>& results, const std::string& path)
{
    CsvFile csv(path, columns());
    for (const auto& r : results)
        for (size_t k = 0; k < SIZES.size(); k++)
            for (size_t m = 0; m < contenders().size(); m++)
                for (size_t i = 0; i < r.ns[k][m].size(); i++)
                {
                    csv << r.kind.id << SIZES[k] << i << contenders()[m].id << r.ns[k][m][i];
                    csv.end_row();
                }
    csv.close();
}

void write_summary(const std::vector<KindResult>& results, YamlWriter& yaml)
{
    yaml.open_map("methods");
    for (const auto& m : contenders()) yaml.value(m.id, m.label);
    yaml.close();
    yaml.open_list("kinds");
    for (const auto& r : results)
    {
        yaml.open_item();
        yaml.value("kind", r.kind.id), yaml.value("about", r.kind.about);
        yaml.open_map("methods");
        for (size_t m = 0; m < contenders().size(); m++)
        {
            yaml.open_map(contenders()[m].id);
            yaml.value("solve_ns", r.line(m).constant);
            yaml.value("accumulate_ns_per_pairing", r.line(m).slope);
            std::vector<std::pair<std::string, double>> medians;
            for (size_t k = 0; k < SIZES.size(); k++)
                medians.emplace_back("N=" + std::to_string(SIZES[k]), r.median(k, m));
            yaml.numbers("median_ns", medians);
            yaml.close();
        }
        yaml.close(), yaml.close();
    }
    yaml.close();
}

std::vector<SeriesStyle> legend()
{
    std::vector<SeriesStyle> out;
    for (const auto& m : contenders()) out.push_back(style_of(m.id, m.label));
    return out;
}

LineSeries times(const KindResult& r, size_t contender)
{
    LineSeries line;
    line.style = contenders()[contender].id;
    for (size_t k = 0; k < SIZES.size(); k++)
    {
        const Statistics s = statistics_of(r.ns[k][contender]);
        line.x.push_back(static_cast<double>(SIZES[k])), line.y.push_back(s.median / 1e3);
        line.low.push_back(s.q25 / 1e3), line.high.push_back(s.q75 / 1e3);
    }
    return line;
}

Panel time_panel(const KindResult& r)
{
    Panel panel;
    panel.title = r.kind.about, panel.x_label = "pairings N [–]", panel.y_label = "CPU time of a call [µs]";
    panel.x_scale = "log";
    for (size_t m = 0; m < contenders().size(); m++) panel.lines.push_back(times(r, m));
    return panel;
}

/// Below one, OLAE is faster.
Panel ratio_panel(const KindResult& r)
{
    Panel panel;
    panel.title = "OLAE against Horn", panel.x_label = "pairings N [–]",
    panel.y_label = "time of OLAE / Horn [–]";
    panel.x_scale = "log", panel.y_scale = "linear";
    LineSeries line, one;
    line.style = contenders()[OLAE].id, one.style = contenders()[HORN].id;
    for (size_t k = 0; k < SIZES.size(); k++)
    {
        line.x.push_back(static_cast<double>(SIZES[k])),
            line.y.push_back(r.median(k, OLAE) / r.median(k, HORN));
        one.x.push_back(static_cast<double>(SIZES[k])), one.y.push_back(1);
    }
    panel.lines = {line, one};
    return panel;
}

std::vector<Finding> findings_of(const KindResult& r)
{
    Finding ratio{"time of OLAE over Horn's (" + r.kind.about + ")", {}};
    for (size_t k = 0; k < SIZES.size(); k++)
        ratio.values.emplace_back("N=" + std::to_string(SIZES[k]), r.median(k, OLAE) / r.median(k, HORN));
    Finding solve{"ns to solve (" + r.kind.about + ")", {}},
        each{"ns per pairing (" + r.kind.about + ")", {}};
    for (size_t m = 0; m < contenders().size(); m++)
    {
        solve.values.emplace_back(contenders()[m].id, r.line(m).constant);
        each.values.emplace_back(contenders()[m].id, r.line(m).slope);
    }
    return {ratio, solve, each};
}
}  // namespace

/// From the report's conclusions: OLAE is faster than Horn's method below about 10 pairings.
Experiment timing()
{
    Experiment e{"timing", "Time of one call over the number of pairings", {}};
    e.run = [e](const ExperimentOptions& options, Workshop& workshop)
    {
        // Medians over more rounds than this gain nothing.
        const size_t rounds = std::min(options.repetitions.value_or(USUAL_ROUNDS), size_t(101));
        std::vector<KindResult> results;
        for (const auto& kind : kinds()) results.push_back(run_kind(kind, rounds, options, workshop));
        write_csv(results, workshop.path(e.name + ".csv"));
        YamlWriter yaml = workshop.summary(e, rounds, columns());
        write_summary(results, yaml);
        std::vector<Finding> findings;
        Figure figure{"timing", "Time of one call on one thread: median, band: quartiles", 2, legend(), {}};
        for (const auto& r : results) figure.panels.push_back(time_panel(r));
        for (const auto& r : results)
        {
            figure.panels.push_back(ratio_panel(r));
            for (const auto& finding : findings_of(r)) findings.push_back(finding);
        }
        workshop.deliver(e, yaml, findings, {figure});
    };
    return e;
}

}  // namespace mp2p_icp_apps::experiments
