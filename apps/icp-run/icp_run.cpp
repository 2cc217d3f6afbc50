#include "icp_run.h"

#include <mp2p_icp/alignment_snapshot.h>
#include <mp2p_icp/errors.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <new>
#include <ostream>
#include <stdexcept>

#include "aligned_cloud.h"
#include "describe.h"
#include "input_maps.h"
#include "log_commands.h"
#include "options.h"
#include "pipeline_choice.h"
#include "pose_text.h"
#include "progress.h"
#include "report_text.h"
#include "threads.h"

namespace mp2p_icp_apps
{
using mp2p_icp::DataError;
using mp2p_icp::metric_map_t;
using mrpt::math::TPose3D;
using mrpt::poses::CPose3D;

namespace
{
class Stopwatch
{
 public:
    double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now();
};

/// One alignment, step by step.
class Run
{
 public:
    Run(const Options& options, std::ostream& out, Progress& progress)
        : options_(options), out_(out), progress_(progress)
    {
    }

    ExitCode run()
    {
        check_arguments();
        read_maps();
        prepare_pipeline();
        filter_maps();
        align();
        progress_.stage("");
        report();
        write_outputs();
        return record_.results.trusted() ? EXIT_ALIGNED : EXIT_NOT_TRUSTED;
    }

 private:
    void check_arguments();
    mp2p_icp_filters::GeneratorSet generators() const;
    void read_maps();
    void prepare_pipeline();
    void filter_maps();
    void filter_map(const std::string& side, const mp2p_icp_filters::FilterPipeline& filters,
                    metric_map_t& map);
    void align();
    void report();
    void write_outputs();
    void write_snapshot();

    const Options& options_;
    std::ostream& out_;
    Progress& progress_;
    Stopwatch total_;

