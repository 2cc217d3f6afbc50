#include "debug_log.h"

#include <mp2p_icp/ICP.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/pose_step.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <iostream>
#include <limits>

#include "debug_file.h"
#include "pairing_cost.h"

namespace mp2p_icp
{
namespace
{
bool environment_asks()
{
    const char* value = std::getenv("MP2P_ICP_GENERATE_DEBUG_FILES");
    return value && std::string(value) != "0" && *value;
}

/// Is this run the one of so many that is written to a file?
bool is_turn(uint32_t decimation)
{
    static std::atomic<uint64_t> runs{0};
    return runs++ % std::max(1u, decimation) == 0;
}

/// With layers of its own, so that what is done to them is not done to the caller's.
metric_map_t::Ptr deep_copy(const metric_map_t& map)
{
    auto copy = std::make_shared<metric_map_t>(map);
    for (auto& [name, layer] : copy->layers)
        if (layer) layer = std::dynamic_pointer_cast<mrpt::maps::CMetricMap>(layer->duplicateGetSmartPtr());
    return copy;
}

metric_map_t::ConstPtr for_the_log(const metric_map_t& map, const std::function<void(metric_map_t&)>& edit)
{
    if (!edit) return map.get_shared_from_this_or_clone();
    const auto copy = deep_copy(map);
    edit(*copy);
    return copy;
}

RunVariables variables_of(const PipelineRecord& pipeline)
{
    RunVariables all;
    for (const auto* stages : {&pipeline.matchers, &pipeline.solvers, &pipeline.quality})
        for (const auto& stage : *stages) all.insert(stage.variables.begin(), stage.variables.end());
    return all;
}
}  // namespace

DebugLog::DebugLog(const ICP& icp, const metric_map_t& local, const metric_map_t& global,
                   const mrpt::math::TPose3D& guess, const Parameters& parameters,
                   const std::optional<mrpt::poses::CPose3DPDFGaussianInf>& prior,
                   const mrpt::optional_ref<LogRecord>& wanted_by_caller)
    : write_file_((parameters.generateDebugFiles || environment_asks()) &&
                  is_turn(parameters.decimationDebugFiles))
{
    if (wanted_by_caller)
        record_ = &wanted_by_caller.value().get();
    else if (write_file_)
        record_ = &own_.emplace();
    else
        return;
    try
    {
        *record_ = LogRecord();
        begin(icp, local, global, parameters);
        record_->initialGuessLocalWrtGlobal = guess;
        record_->prior = prior;
    }
    catch (const std::exception& e)  // of a functor, for example
    {
        std::cerr << "[mp2p_icp] there will be no log: " << short_reason(e) << "\n";
        *record_ = LogRecord();
        record_ = nullptr;
    }
}

void DebugLog::begin(const ICP& icp, const metric_map_t& local, const metric_map_t& global,
                     const Parameters& parameters)
{
    record_->pcLocal = for_the_log(local, parameters.functor_before_logging_local);
    record_->pcGlobal = for_the_log(global, parameters.functor_before_logging_global);
    record_->localWasEdited = static_cast<bool>(parameters.functor_before_logging_local);
    record_->globalWasEdited = static_cast<bool>(parameters.functor_before_logging_global);
    record_->icpParameters = parameters;
    record_->pipeline = PipelineRecord::of(icp);
    record_->dynamicVariables = variables_of(record_->pipeline);
    record_->environment = this_environment();
}

void DebugLog::add_iteration(uint32_t iteration, const mrpt::poses::CPose3D& before,
                             const OptimalTF_Result& solution, const Pairings& pairings,
                             const std::optional<double>& gate)
{
    if (!record_) return;
    const auto timer = time("log");
    const auto& pose = solution.optimalPose;
    IterationRecord r;
    r.iteration = iteration, r.pose = pose, r.rank = solution.rank;
    const PoseStep step = step_between(before, pose);
    r.step_trans = step.metres, r.step_rot = step.radians;
    r.gate = gate.value_or(std::numeric_limits<double>::infinity());
    r.pairings = {pairings.paired_pt2pt.size(), pairings.paired_pt2ln.size(), pairings.paired_pt2pl.size(),
                  pairings.paired_ln2ln.size(), pairings.paired_pl2pl.size()};
    r.potential_pairings = pairings.potential_pairings;
    const auto cost = pairing_cost(pairings, pose);
    r.cost = cost.weighted, r.residual_rms = cost.residual_rms;
    record_->iterations.push_back(r);
    const auto& parameters = record_->icpParameters;
    if (!parameters.saveIterationDetails ||
        iteration % std::max(1u, parameters.decimationIterationDetails) != 0)
        return;
    if (!record_->iterationsDetails) record_->iterationsDetails.emplace();
    (*record_->iterationsDetails)[iteration] = {pose, pairings};
}

void DebugLog::finish(const Results& results)
{
    if (!record_) return;
    try
    {
        record_->icpResult = results;
        if (write_file_) write_debug_file(*record_);
    }
    catch (const std::exception& e)
    {
        std::cerr << "[mp2p_icp] cannot write the debug log: " << short_reason(e) << "\n";
    }
}

}  // namespace mp2p_icp
