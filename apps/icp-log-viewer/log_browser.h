#pragma once

#include <functional>

#include "log_files.h"

namespace mp2p_icp_apps
{
/** Walks over the logs that were given: which is shown, which of its moments, in which order. Logs are read
 * when they are needed; what was read of them for the list is kept. No window here.
 */
class LogBrowser
{
 public:
    /// \exception mp2p_icp::DataError as find_logs(); std::invalid_argument if no log fits the options.
    LogBrowser(const std::vector<std::string>& inputs, const ViewerOptions& options);

    size_t size() const { return logs_.size(); }
    size_t index() const { return index_; }
    const LogSummary& at(size_t index) const { return logs_.at(index); }

    /// To another log, or as far as there are any.
    void go_to(long index);
    void step(long by) { go_to(static_cast<long>(index_) + by); }

    /// Reads them all, once, and orders and chooses anew; keeps the log that is shown if it still is there.
    /// Returns false, and changes nothing, if none would be left.
    bool arrange(const ViewerOptions& options);

    /// Of a log that cannot be read, null; its summary says why.
    mp2p_icp::LogRecord::Ptr read(size_t index);

 private:
    void summarize_all();

    std::vector<LogSummary> all_, logs_;
    bool summarized_ = false;
    size_t index_ = 0;
};

}  // namespace mp2p_icp_apps
