#pragma once

#include <iosfwd>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "csv_file.h"
#include "experiment.h"
#include "figure.h"
#include "plotter.h"
#include "repetitions.h"
#include "yaml_writer.h"

namespace mp2p_icp_apps::experiments
{
/// A measured statement: what it is, and a number for each case.
struct Finding
{
    std::string what;  ///< with unit
    std::vector<std::pair<std::string, double>> values;
};

/// What all experiments need: where to work, and where results go.
class Workshop
{
 public:
    /// Makes the output folder. \exception mp2p_icp::DataError if it cannot be made
    Workshop(const ExperimentOptions& options, std::ostream& out, std::ostream& err, Progress& progress);

    const Repetitions& repetitions() const { return repetitions_; }
    Repetitions single_thread() const { return {1u, progress_}; }  ///< for measuring times
    std::string path(const std::string& file_name) const { return options_.output + "/" + file_name; }

    /// The first lines of a summary: what was run, with what, and what the CSV's columns mean.
    YamlWriter summary(const Experiment& experiment, size_t repetitions,
                       const std::vector<Column>& columns) const;
    /// Adds the findings to the summary, writes it, draws the figures, and prints what was found.
    void deliver(const Experiment& experiment, YamlWriter summary, const std::vector<Finding>& findings,
                 const std::vector<Figure>& figures);

    /// Were all figures drawn that were asked for?
    bool figures_complete() const { return figures_complete_; }

 private:
    void complain(const std::string& what);

    const ExperimentOptions& options_;
    std::ostream& out_;
    std::ostream& err_;
    Progress& progress_;
    Repetitions repetitions_;
    std::unique_ptr<Plotter> plotter_;  ///< null: none wanted, or none there
    bool figures_complete_ = true;
};

}  // namespace mp2p_icp_apps::experiments
