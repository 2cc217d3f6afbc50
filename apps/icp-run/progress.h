#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <iosfwd>
#include <mutex>
#include <string>
#include <thread>

namespace mp2p_icp_apps
{
/** Shows, on one line of a terminal, what is going on, once that has taken a second; the line is removed at
 * the end. Does nothing when the stream is no terminal. One object per program run, used by one thread;
 * detail() by any.
 */
class Progress
{
 public:
    Progress(std::ostream& err, bool is_terminal);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void stage(const std::string& name);   ///< removes the line of the stage before; an empty name shows none
    void detail(const std::string& text);  ///< such as the number of an iteration
    void finish();                         ///< nothing is shown any more

 private:
    void show_every_second();
    void clear_line();  ///< the mutex must be held

    std::ostream& err_;
    std::mutex mutex_;
    std::condition_variable ends_;
    bool finished_ = false, line_shown_ = false;
    std::string stage_, detail_;
    std::chrono::steady_clock::time_point stage_began_;
    std::thread thread_;
};

}  // namespace mp2p_icp_apps
