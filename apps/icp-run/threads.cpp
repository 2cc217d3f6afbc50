#include "threads.h"

#include <stdexcept>

#ifdef MP2P_ICP_HAS_TBB
#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#endif

namespace mp2p_icp_apps
{
void with_threads(const std::optional<unsigned>& count, const std::function<void()>& work)
{
    if (!count) return work();
#ifdef MP2P_ICP_HAS_TBB
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, *count);
    tbb::task_arena arena(static_cast<int>(*count));  // otherwise never more than the machine has cores
    arena.execute(work);
#else
    if (*count > 1)
        throw std::invalid_argument("--threads: this program was built without TBB, so only 1 is possible");
    work();
#endif
}

}  // namespace mp2p_icp_apps
