#include "debug_log.h"

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <iostream>

namespace mp2p_icp
{
namespace
{
bool environment_asks()
{
    const char* value = std::getenv("MP2P_ICP_GENERATE_DEBUG_FILES");
    return value && std::string(value) != "0" && *value;
}

metric_map_t::ConstPtr for_the_log(const metric_map_t& map, const std::function<void(metric_map_t&)>& edit)
{
    if (!edit) return map.get_shared_from_this_or_clone();
    auto copy = std::make_shared<metric_map_t>(map);
    edit(*copy);
    return copy;
}

void replace_all(std::string& text, const std::string& token, const std::string& by)
{
    for (auto at = text.find(token); at != std::string::npos; at = text.find(token, at + by.size()))
        text.replace(at, token.size(), by);
}

std::string file_name_for(const LogRecord& log, uint64_t unique)
{
    const auto id = [](const metric_map_t& m) { return m.id ? std::to_string(*m.id) : std::string(); };
    const auto label = [](const metric_map_t& m) { return m.label.value_or(""); };
    char number[24];
    std::snprintf(number, sizeof(number), "%05llu", static_cast<unsigned long long>(unique));
    std::string name = log.icpParameters.debugFileNameFormat;
    replace_all(name, "$UNIQUE_ID", number);
    replace_all(name, "$LOCAL_ID", id(*log.pcLocal)), replace_all(name, "$LOCAL_LABEL", label(*log.pcLocal));
    replace_all(name, "$GLOBAL_ID", id(*log.pcGlobal)),
        replace_all(name, "$GLOBAL_LABEL", label(*log.pcGlobal));
    return name;
}

std::atomic<uint64_t> runs_logged{0};
}  // namespace

DebugLog::DebugLog(const metric_map_t& local, const metric_map_t& global, const mrpt::math::TPose3D& guess,
                   const Parameters& parameters, const mrpt::optional_ref<LogRecord>& wanted_by_caller)
    : write_file_(parameters.generateDebugFiles || environment_asks())
{
    if (wanted_by_caller)
        record_ = &wanted_by_caller.value().get();
    else if (write_file_)
        record_ = &own_.emplace();
    else
        return;
    *record_ = LogRecord();
    record_->pcLocal = for_the_log(local, parameters.functor_before_logging_local);
    record_->pcGlobal = for_the_log(global, parameters.functor_before_logging_global);
    record_->initialGuessLocalWrtGlobal = guess;
    record_->icpParameters = parameters;
}

void DebugLog::finish(const Results& results)
{
    if (!record_) return;
    record_->icpResult = results;
    if (!write_file_) return;
    const uint64_t unique = runs_logged++;
    if (unique % record_->icpParameters.decimationDebugFiles != 0) return;
    const std::string name = file_name_for(*record_, unique);
    std::error_code ignored;
    const auto folder = std::filesystem::path(name).parent_path();
    if (!folder.empty()) std::filesystem::create_directories(folder, ignored);
    if (!record_->save_to_file(name)) std::cerr << "[mp2p_icp] cannot write the debug log '" << name << "'\n";
}

}  // namespace mp2p_icp
