#include "options.h"

#include <mp2p_icp/yaml_tools.h>

#include <ostream>
#include <stdexcept>

#include "command_line.h"

namespace mp2p_icp_apps
{
namespace
{
const char* const DESCRIPTION =
    "Aligns a local point cloud to a global one: finds the pose of the local cloud as seen from the global "
    "one.";

const char* const EXAMPLES = R"(
Inputs are told apart by their content: .ply, .pcd, .xyz/.txt/.csv, KITTI .bin, .obj (vertices), .mm maps, each also
as .gz, and entry N (from 0) of a dataset: file.rawlog:N, file.simplemap:N.

Examples:
  Two clouds, the pipeline chosen from their size:
    icp-run --input-local scan.ply --input-global map.pcd
  With a first guess (m, degrees), a picture, and the result as a file:
    icp-run --input-local scan.ply --input-global map.ply --guess "[1.5 0 0 90 0 0]" \
            --snapshot scan.png --output-result scan.yaml --output-aligned scan_in_map.ply
  Text clouds, one of them compressed, with a shipped pipeline:
    icp-run --input-local part.xyz --input-global model.xyz.gz -c icp-object
  Two maps with layers of their own, and a pipeline from a file:
    icp-run --input-local local.mm --input-global global.mm -c my-pipeline.yaml
  Two KITTI scans, with the true pose as a 4x4 matrix in a text file:
    icp-run --input-local 000001.bin --input-global 000000.bin --ground-truth T.txt
  Two entries of a rawlog, and one of a simplemap; layers made by generators from a file:
    icp-run --input-local "run.rawlog:12" --input-global "run.rawlog:10"
    icp-run --input-local "run.rawlog:12" --input-global "place.simplemap:3" --config-generators gens.yaml
  The whole story of a run in a file, which can be run again, and explained in a few lines:
    icp-run --input-local scan.ply --input-global map.ply -d
    icp-run --replay icp-run-00000-local--global-.icplog
    icp-run --why icp-run-00000-local--global-.icplog
  What can be set in a pipeline:
    icp-run --describe Matcher_Points_DistanceThreshold
    icp-run --describe all

Exit code: 0 aligned; 1 wrong usage or input (the reason is on stderr); 2 ran, but the result is not to be trusted.
With --replay: 0 the result is the same, 1 it is not, or the log cannot be read.
)";

const char* const POSE = "POSE";

void declare_inputs(CLI::App& app, Options& o)
{
    app.add_option("--input-local", o.input_local, "The cloud to be moved: a file, or an entry of a dataset")
        ->type_name("INPUT");
    app.add_option("--input-global", o.input_global, "The cloud it is aligned to")->type_name("INPUT");
    app.add_option("--guess", o.guess,
                   "First guess of the local cloud's pose in the global one, \"[x y z yaw_deg pitch_deg "
                   "roll_deg]\" in m and degrees, or a text file with a 4x4 matrix. Default: all zero")
        ->type_name(POSE);
    app.add_option("--ground-truth", o.ground_truth,
                   "The true pose, in the same forms: the errors of the result are printed")
        ->type_name(POSE);
}

void declare_pipeline(CLI::App& app, Options& o)
{
    app.add_option(
           "-c,--config", o.config,
           "Pipeline: a YAML file, or the name of a shipped one. Default: a shipped one is chosen and named")
        ->type_name("FILE|NAME");
    app.add_option("--config-generators", o.config_generators,
                   "YAML file with `generators:`, for entries of datasets. Default: those of the pipeline")
        ->type_name("FILE");
    app.add_option("--config-filters-local", o.config_filters_local,
                   "YAML file with the filters of the local map. Default: those of the pipeline")
        ->type_name("FILE");
    app.add_option("--config-filters-global", o.config_filters_global, "The same for the global map")
        ->type_name("FILE");
    app.add_option("--entry-name-filters-local", o.entry_name_filters_local,
                   "Name of the list of filters for the local map, in its YAML file. Default: filters")
        ->type_name("NAME");
    app.add_option("--entry-name-filters-global", o.entry_name_filters_global, "The same for the global map")
        ->type_name("NAME");
    app.add_option("--threads", o.threads, "Use at most so many threads. The result does not depend on it")
        ->check(CLI::Range(1u, 1024u))
        ->type_name("N");
}

void declare_outputs(CLI::App& app, Options& o)
{
    app.add_option("--output-result", o.output_result, "Write the result to this YAML file")
        ->type_name("FILE.yaml");
    app.add_option("--output-aligned", o.output_aligned,
                   "Write the local cloud, moved into the global frame (.ply .pcd .xyz .txt .csv .bin .mm)")
        ->type_name("FILE.ply");
    app.add_option("--snapshot", o.snapshot,
                   "Write a picture of both clouds, before and after; needs no display")
        ->type_name("FILE.png");
    app.add_flag("-d,--generate-debug-log", o.generate_debug_log,
                 "Write the whole story of the run as an .icplog file");
    app.add_option("--replay", o.replay,
                   "Run a logged alignment again, and say whether the result is the same, or what differs")
        ->type_name("FILE.icplog");
    app.add_option("--why", o.why,
                   "Say in a few lines why a logged alignment ended as it did, and what to try")
        ->type_name("FILE.icplog");
    app.add_flag("--profiler", o.profiler, "Print the times of the stages at the end");
    app.add_option(
           "--describe", o.describe,
           "Print the parameters of a class for pipeline files, with or without its namespace; `all` lists "
           "the classes")
        ->type_name("CLASS");
}

void check_inputs_given(const Options& o)
{
    if (!o.describe.empty() || !o.replay.empty() || !o.why.empty()) return;
    for (const auto& [name, value] :
         {std::pair("--input-local", &o.input_local), {"--input-global", &o.input_global}})
        if (value->empty())
            throw std::invalid_argument(std::string(name) + " is required (see icp-run --help)");
}
}  // namespace

std::optional<Options> parse_options(const std::vector<std::string>& arguments, std::ostream& out)
{
    Options options;
    CLI::App app(DESCRIPTION, "icp-run");
    set_program_texts(app, EXAMPLES, 40);
    declare_inputs(app, options);
    declare_pipeline(app, options);
    declare_outputs(app, options);
    if (!parse_command_line(app, arguments, out)) return {};
    check_inputs_given(options);
    return options;
}

}  // namespace mp2p_icp_apps
