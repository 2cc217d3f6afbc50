#include <mp2p_icp/log_moments.h>
#include <mp2p_icp/map_offsets.h>
#include <mp2p_icp/numbers.h>

#include <cmath>
#include <set>
#include <stdexcept>

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

namespace
{
/// Of all iterations there are the poses, of some also the pairings.
std::set<size_t> known_iterations(const LogRecord& log)
{
    std::set<size_t> known;
    for (const auto& iteration : log.iterations) known.insert(iteration.iteration);
    if (log.iterationsDetails)
        for (const auto& [iteration, details] : *log.iterationsDetails) known.insert(iteration);
    return known;
}

std::string known_iterations_text(const LogRecord& log)
{
    const auto known = known_iterations(log);
    if (known.empty()) return "the log holds no iterations";
    std::string text = "the log holds iterations ";
    constexpr size_t SHOWN = 10;
    size_t count = 0;
    for (const size_t iteration : known)
    {
        if (++count > SHOWN) break;
        text += (count > 1 ? ", " : "") + std::to_string(iteration);
    }
    return count > SHOWN ? text + ", ... " + std::to_string(*known.rbegin()) : text;
}

const LogRecord::DebugInfoPerIteration* details_of(const LogRecord& log, size_t iteration)
{
    if (!log.iterationsDetails) return nullptr;
    const auto it = log.iterationsDetails->find(iteration);
    return it == log.iterationsDetails->end() ? nullptr : &it->second;
}

/// In stored coordinates.
const CPose3D& pose_of_iteration(const LogRecord& log, size_t iteration)
{
    if (const auto* details = details_of(log, iteration); details) return details->optimalPose;
    for (const auto& record : log.iterations)
        if (record.iteration == iteration) return record.pose;
    throw std::invalid_argument("iteration " + std::to_string(iteration) + " was not logged; " +
                                known_iterations_text(log));
}

const CPose3D& rejected_pose_of(const LogRecord& log)
{
    if (!log.icpResult.rejected_pose) throw std::invalid_argument("the log holds no rejected pose");
    return *log.icpResult.rejected_pose;
}
}  // namespace

std::string to_string(const LogMoment& moment)
{
    switch (moment.kind)
    {
        case LogMoment::Kind::Guess:
            return "guess";
        case LogMoment::Kind::Iteration:
            return "after iteration " + std::to_string(moment.iteration);
        case LogMoment::Kind::Rejected:
            return "rejected pose";
        case LogMoment::Kind::Final:
            break;
    }
    return "final pose";
}

std::vector<LogMoment> log_moments(const LogRecord& log)
{
    std::vector<LogMoment> moments{{LogMoment::Kind::Guess, 0}};
    for (const size_t iteration : known_iterations(log))
        moments.push_back({LogMoment::Kind::Iteration, iteration});
    if (log.icpResult.rejected_pose) moments.push_back({LogMoment::Kind::Rejected, 0});
    moments.push_back({LogMoment::Kind::Final, 0});
    return moments;
}

LogMoment moment_from_text(const LogRecord& log, const std::string& text)
{
    if (text == "guess") return {LogMoment::Kind::Guess, 0};
    if (text == "final") return {LogMoment::Kind::Final, 0};
    if (text == "rejected") return rejected_pose_of(log), LogMoment{LogMoment::Kind::Rejected, 0};
    const auto number = to_number(text);
    if (!number || !(*number >= 0) || *number != std::floor(*number) || *number > 1e9)
        throw std::invalid_argument(
            "expected the number of an iteration, `guess`, `rejected` or `final`, found '" + text + "'");
    const auto iteration = static_cast<size_t>(*number);
    pose_of_iteration(log, iteration);
    return {LogMoment::Kind::Iteration, iteration};
}

CPose3D pose_at(const LogRecord& log, const LogMoment& moment)
{
    switch (moment.kind)
    {
        case LogMoment::Kind::Guess:
            return CPose3D(log.initialGuessLocalWrtGlobal);
        case LogMoment::Kind::Iteration:
            return MapOffsets(*log.pcLocal, *log.pcGlobal)
                .to_original(pose_of_iteration(log, moment.iteration));
        case LogMoment::Kind::Rejected:
            return rejected_pose_of(log);
        case LogMoment::Kind::Final:
            break;
    }
    return log.icpResult.optimal_tf.mean;
}

const Pairings* pairings_at(const LogRecord& log, const LogMoment& moment, bool& stored)
{
    stored = moment.kind == LogMoment::Kind::Iteration;
    if (stored)
    {
        const auto* details = details_of(log, moment.iteration);
        return details ? &details->pairings : nullptr;
    }
    return moment.kind == LogMoment::Kind::Final ? &log.icpResult.finalPairings : nullptr;
}

}  // namespace mp2p_icp
