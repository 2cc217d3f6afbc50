#pragma once

#include <mp2p_icp/random.h>

#include <functional>
#include <initializer_list>
#include <optional>
#include <string>

#include "progress.h"

namespace mp2p_icp_apps::experiments
{
/** Random numbers of one repetition: a stream of its own for every seed and path (such as study, level,
 * repetition), so that a result depends neither on the number of threads nor on what else is run.
 */
mp2p_icp::SeededRandom stream_of(uint64_t seed, std::initializer_list<uint64_t> path);

/// Does the same work many times, on several threads, with a bar on the terminal.
class Repetitions
{
 public:
    /// \param threads empty: as many as the machine has
    Repetitions(const std::optional<unsigned>& threads, Progress& progress);

    /** work(0) ... work(count - 1), each once, in any order and on any thread: each must write to a place of
     * its own. The exception of the lowest index that throws reaches the caller.
     */
    void run(const std::string& what, size_t count, const std::function<void(size_t)>& work) const;

 private:
    unsigned threads_;
    Progress& progress_;
};

/// Such as `[####......] 40 %`.
std::string progress_bar(size_t done, size_t count);

}  // namespace mp2p_icp_apps::experiments
