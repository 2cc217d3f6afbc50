#include "log_files.h"

#include <mp2p_icp/errors.h>

#include <algorithm>
#include <filesystem>

namespace mp2p_icp_apps
{
using mp2p_icp::DataError;
using mp2p_icp::LogRecord;

namespace
{
bool ends_with(const std::string& text, const std::string& end)
{
    return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

bool is_log_name(const std::string& path)
{
    return ends_with(path, ".icplog") || ends_with(path, ".icplog.gz");
}

std::vector<std::string> logs_in_folder(const std::string& folder)
{
    std::vector<std::string> logs;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.is_regular_file() && is_log_name(entry.path().string()))
            logs.push_back(entry.path().string());
    if (logs.empty()) throw DataError(folder, "there is no .icplog file in this folder");
    std::sort(logs.begin(), logs.end());
    return logs;
}

/// From what cannot be trusted to what can; logs that cannot be read are last.
int rank_of(const LogSummary& log)
{
    using mp2p_icp::Verdict;
    if (!log.problem.empty()) return 7;
    switch (log.verdict)
    {
        case Verdict::failed:
            return 0;
        case Verdict::diverged:
            return 1;
        case Verdict::no_overlap:
            return 2;
        case Verdict::worse_than_guess:
            return 3;
        case Verdict::under_constrained:
            return 4;
        case Verdict::aligned:
            break;
    }
    return 5;
}

bool is_wanted(const LogSummary& log, const ViewerOptions& o)
{
    if (!log.problem.empty()) return o.verdict.empty() && o.min_quality == 0 && o.max_quality == 1;
    if (!o.verdict.empty() && to_string(log.verdict) != o.verdict) return false;
    return log.quality >= o.min_quality && log.quality <= o.max_quality;
}
}  // namespace

std::vector<std::string> find_logs(const std::vector<std::string>& paths)
{
    std::vector<std::string> logs;
    std::error_code ignored;
    for (const auto& path : paths)
    {
        if (!std::filesystem::exists(path, ignored)) throw DataError(path, "there is no such file or folder");
        if (!std::filesystem::is_directory(path, ignored))
        {
            logs.push_back(path);
            continue;
        }
        const auto found = logs_in_folder(path);
        logs.insert(logs.end(), found.begin(), found.end());
    }
    return logs;
}

bool is_map_path(const std::string& path)
{
    return ends_with(path, ".mm") || ends_with(path, ".mm.gz");
}

LogRecord::Ptr load_log(const std::string& path)
{
    return std::make_shared<LogRecord>(LogRecord::load_from_file(path));
}

LogSummary summary_of(const std::string& path)
{
    LogSummary out;
    out.path = path, out.known = true;
    try
    {
        const auto headline = mp2p_icp::read_log_headline(path);
        out.verdict = headline.verdict, out.quality = headline.quality;
    }
    catch (const std::exception& e)
    {
        out.problem = mp2p_icp::short_reason(e);
    }
    return out;
}

std::vector<LogSummary> sorted_and_filtered(std::vector<LogSummary> logs, const ViewerOptions& options)
{
    const auto unwanted = [&](const LogSummary& log) { return !is_wanted(log, options); };
    logs.erase(std::remove_if(logs.begin(), logs.end(), unwanted), logs.end());
    const auto readable = [](const LogSummary& log) { return log.problem.empty(); };
    if (options.sort == "quality")
        std::stable_sort(logs.begin(), logs.end(),
                         [&](const LogSummary& a, const LogSummary& b)
                         { return std::pair(!readable(a), a.quality) < std::pair(!readable(b), b.quality); });
    if (options.sort == "verdict")
        std::stable_sort(logs.begin(), logs.end(),
                         [](const LogSummary& a, const LogSummary& b) { return rank_of(a) < rank_of(b); });
    return logs;
}

}  // namespace mp2p_icp_apps
