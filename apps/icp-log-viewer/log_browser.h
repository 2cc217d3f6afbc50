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

    /// Reads what the list needs to know of the logs of which nothing is known, for about so long.
    /// Returns whether it knows all.
    bool summarize(double seconds);
    size_t summarized() const { return summarized_; }  ///< how many, of all()
    size_t all() const { return all_.size(); }         ///< also of those that are not in the list now
    static bool needs_summaries(const ViewerOptions& options);

    /// Orders and chooses anew, when it knows all that this needs; keeps the log that is shown if it still is
    /// there. Returns false, and changes nothing, if none would be left.
    bool arrange(const ViewerOptions& options);

    /// Of a log that cannot be read, null; its summary says why.
    mp2p_icp::LogRecord::Ptr read(size_t index);

 private:
    std::vector<LogSummary> all_, logs_;
    size_t summarized_ = 0;
    size_t index_ = 0;
};

}  // namespace mp2p_icp_apps