    TPose3D guess_;
    std::optional<TPose3D> truth_;
    std::optional<mp2p_icp_filters::GeneratorSet> generators_;  ///< from --config-generators
    std::optional<NamedPipeline> pipeline_;                     ///< known at once if --config is given
    InputPair inputs_;                                          ///< as read: filters work on copies
    metric_map_t local_, global_;
    mp2p_icp::ParameterSource variables_;
    AlignmentRecord record_;
};

void check_can_be_written(const std::string& option, const std::string& path)
{
    if (path.empty()) return;
    std::error_code ignored;
    const auto folder = std::filesystem::absolute(path).parent_path();
    if (!std::filesystem::is_directory(folder, ignored))
        throw std::invalid_argument(option + ": there is no folder '" + folder.string() + "'");
    if (std::filesystem::is_directory(path, ignored))
        throw std::invalid_argument(option + ": '" + path + "' is a folder; expected the name of a file");
}

/// Everything that can be wrong before the long work begins.
void Run::check_arguments()
{
    guess_ = pose_from_argument("--guess", options_.guess);
    if (!options_.ground_truth.empty()) truth_ = pose_from_argument("--ground-truth", options_.ground_truth);
    if (!options_.config.empty()) pipeline_ = load_pipeline(options_.config);
    if (!options_.config_generators.empty())
        generators_ =
            mp2p_icp_filters::generators_from_yaml_file(options_.config_generators, mrpt::system::LVL_ERROR);
    check_can_be_written("--output-result", options_.output_result);
    check_can_be_written("--output-aligned", options_.output_aligned);
    check_can_be_written("--snapshot", options_.snapshot);
}

/// From --config-generators, else of the pipeline as far as it is known, else the default one.
mp2p_icp_filters::GeneratorSet Run::generators() const
{
    if (generators_) return *generators_;
    if (pipeline_ && pipeline_->pipeline.generators) return *pipeline_->pipeline.generators;
    return mp2p_icp_filters::generators_from_yaml(mp2p_icp::yaml());
}

void Run::read_maps()
{
    const Stopwatch watch;
    progress_.stage("reading the inputs");
    inputs_ = read_inputs(options_.input_local, options_.input_global);
    inputs_.generate_maps(generators());
    if (!pipeline_)
    {
        pipeline_ = load_pipeline(default_pipeline_for_inputs(inputs_, generators_.has_value()));
        inputs_.generate_maps(generators());  // the clouds had to be seen first; now it has a say
    }
    record_.time_s.load = watch.seconds();
    progress_.stage("");
    out_ << "Pipeline: " << pipeline_->name
         << (options_.config.empty() ? " (chosen for these inputs; -c chooses another one)\n" : "\n");
    print_input(out_, "Local", inputs_.local.report, *inputs_.local.map);
    print_input(out_, "Global", inputs_.global.report, *inputs_.global.map);
    if (generators_ && !inputs_.has_observations())
        out_ << "note: --config-generators has no effect, as no input is the entry of a dataset\n";
}

void Run::prepare_pipeline()
{
    variables_.updateVariables(mp2p_icp::extent_variables(*inputs_.local.map, *inputs_.global.map));
    auto& pipeline = pipeline_->pipeline;
    pipeline.attachToParameterSource(variables_);
    if (options_.generate_debug_log) pipeline.parameters.generateDebugFiles = true;
    if (options_.profiler) pipeline.icp->profiler().enable(true);
    pipeline.icp->setIterationHook(
        [this](const auto& input)
        {
            progress_.detail("iteration " + std::to_string(input.currentIteration));
            return mp2p_icp::ICP::IterationHook_Output();
        });
}

void Run::filter_map(const std::string& side, const mp2p_icp_filters::FilterPipeline& filters,
                     metric_map_t& map)
{
    if (filters.empty()) return;
    progress_.stage("filtering the " + side + " map");
    for (const auto& filter : filters) filter->attachToParameterSource(variables_);
    try
    {
        mp2p_icp_filters::apply_filter_pipeline(filters, map, &pipeline_->pipeline.icp->profiler());
    }
    catch (const std::exception& e)
    {
        throw std::invalid_argument("filters of the " + side + " map: " + mp2p_icp::short_reason(e));
    }
    progress_.stage("");
    out_ << "Filtered " << side << ": " << map.contents_summary() << "\n";
}

void Run::filter_maps()
{
    const Stopwatch watch;
    const auto local_filters =
        choose_filters(*pipeline_, options_.config_filters_local, options_.entry_name_filters_local,
                       "--entry-name-filters-local");
    const auto global_filters =
        choose_filters(*pipeline_, options_.config_filters_global, options_.entry_name_filters_global,
                       "--entry-name-filters-global");
    local_ = *inputs_.local.map, global_ = *inputs_.global.map;
    filter_map("local", local_filters, local_);
    filter_map("global", global_filters, global_);
    record_.time_s.filters = watch.seconds();
}

void Run::align()
{
    const Stopwatch watch;
    progress_.stage("aligning");
    const auto& icp = *pipeline_->pipeline.icp;
    check_layers_meet(icp, local_, global_);
    icp.align(local_, global_, guess_, pipeline_->pipeline.parameters, record_.results);
    record_.time_s.align = watch.seconds();
}

void Run::report()
{
    auto& r = record_.results;
    record_.local = {inputs_.local.report, r.local_points_used};
    record_.global = {inputs_.global.report, global_points_used(*pipeline_->pipeline.icp, local_, global_)};
    if (truth_) record_.error = pose_error(r.optimal_tf.mean, CPose3D(*truth_), local_.coordinate_offset());
    record_.time_s.total = total_.seconds();
    print_result(out_, record_);
    if (!options_.profiler) return;
    auto& profiler = pipeline_->pipeline.icp->profiler();
    out_ << profiler.getStatsAsText() << "\n";
    profiler.clear(true), profiler.enable(false);  // it would print itself once more when it is destroyed
}

void write_text_file(const std::string& path, const std::string& text)
{
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw DataError(path, "cannot be written");
}

void Run::write_outputs()
{
    const auto say_written = [this](const std::string& what, const std::string& path)
    { out_ << "Written: " << path << " (" << what << ")\n"; };
    const CPose3D& pose = record_.results.optimal_tf.mean;
    if (!options_.output_result.empty())
    {
        write_text_file(options_.output_result, result_yaml(record_));
        say_written("result", options_.output_result);
    }
    if (!options_.output_aligned.empty())
    {
        const auto cloud = aligned_cloud(*inputs_.local.map, *inputs_.global.map, pose);
        mp2p_icp::save_map(cloud, options_.output_aligned);
        say_written("local layer '" + cloud.layers.begin()->first + "' in the global frame",
                    options_.output_aligned);
    }
    if (!options_.snapshot.empty())
    {
        write_snapshot();
        say_written("picture, before and after", options_.snapshot);
    }
}

/// The layer `raw` alone if there is one: layers that were made from it would be drawn on top of it.
metric_map_t map_to_draw(const metric_map_t& map)
{
    metric_map_t out = map;
    if (const auto raw = map.layers.find(metric_map_t::PT_LAYER_RAW); raw != map.layers.end())
        out.layers = {*raw};
    return out;
}

void Run::write_snapshot()
{
    const auto local = map_to_draw(*inputs_.local.map), global = map_to_draw(*inputs_.global.map);
    const auto name = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
    mp2p_icp::SnapshotOptions picture;
    picture.captions = {name(options_.input_local) + " aligned to " + name(options_.input_global),
                        verdict_line(record_.results), pose_line(record_.results.optimal_tf.mean)};
    mp2p_icp::save_alignment_snapshot(global, local, pose_between_stored(CPose3D(guess_), local, global),
                                      pose_between_stored(record_.results.optimal_tf.mean, local, global),
                                      picture, options_.snapshot);
}

int run_with(const Options& options, const ProgramStreams& streams)
{
    if (!options.describe.empty())
    {
        streams.out << describe_class(options.describe);
        return EXIT_ALIGNED;
    }
    int code = EXIT_WRONG_INPUT;
    Progress progress(streams.err, streams.err_is_terminal);
    const auto work = [&]
    {
        if (!options.replay.empty()) progress.stage("running it again");
        if (!options.why.empty()) progress.stage("looking for the cause");
        code = !options.replay.empty() ? replay_log(options.replay, streams.out)
               : !options.why.empty()  ? explain_log(options.why, streams.out)
                                       : Run(options, streams.out, progress).run();
    };
    with_threads(options.threads, work);
    return code;
}

void complain(std::ostream& err, std::string reason)
{
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    err << "icp-run: " << reason << std::endl;
}
}  // namespace

int icp_run(const std::vector<std::string>& arguments, const ProgramStreams& streams) noexcept
{
    try
    {
        const auto options = parse_options(arguments, streams.out);
        return options ? run_with(*options, streams) : EXIT_ALIGNED;
    }
    catch (const std::bad_alloc&)
    {
        complain(streams.err, "not enough memory");
    }
    catch (const std::exception& e)
    {
        complain(streams.err, mp2p_icp::short_reason(e));
    }
    catch (...)
    {
        complain(streams.err, "unknown error");
    }
    return EXIT_WRONG_INPUT;
}

}  // namespace mp2p_icp_apps
