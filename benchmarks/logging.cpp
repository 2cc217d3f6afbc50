// What the log of a run costs: the time to align two clouds without a log, with a log in memory, and with a
// file that holds all iterations, by turns, and the size of that file.
#include <mp2p_icp/ICP.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/load_map.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

using namespace mp2p_icp;

namespace
{
const char* const HELP =
    R"(What the log of a run costs: time to align, without a log, with one in memory, and with a file of all iterations.

Usage: bench-logging LOCAL GLOBAL [ROUNDS]     (default: 15 rounds, each kind once in each)

Example:
  bench-logging source.ply target.ply
)";

struct Problem
{
    Pipeline pipeline;
    metric_map_t::Ptr local, global;  ///< as read
};

Problem read_problem(const std::string& local_path, const std::string& global_path)
{
    auto [local, global] = load_map_pair(local_path, global_path);
    const auto name = default_pipeline_for(*local.map, *global.map);
    Problem p = {pipeline_from_yaml(yaml_from_text(shipped_pipeline(name))), local.map, global.map};
    ParameterSource source;
    source.updateVariables(extent_variables(*p.local, *p.global));
    p.pipeline.attachToParameterSource(source);
    std::printf("pipeline %s\n", name.c_str());
    return p;
}

/// Copies after the filters, without the index that is made at the first use.
struct Filtered
{
    metric_map_t local, global;
    explicit Filtered(const Problem& p) : local(*p.local), global(*p.global)
    {
        for (metric_map_t* map : {&local, &global})
            mp2p_icp_filters::apply_filter_pipeline(p.pipeline.filters.at("filters"), *map);
    }
};

/// Of the processor (all threads), which other programs do not disturb, and by the clock on the wall.
struct Seconds
{
    double processor, wall;
};

Seconds seconds_of(const std::function<void()>& work)
{
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const auto processor_start = std::clock();
    work();
    return {static_cast<double>(std::clock() - processor_start) / CLOCKS_PER_SEC,
            std::chrono::duration<double>(Clock::now() - start).count()};
}

double median(const std::vector<Seconds>& times, double Seconds::*which)
{
    std::vector<double> values;
    for (const auto& t : times) values.push_back(t.*which);
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

/// Both kinds of parameters, and a file.
struct Logging
{
    const std::filesystem::path file = std::filesystem::temp_directory_path() / "bench-logging.icplog";
    Parameters off, all;

    explicit Logging(const Parameters& parameters) : off(parameters), all(parameters)
    {
        all.generateDebugFiles = all.saveIterationDetails = true;
        all.decimationIterationDetails = 1;
        all.debugFileNameFormat = file.string();
    }
    ~Logging() { std::filesystem::remove(file); }
};

/// \param maps gives the maps of a run, within the time that is taken
void compare(const char* title, const Problem& p, size_t rounds,
             const std::function<std::shared_ptr<Filtered>()>& maps)
{
    const Logging logging(p.pipeline.parameters);
    const auto align = [&](const Parameters& parameters, bool in_memory)
    {
        LogRecord log;
        Results results;
        const auto m = maps();
        p.pipeline.icp->align(m->local, m->global, {}, parameters, results, std::nullopt,
                              in_memory ? mrpt::optional_ref<LogRecord>(log) : std::nullopt);
        return results.nIterations;
    };
    const auto iterations = align(logging.off, false);
    // The same twice without a log: what two equal things differ by here.
    std::vector<Seconds> without, again, in_memory, to_file;
    for (size_t i = 0; i < rounds; i++)
    {
        without.push_back(seconds_of([&] { align(logging.off, false); }));
        in_memory.push_back(seconds_of([&] { align(logging.off, true); }));
        again.push_back(seconds_of([&] { align(logging.off, false); }));
        std::filesystem::remove(logging.file);  // to replace one takes longer
        to_file.push_back(seconds_of([&] { align(logging.all, false); }));
    }
    const auto line = [&](const char* what, const std::vector<Seconds>& times)
    {
        std::printf("  %-42s", what);
        for (const auto which : {&Seconds::processor, &Seconds::wall})
            std::printf(" %8.2f ms %+7.1f %%", 1e3 * median(times, which),
                        100 * (median(times, which) / median(without, which) - 1));
        std::printf("\n");
    };
    std::printf("%s: %zu iterations, medians of %zu rounds, processor and wall\n", title, iterations, rounds);
    line("no log", without);
    line("no log, the same again", again);
    line("log in memory, without details", in_memory);
    line("file with the pairings of all iterations", to_file);
    std::printf("  size of the file %.2f MB\n",
                static_cast<double>(std::filesystem::file_size(logging.file)) / 1e6);
}
}  // namespace

int main(int argc, char** argv)
{
    if (argc < 3)
    {
        std::fputs(HELP, stderr);
        return 1;
    }
    try
    {
        const size_t rounds = argc > 3 ? std::max(1ul, std::stoul(argv[3])) : 15;
        const Problem problem = read_problem(argv[1], argv[2]);
        compare("filters, index and alignment, as for every new pair of scans", problem, rounds,
                [&] { return std::make_shared<Filtered>(problem); });
        const auto ready = std::make_shared<Filtered>(problem);
        compare("alignment alone, filters and index done before", problem, rounds, [&] { return ready; });
        return 0;
    }
    catch (const std::exception& e)
    {
        std::fprintf(stderr, "bench-logging: %s\n", e.what());
        return 1;
    }
}
