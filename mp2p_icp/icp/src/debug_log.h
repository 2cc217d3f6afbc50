#pragma once

#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/OptimalTF_Result.h>
#include <mrpt/core/optional_ref.h>

#include <chrono>
#include <optional>
#include <string>

namespace mp2p_icp
{
class ICP;

/// Adds the time of its own life to a sum; nothing, and no look at the clock, without one.
class StageTimer
{
 public:
    explicit StageTimer(double* seconds) : seconds_(seconds)
    {
        if (seconds_) start_ = Clock::now();
    }
    ~StageTimer()
    {
        if (seconds_) *seconds_ += std::chrono::duration<double>(Clock::now() - start_).count();
    }
    StageTimer(const StageTimer&) = delete;
    StageTimer& operator=(const StageTimer&) = delete;

 private:
    using Clock = std::chrono::steady_clock;
    double* seconds_;
    Clock::time_point start_;
};

/** The log of one run, if somebody wants it: the caller, the parameters, or the environment
 * (MP2P_ICP_GENERATE_DEBUG_FILES=1). Whatever becomes of it, the run does not notice.
 */
class DebugLog
{
 public:
    DebugLog(const ICP& icp, const metric_map_t& local, const metric_map_t& global,
             const mrpt::math::TPose3D& guess, const Parameters& parameters,
             const std::optional<mrpt::poses::CPose3DPDFGaussianInf>& prior,
             const mrpt::optional_ref<LogRecord>& wanted_by_caller);

    /// Measures a stage as long as it lives.
    StageTimer time(const char* stage) { return StageTimer(record_ ? &record_->timings_s[stage] : nullptr); }

    /// After each solve. \param before the pose at which the pairings were found \param gate m
    void add_iteration(uint32_t iteration, const mrpt::poses::CPose3D& before,
                       const OptimalTF_Result& solution, const Pairings& pairings,
                       const std::optional<double>& gate);

    /// Completes the record, and writes the file if one is wanted.
    void finish(const Results& results);

 private:
    void begin(const ICP& icp, const metric_map_t& local, const metric_map_t& global,
               const Parameters& parameters);

    std::optional<LogRecord> own_;
    LogRecord* record_ = nullptr;  ///< null if nobody wants a log
    bool write_file_ = false;
};

}  // namespace mp2p_icp
