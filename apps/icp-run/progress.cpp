#include "progress.h"

#include <ostream>

namespace mp2p_icp_apps
{
namespace
{
constexpr const char* CLEAR_LINE = "\r\033[K";
}

Progress::Progress(std::ostream& err, bool is_terminal)
    : err_(err), stage_began_(std::chrono::steady_clock::now())
{
    if (is_terminal) thread_ = std::thread([this] { show_every_second(); });
}

Progress::~Progress()
{
    finish();
}

void Progress::stage(const std::string& name)
{
    const std::lock_guard lock(mutex_);
    clear_line();
    stage_ = name, detail_.clear();
    stage_began_ = std::chrono::steady_clock::now();
}

void Progress::detail(const std::string& text)
{
    const std::lock_guard lock(mutex_);
    detail_ = text;
}

void Progress::finish()
{
    {
        const std::lock_guard lock(mutex_);
        finished_ = true;
    }
    ends_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void Progress::show_every_second()
{
    using std::chrono::seconds;
    std::unique_lock lock(mutex_);
    while (!ends_.wait_for(lock, seconds(1), [this] { return finished_; }))
    {
        const auto took =
            std::chrono::duration_cast<seconds>(std::chrono::steady_clock::now() - stage_began_);
        if (stage_.empty() || took < seconds(1)) continue;
        err_ << CLEAR_LINE << stage_ << (detail_.empty() ? "" : ", " + detail_) << " (" << took.count()
             << " s)" << std::flush;
        line_shown_ = true;
    }
    clear_line();
}

void Progress::clear_line()
{
    if (line_shown_) err_ << CLEAR_LINE << std::flush;
    line_shown_ = false;
}

}  // namespace mp2p_icp_apps
