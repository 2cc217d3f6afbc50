#include "experiment_options.h"

#include <cmath>
#include <ostream>
#include <stdexcept>

#include "command_line.h"
#include "experiment.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
const char* const DESCRIPTION =
    "Reproduces the experiments of the OLAE-ICP report: each writes a CSV with all runs, a YAML summary, and "
    "its figures as PNG and SVG.";

const char* const EXAMPLES = R"(
Examples:
  Everything, as docs/experiments.md has it (minutes):
    icp-experiments all --repetitions 1000 --output experiments
  One experiment as in the report, and a quick look at it:
    icp-experiments noise-points
    icp-experiments noise-points --repetitions 20 --output /tmp/look
  Other noise (m; degrees), other shares of outliers, another object:
    icp-experiments noise-mixed --noise-points 0.02,0.2 --noise-angles 0.5,5
    icp-experiments outliers --outlier-ratios 0.1,0.5,0.9
    icp-experiments bunny-icp --model dragon.obj
  The figures once more, from their numbers:
    python3 experiments/plot_figures.py experiments/outliers.figures.json experiments

Exit code: 0 done; 1 wrong usage or input, or an output that cannot be written (the reason is on stderr); 2 the CSV and YAML
files are complete, but there is no matplotlib to draw the figures (Debian: python3-matplotlib).
)";

void declare_common(CLI::App& app, ExperimentOptions& o)
{
    app.add_option("--repetitions", o.repetitions,
                   "Runs per noise level, outlier ratio or kind of start. Default: as in the report, 1000; "
                   "bunny-icp 10 (1000 at larger poses); timing 31 rounds")
        ->check(CLI::Range(size_t(1), size_t(10'000'000)))
        ->type_name("N");
    app.add_option("--seed", o.seed, "Of all random numbers. Default: 1")->type_name("N");
    app.add_option("--threads", o.threads,
                   "Use at most so many threads. The results do not depend on it (times do)")
        ->check(CLI::Range(1u, 1024u))
        ->type_name("N");
    app.add_option("--output", o.output, "Folder for all files; it is made. Default: experiments")
        ->type_name("DIR");
    app.add_flag("!--no-figures", o.figures, "Only the CSV and YAML files");
    app.add_option("--python", o.python,
                   "Python interpreter with matplotlib. Default: /usr/bin/python3, else python3")
        ->type_name("PROGRAM");
}

CLI::Option* add_list(CLI::App& app, const std::string& name, std::vector<double>& list, double largest,
                      const std::string& help)
{
    return app.add_option(name, list, help)
        ->delimiter(',')
        ->check(CLI::Range(0.0, largest))
        ->type_name("LIST");
}

void declare_own(const std::string& name, CLI::App& app, ExperimentOptions& o)
{
    const bool all = name == "all", mixed = name == "noise-planes" || name == "noise-mixed";
    if (all || mixed || name == "noise-points")
        add_list(app, "--noise-points", o.noise_points, 1e6,
                 "Standard deviations of the noise of positions, m. Default: 0,.01,.02,.05,.1,.2,.5,1");
    if (all || mixed)
        add_list(app, "--noise-angles", o.noise_angles, 90,
                 "Of the turn of directions, degrees; the first goes with the first of positions, and so on, "
                 "the last with all that are left. Default: 0,.1,.2,.5,1,2,5");
    if (all || name == "outliers" || name == "robust-loss")
        add_list(app, "--outlier-ratios", o.outlier_ratios, 0.98,
                 "Shares of wrong pairings. Default: .05,.1,.2,.3,.4,.5,.6,.7,.75");
    if (all || name == "bunny-icp")
        app.add_option("--model", o.model,
                       "Triangle mesh (.obj). Default: the bunny of Debian's package glmark2-data")
            ->type_name("FILE");
}

void check_lists(const ExperimentOptions& o)
{
    for (const auto& [name, list] : {std::pair("--noise-points", &o.noise_points),
                                     {"--noise-angles", &o.noise_angles},
                                     {"--outlier-ratios", &o.outlier_ratios}})
    {
        if (list->empty()) throw std::invalid_argument(std::string(name) + " needs at least one number");
        for (const double value : *list)
            if (!std::isfinite(value))
                throw std::invalid_argument(std::string(name) + ": a number is not finite");
    }
}

std::vector<std::string> names_of_all()
{
    std::vector<std::string> names;
    for (const auto& e : all_experiments()) names.push_back(e.name);
    return names;
}
}  // namespace

std::optional<ExperimentOptions> parse_experiment_options(const std::vector<std::string>& arguments,
                                                          std::ostream& out)
{
    ExperimentOptions options;
    CLI::App app(DESCRIPTION, "icp-experiments");
    set_program_texts(app, EXAMPLES, 30);
    app.require_subcommand(0, 1);
    const auto add = [&](const std::string& name, const std::string& about)
    {
        CLI::App* sub = app.add_subcommand(name, about);
        declare_common(*sub, options), declare_own(name, *sub, options);
    };
    for (const auto& e : all_experiments()) add(e.name, e.about);
    add("all", "All of them, in this order");
    if (!parse_command_line(app, arguments, out)) return {};
    if (app.get_subcommands().empty())
        throw std::invalid_argument("the name of an experiment is required (see icp-experiments --help)");
    check_lists(options);
    const std::string chosen = app.get_subcommands()[0]->get_name();
    options.experiments = chosen == "all" ? names_of_all() : std::vector{chosen};
    return options;
}

}  // namespace mp2p_icp_apps::experiments
