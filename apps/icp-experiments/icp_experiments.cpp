#include "icp_experiments.h"

#include <mp2p_icp/errors.h>

#include <algorithm>
#include <new>
#include <ostream>

#include "experiment.h"
#include "progress.h"
#include "threads.h"
#include "workshop.h"

namespace mp2p_icp_apps
{
namespace
{
using namespace experiments;

constexpr int DONE = 0, WRONG_INPUT = 1, WITHOUT_FIGURES = 2;

int run(const ExperimentOptions& options, const ProgramStreams& streams)
{
    Progress progress(streams.err, streams.err_is_terminal);
    Workshop workshop(options, streams.out, streams.err, progress);
    for (const auto& experiment : all_experiments())
        if (std::count(options.experiments.begin(), options.experiments.end(), experiment.name))
            experiment.run(options, workshop);
    return workshop.figures_complete() ? DONE : WITHOUT_FIGURES;
}

int complain(std::ostream& err, std::string reason)
{
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    err << "icp-experiments: " << reason << std::endl;
    return WRONG_INPUT;
}
}  // namespace

int icp_experiments(const std::vector<std::string>& arguments, const ProgramStreams& streams) noexcept
{
    try
    {
        const auto options = parse_experiment_options(arguments, streams.out);
        if (!options) return DONE;
        int code = WRONG_INPUT;
        // Repetitions have threads of their own; this is for what the library does within one of them.
        with_threads(options->threads, [&] { code = run(*options, streams); });
        return code;
    }
    catch (const std::bad_alloc&)
    {
        return complain(streams.err, "not enough memory");
    }
    catch (const std::exception& e)
    {
        return complain(streams.err, mp2p_icp::short_reason(e));
    }
    catch (...)
    {
        return complain(streams.err, "unknown error");
    }
}

}  // namespace mp2p_icp_apps
