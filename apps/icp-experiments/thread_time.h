#pragma once

#include <time.h>

namespace mp2p_icp_apps::experiments
{
/// CPU time of this thread, s: what else the machine does is not in it, but for its effect on the caches.
inline double thread_time()
{
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace mp2p_icp_apps::experiments
