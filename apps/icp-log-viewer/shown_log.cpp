#include "shown_log.h"

#include <mp2p_icp/errors.h>

#include <algorithm>
#include <filesystem>

namespace mp2p_icp_apps
{
using mp2p_icp::LogScene;

ShownLog::ShownLog(const std::string& path, const mp2p_icp::LogRecord::Ptr& log, const std::string& problem)
    : path_(path), problem_(problem)
{
    if (!log) return;
    try
    {
        scene_ = std::make_unique<LogScene>(mp2p_icp::LogRecord::ConstPtr(log));
        moments_ = log_moments(*log);
        moment_index_ = moments_.size() - 1;
    }
    catch (const std::exception& e)
    {
        problem_ = mp2p_icp::short_reason(e);
    }
}

ShownLog::ShownLog(const std::string& path, const mp2p_icp::metric_map_t::ConstPtr& map)
    : path_(path), scene_(std::make_unique<LogScene>(map))
{
}

std::string ShownLog::file_name() const
{
    return std::filesystem::path(path_).filename().string();
}

void ShownLog::go_to_moment(long index)
{
    if (!scene_ || moments_.empty()) return;
    const auto wanted = static_cast<size_t>(std::clamp(index, 0L, static_cast<long>(moments_.size()) - 1));
    try
    {
        scene_->show(moments_[wanted]);
        moment_index_ = wanted;
        problem_.clear();
    }
    catch (const std::exception& e)
    {
        problem_ = mp2p_icp::short_reason(e);
    }
}

}  // namespace mp2p_icp_apps
