#include "workshop.h"

#include <mp2p_icp/errors.h>
#include <mp2p_icp/version.h>
#include <mrpt/system/os.h>

#include <filesystem>
#include <iomanip>
#include <ostream>

#include "number_text.h"
#include "text_file.h"

namespace mp2p_icp_apps::experiments
{
Workshop::Workshop(const ExperimentOptions& options, std::ostream& out, std::ostream& err, Progress& progress)
    : options_(options), out_(out), err_(err), progress_(progress), repetitions_(options.threads, progress)
{
    std::error_code problem;
    std::filesystem::create_directories(options.output, problem);
    if (!std::filesystem::is_directory(options.output))
        throw mp2p_icp::DataError(options.output, "the output folder cannot be made");
    if (!options.figures) return;
    try
    {
        plotter_ = std::make_unique<Plotter>(options.python);
    }
    catch (const NoFigures& e)  // the numbers are worth having without them
    {
        complain(e.what());
    }
}

void Workshop::complain(const std::string& what)
{
    figures_complete_ = false;
    progress_.stage("");
    err_ << "icp-experiments: " << what << std::endl;
}

YamlWriter Workshop::summary(const Experiment& experiment, size_t repetitions,
                             const std::vector<Column>& columns) const
{
    YamlWriter yaml;
    yaml.value("experiment", experiment.name);
    yaml.value("about", experiment.about);
    yaml.value("seed", static_cast<size_t>(options_.seed));
    yaml.value("repetitions", repetitions);
    yaml.open_map("versions");
    yaml.value("mp2p_icp", MP2P_ICP_VERSION);
    yaml.value("mrpt", mrpt::system::MRPT_getVersion());
    yaml.close();
    yaml.value("csv", experiment.name + ".csv");
    yaml.open_map("columns");
    for (const auto& column : columns) yaml.value(column.name, column.help);
    yaml.close();
    return yaml;
}

void Workshop::deliver(const Experiment& experiment, YamlWriter summary, const std::vector<Finding>& findings,
                       const std::vector<Figure>& figures)
{
    std::vector<std::string> names;
    for (const auto& figure : figures) names.push_back(figure.name);
    summary.list("figures", names);
    summary.open_list("findings");
    for (const auto& finding : findings)
    {
        summary.open_item();
        summary.value("what", finding.what), summary.numbers("values", finding.values);
        summary.close();
    }
    summary.close();
    write_text_file(path(experiment.name + ".yaml"), summary.text());
    write_figures(figures, options_.output, experiment.name);

    out_ << experiment.name << ": " << experiment.about << "\n";
    for (const auto& finding : findings)
    {
        out_ << "  " << finding.what << "\n   ";
        for (const auto& [label, value] : finding.values)
            out_ << " " << label << ": " << number_text(value, 4) << ";";
        out_ << "\n";
    }
    out_ << "  written: " << path(experiment.name) << ".csv .yaml";
    if (plotter_) try
        {
            progress_.stage("drawing the figures of " + experiment.name);
            plotter_->draw(options_.output, experiment.name);
            progress_.stage("");
            out_ << ", " << names.size() << " figures as .png and .svg";
        }
        catch (const NoFigures& e)
        {
            complain(e.what());
        }
    out_ << std::endl;
}

}  // namespace mp2p_icp_apps::experiments
