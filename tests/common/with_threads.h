#pragma once

#ifdef MP2P_ICP_TEST_TBB
#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#endif

namespace mp2p_icp_test
{
/// Runs `work` with that many threads (more than the machine has, if asked; one in a library built without
/// TBB).
template <class Work>
void with_threads(int count, const Work& work)
{
#ifdef MP2P_ICP_TEST_TBB
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(count));
    tbb::task_arena arena(count);
    arena.execute(work);
#else
    (void)count;
    work();
#endif
}
}  // namespace mp2p_icp_test
