#include "log_browser.h"

#include <mp2p_icp/errors.h>

#include <algorithm>
#include <stdexcept>

namespace mp2p_icp_apps
{
namespace
{
/// Can the list be made without reading the logs?
bool needs_summaries(const ViewerOptions& o)
{
    return o.sort != "name" || !o.verdict.empty() || o.min_quality > 0 || o.max_quality < 1;
}
}  // namespace

LogBrowser::LogBrowser(const std::vector<std::string>& inputs, const ViewerOptions& options)
{
    for (const auto& path : find_logs(inputs)) all_.push_back({path, {}, 0, ""});
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
        auto log = load_log(summary.path);
        summary = summary_of(summary.path, *log);
        return log;
    }
    catch (const std::exception& e)
    {
        summary.problem = mp2p_icp::short_reason(e);
        return nullptr;
    }
}

void LogBrowser::summarize_all()
{
    if (summarized_) return;
    logs_ = all_;
    for (size_t i = 0; i < logs_.size(); i++) read(i);
    all_ = logs_;
    summarized_ = true;
}

bool LogBrowser::arrange(const ViewerOptions& options)
{
    const std::string shown = logs_.at(index_).path;
    const auto before = logs_;
    if (needs_summaries(options)) summarize_all();
    auto arranged = sorted_and_filtered(all_, options);
    if (arranged.empty()) return logs_ = before, false;
    logs_ = std::move(arranged);
    const auto it =
        std::find_if(logs_.begin(), logs_.end(), [&](const auto& log) { return log.path == shown; });
    index_ = it == logs_.end() ? 0 : static_cast<size_t>(it - logs_.begin());
    return true;
}

}  // namespace mp2p_icp_apps
