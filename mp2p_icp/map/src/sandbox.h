#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

namespace mp2p_icp
{
struct SandboxLimits
{
    uint64_t extra_memory_bytes = 0;  ///< beyond what this process has now
    double seconds = 60;
};

struct SandboxOutcome
{
    bool ok = false;
    std::string text;  ///< ok: what the task returned; else one line on what went wrong
};

/** Runs a task in a child process (a fork of this one) that cannot harm this process: whatever it does - an
 * exception, a crash, too much memory, no end - comes back as an outcome. The child's output on stdout and
 * stderr is discarded, and so is every change that it makes to memory. Takes about a millisecond, plus the
 * task.
 *
 * A fork copies only the calling thread. A lock that another thread holds at that moment stays locked in the
 * child, which then runs into its time limit; hold sandbox_mutex() around what must not be interrupted in
 * that way. Thread-safe.
 */
SandboxOutcome run_in_sandbox(const std::function<std::string()>& task, const SandboxLimits& limits);

/// Held while forking. Code that uses the same locks as the tasks do (MRPT's class registry) holds it, too.
std::mutex& sandbox_mutex();

}  // namespace mp2p_icp
