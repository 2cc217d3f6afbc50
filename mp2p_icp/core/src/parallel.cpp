#include <mp2p_icp/parallel.h>

#include <algorithm>
#include <exception>

#ifdef MP2P_ICP_HAS_TBB
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace mp2p_icp
{
void parallel_for_blocks(size_t count, const std::function<void(size_t first, size_t last)>& work)
{
    const size_t blocks = (count + BLOCK_SIZE - 1) / BLOCK_SIZE;
    const auto do_block = [&](size_t b) { work(b * BLOCK_SIZE, std::min(count, (b + 1) * BLOCK_SIZE)); };
#ifdef MP2P_ICP_HAS_TBB
    if (blocks <= 1)
    {
        if (blocks == 1) do_block(0);
        return;
    }
    tbb::parallel_for(size_t(0), blocks, do_block);
#else
    for (size_t b = 0; b < blocks; b++) do_block(b);
#endif
}

void run_all(const std::vector<std::function<void()>>& tasks)
{
    std::vector<std::exception_ptr> thrown(tasks.size());
    const auto run = [&](size_t i)
    {
        try
        {
            tasks[i]();
        }
        catch (...)
        {
            thrown[i] = std::current_exception();
        }
    };
#ifdef MP2P_ICP_HAS_TBB
    tbb::parallel_for(size_t(0), tasks.size(), run);
#else
    for (size_t i = 0; i < tasks.size(); i++) run(i);
#endif
    for (const auto& exception : thrown)
        if (exception) std::rethrow_exception(exception);
}

size_t threads_at_hand()
{
#ifdef MP2P_ICP_HAS_TBB
    return static_cast<size_t>(tbb::this_task_arena::max_concurrency());
#else
    return 1;
#endif
}

}  // namespace mp2p_icp
