#include "log_browser.h"

#include <mp2p_icp/errors.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <stdexcept>

namespace mp2p_icp_apps
{
/// Can the list not be made without looking into the logs?
bool LogBrowser::needs_summaries(const ViewerOptions& o)
{
    return o.sort != "name" || !o.verdict.empty() || o.min_quality > 0 || o.max_quality < 1;
}

LogBrowser::LogBrowser(const std::vector<std::string>& inputs, const ViewerOptions& options)
{
    for (const auto& path : find_logs(inputs)) all_.emplace_back().path = path;
    logs_ = all_;
    if (!arrange(options))
        throw std::invalid_argument("no log has the verdict and quality that were asked for");
    index_ = 0;
}

void LogBrowser::go_to(long index)
{
    index_ = static_cast<size_t>(std::clamp(index, 0L, static_cast<long>(logs_.size()) - 1));
}

mp2p_icp::LogRecord::Ptr LogBrowser::read(size_t index)
{
    auto& summary = logs_.at(index);
    try
    {
        return load_log(summary.path);
    }
    catch (const std::exception& e)
    {
        summary.problem = mp2p_icp::short_reason(e), summary.known = true;
        for (auto& log : all_)
            if (log.path == summary.path) log = summary;
        return nullptr;
    }
}

bool LogBrowser::summarize(double seconds)
{
    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    while (summarized_ < all_.size())
    {
        auto& log = all_[summarized_++];
        if (!log.known) log = summary_of(log.path);
        if (std::chrono::duration<double>(Clock::now() - begin).count() > seconds) break;
    }
    return summarized_ == all_.size();
}

bool LogBrowser::arrange(const ViewerOptions& options)
{
    const std::string shown = logs_.at(index_).path;
    if (needs_summaries(options)) summarize(std::numeric_limits<double>::infinity());
    auto arranged = sorted_and_filtered(all_, options);
    if (arranged.empty()) return false;
    logs_ = std::move(arranged);
    const auto it =
        std::find_if(logs_.begin(), logs_.end(), [&](const auto& log) { return log.path == shown; });
    index_ = it == logs_.end() ? 0 : static_cast<size_t>(it - logs_.begin());
    return true;
}

}  // namespace mp2p_icp_apps
