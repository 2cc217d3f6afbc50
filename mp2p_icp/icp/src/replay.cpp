#include <mp2p_icp/ICP.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/pose_step.h>
#include <mp2p_icp/replay.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/yaml_text.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <stdexcept>

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

namespace
{
// ---- Running ----------------------------------------------------------------------------------------------

/// The hook of a run that was stopped by one: stops after as many solves.
ICP::iteration_hook_t stop_after(size_t solves)
{
    const auto count = std::make_shared<size_t>(0);
    return [count, solves](const ICP::IterationHook_Input&)
    { return ICP::IterationHook_Output{++*count >= solves}; };
}

LogRecord run_again(const LogRecord& log)
{
    const auto icp = log.pipeline.make();
    if (log.icpResult.terminationReason == IterTermReason::HookRequest)
        icp->setIterationHook(stop_after(log.icpResult.nIterations));
    Parameters parameters = log.icpParameters;
    parameters.generateDebugFiles = parameters.debugPrintIterationProgress = false;
    parameters.functor_before_logging_local = parameters.functor_before_logging_global = {};
    LogRecord again;
    Results results;
    icp->align(*log.pcLocal, *log.pcGlobal, log.initialGuessLocalWrtGlobal, parameters, results, log.prior,
               again);
    return again;
}

// ---- Comparing --------------------------------------------------------------------------------------------

std::string bytes_of(const Results& results)
{
    mrpt::io::CMemoryStream stream;
    auto archive = mrpt::serialization::archiveFrom(stream);
    results.serializeTo(archive);
    return {static_cast<const char*>(stream.getRawBufferData()), stream.getTotalBytesCount()};
}

bool same_bits(const CPose3D& a, const CPose3D& b)
{
    const auto A = a.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>(),
               B = b.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>();
    return std::memcmp(A.data(), B.data(), 16 * sizeof(double)) == 0;
}

/// The first iteration that went another way; empty: none.
std::optional<uint32_t> first_difference(const LogRecord& a, const LogRecord& b)
{
    const size_t common = std::min(a.iterations.size(), b.iterations.size());
    for (size_t i = 0; i < common; i++)
        if (a.iterations[i].iteration != b.iterations[i].iteration ||
            !same_bits(a.iterations[i].pose, b.iterations[i].pose))
            return a.iterations[i].iteration;
    if (a.iterations.size() == b.iterations.size()) return {};
    return static_cast<uint32_t>(common);
}

/// Pose by pose, in m and rad; the pose that was rejected, too.
struct Distance
{
    double metres = 0, radians = 0;
    void consider(const CPose3D& a, const CPose3D& b)
    {
        const auto [t, r] = step_between(a, b);
        metres = std::max(metres, t), radians = std::max(radians, r);
    }
    std::string text() const { return to_text(metres) + " m, " + to_text(radians) + " rad"; }
};

Distance distance_between(const Results& a, const Results& b)
{
    Distance d;
    d.consider(a.optimal_tf.mean, b.optimal_tf.mean);
    if (a.rejected_pose && b.rejected_pose && is_finite(*a.rejected_pose) && is_finite(*b.rejected_pose))
        d.consider(*a.rejected_pose, *b.rejected_pose);
    return d;
}

/// Other processors round otherwise; poses of far-away maps have coarser last digits.
bool nearly_same(const Results& a, const Results& b)
{
    constexpr double tolerance = 1e-9, last_digits = 4e-16;
    const auto d = distance_between(a, b);
    const double rounding = last_digits * translation_of(a.optimal_tf.mean).norm();
    return a.verdict == b.verdict && a.terminationReason == b.terminationReason &&
           a.rejected_pose.has_value() == b.rejected_pose.has_value() && d.metres <= tolerance + rounding &&
           d.radians <= tolerance;
}

// ---- Explaining -------------------------------------------------------------------------------------------

void compare_text(const std::string& what, const std::string& in_log, const std::string& here,
                  std::vector<std::string>& differences)
{
    if (in_log != here) differences.push_back(what + ": '" + in_log + "' in the log, '" + here + "' here");
}

/// What makes the same program round otherwise, or be another one.
std::vector<std::string> environment_differences(const RunEnvironment& log, const RunEnvironment& here)
{
    std::vector<std::string> out;
    compare_text("version of the library", log.library_version, here.library_version, out);
    compare_text("version of MRPT", log.mrpt_version, here.mrpt_version, out);
    compare_text("compiler", log.compiler, here.compiler, out);
    compare_text("processor", log.processor, here.processor, out);
    return out;
}

void compare_parameters(const std::string& part, const yaml& in_log, const yaml& here,
                        std::vector<std::string>& differences)
{
    const auto value = [](const yaml& params, const std::string& name)
    { return params.has(name) ? to_yaml_text(yaml(params.asMap().at(name))) : std::string("absent"); };
    for (const auto* params : {&in_log, &here})
        for (const auto& [key, node] : params->asMap())
        {
            const std::string name(key.internalAsStr());
            if (params == &here && in_log.has(name)) continue;  // compared already
            compare_text("parameter " + name + " of " + part, value(in_log, name), value(here, name),
                         differences);
        }
}

/// Of a part made again: what it has for parameters, and whether it is of the class that it was.
void stage_differences(const std::vector<StageRecord>& log, const std::vector<StageRecord>& again,
                       std::vector<std::string>& differences)
{
    for (size_t i = 0; i < std::min(log.size(), again.size()); i++)
    {
        compare_parameters(log[i].class_name, log[i].params, again[i].params, differences);
        if (log[i].nameless)
            differences.push_back("a class of the program that wrote the log, derived from " +
                                  log[i].class_name + ", took part; here it is " + log[i].class_name);
    }
}

std::vector<std::string> input_differences(const LogRecord& log, const LogRecord& again)
{
    std::vector<std::string> out;
    const auto &a = log.pipeline, &b = again.pipeline;
    stage_differences(a.matchers, b.matchers, out), stage_differences(a.solvers, b.solvers, out);
    stage_differences(a.quality, b.quality, out);
    for (const auto& [edited, side] :
         {std::pair(log.localWasEdited, "local"), {log.globalWasEdited, "global"}})
        if (edited)
            out.push_back(std::string("the ") + side +
                          " map of the log was edited before it was logged (functor_before_logging)");
    return out;
}

std::string joined(const std::vector<std::string>& texts)
{
    std::string out;
    for (const auto& text : texts) out += (out.empty() ? "" : "; ") + text;
    return out;
}

std::string sentence_for_different(const LogRecord& log, const ReplayOutcome& o)
{
    const auto &a = log.icpResult, &b = o.again.icpResult;
    std::string out = "different: ";
    if (a.verdict != b.verdict)
        out += "verdict " + to_string(a.verdict) + " in the log, " + to_string(b.verdict) + " here; ";
    out += "pose by " + distance_between(a, b).text();
    if (const auto at = first_difference(log, o.again))
        out += ", from iteration " + std::to_string(*at) + " on";
    else
        out += ", all iterations the same";
    return out + ". " +
           (o.differences.empty()
                ? "No version, processor or parameter differs: the log was changed after the "
                  "run, or the run used something that it does not hold"
                : joined(o.differences));
}

std::string summary(const Results& results)
{
    return to_string(results.verdict) + " after " + std::to_string(results.nIterations) + " iterations";
}

void judge(const LogRecord& log, ReplayOutcome& o)
{
    const auto environment = environment_differences(log.environment, o.again.environment);
    o.differences = input_differences(log, o.again);
    o.differences.insert(o.differences.begin(), environment.begin(), environment.end());
    o.identical = bytes_of(log.icpResult) == bytes_of(o.again.icpResult) && !first_difference(log, o.again);
    o.same = o.identical || (!environment.empty() && nearly_same(log.icpResult, o.again.icpResult));
    if (o.identical)
        o.sentence = "same to the last bit: " + summary(log.icpResult);
    else if (o.same)
        o.sentence = "same to 1e-9: " + summary(log.icpResult) + "; pose by " +
                     distance_between(log.icpResult, o.again.icpResult).text() + ". " + joined(o.differences);
    else
    {
        if (log.environment.threads != o.again.environment.threads)
            compare_text("threads", std::to_string(log.environment.threads),
                         std::to_string(o.again.environment.threads), o.differences);
        o.sentence = sentence_for_different(log, o);
    }
}
}  // namespace

ReplayOutcome replay(const LogRecord& log)
{
    if (!log.pcLocal || !log.pcGlobal) throw std::invalid_argument("replay: the log lacks a map");
    ReplayOutcome out;
    try
    {
        out.again = run_again(log);
    }
    catch (const std::exception& e)
    {
        out.sentence = "different: it cannot be run again: " + short_reason(e);
        return out;
    }
    judge(log, out);
    return out;
}

}  // namespace mp2p_icp
