#pragma once

#include <mp2p_icp/LogRecord.h>
#include <mrpt/core/optional_ref.h>

#include <optional>

namespace mp2p_icp
{
/// The log of one run, if somebody wants it: the caller, the parameters, or the environment
/// (MP2P_ICP_GENERATE_DEBUG_FILES=1).
class DebugLog
{
 public:
    DebugLog(const metric_map_t& local, const metric_map_t& global, const mrpt::math::TPose3D& guess,
             const Parameters& parameters, const mrpt::optional_ref<LogRecord>& wanted_by_caller);

    /// Where details go; null if nobody wants a log.
    LogRecord* record() { return record_; }

    /// Completes the record, and writes the file if one is wanted.
    void finish(const Results& results);

 private:
    std::optional<LogRecord> own_;
    LogRecord* record_ = nullptr;
    bool write_file_ = false;
};

}  // namespace mp2p_icp
