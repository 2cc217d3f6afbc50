#include "measured_run.h"

#include <malloc.h>
#include <omp.h>
#include <sched.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iostream>
#include <string>

namespace compare_peers
{
namespace
{
/// A line of /proc/self/status, such as `VmHWM:`, in MB.
double status_mb(const std::string& key)
{
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
        if (word == key)
        {
            double kb = 0;
            status >> kb;
            return kb / 1024;
        }
    return 0;
}

template <class F>
double milliseconds(const F& work)
{
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// For every library, whatever its threads are made of.
void use_cpus(int threads)
{
    cpu_set_t allowed, few;
    sched_getaffinity(0, sizeof(allowed), &allowed);
    CPU_ZERO(&few);
    for (int cpu = 0, taken = 0; cpu < CPU_SETSIZE && taken < threads; cpu++)
        if (CPU_ISSET(cpu, &allowed)) CPU_SET(cpu, &few), taken++;
    sched_setaffinity(0, sizeof(few), &few);
    omp_set_num_threads(threads);
}

Measurement measure(const Method& method, const std::function<Clouds()>& load, const Task& task, int threads)
{
    const auto new_attempt = [&]
    {
        const Clouds clouds = load();
        return method.make(clouds.local, clouds.global, task);
    };
    use_cpus(threads);
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(threads));
    Measurement m;
    {
        const auto first = new_attempt();
        malloc_trim(0);
        std::ofstream("/proc/self/clear_refs") << "5" << std::flush;  // forgets the peak so far
        const double before = status_mb("VmRSS:");
        first->prepare(), first->align();
        m.peak_mb = status_mb("VmHWM:") - before;
    }
    // Times are those of a program that runs: its libraries are loaded and linked, its memory was used
    // before.
    const auto attempt = new_attempt();
    m.prepare_ms = milliseconds([&] { attempt->prepare(); });
    m.align_ms = milliseconds([&] { attempt->align(); });
    m.iterations = attempt->iterations;
    Eigen::Map<Eigen::Matrix4d>(m.T_global_local) = attempt->T_global_local;
    return m;
}
}  // namespace

std::optional<Measurement> measured_run(const Method& method, const std::function<Clouds()>& load,
                                        const Task& task, int threads)
{
    int ends[2];
    if (pipe(ends) != 0) return {};
    const pid_t child = fork();
    if (child == 0)
    {
        try
        {
            const Measurement m = measure(method, load, task, threads);
            _exit(write(ends[1], &m, sizeof(m)) == sizeof(m) ? 0 : 1);
        }
        catch (const std::exception& e)
        {
            std::cerr << method.name << ": " << e.what() << "\n";
            _exit(1);
        }
    }
    close(ends[1]);
    Measurement m;
    const bool complete = child > 0 && read(ends[0], &m, sizeof(m)) == sizeof(m);
    close(ends[0]);
    int status = 0;
    if (child > 0) waitpid(child, &status, 0);
    if (!complete) return {};
    return m;
}

}  // namespace compare_peers
