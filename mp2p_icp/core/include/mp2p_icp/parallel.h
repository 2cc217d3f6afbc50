#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace mp2p_icp
{
/// How many items one block of block_sum() and parallel_for_blocks() holds. Fixed: it decides the bits of
/// sums.
constexpr size_t BLOCK_SIZE = 1024;

/** Calls `work(first, last)` for the consecutive ranges [0,BLOCK_SIZE), [BLOCK_SIZE, 2*BLOCK_SIZE), ... of
 * `count` items, on as many threads as TBB gives (one without TBB). The ranges do not depend on the number of
 * threads, so work that only writes to its own range gives the same result on any number of them. An
 * exception of `work` reaches the caller.
 */
void parallel_for_blocks(size_t count, const std::function<void(size_t first, size_t last)>& work);

/** Runs all tasks, at once if TBB gives threads, and returns when all have ended. They must not write to the
 * same things. If any throw, the exception of the first one in the list that did reaches the caller.
 */
void run_all(const std::vector<std::function<void()>>& tasks);

/// How many threads parallel_for_blocks() may use here and now.
size_t threads_at_hand();

/** Sum of `part(first, last)` over the blocks of `count` items, always added in the order of the blocks:
 * bit-identical on any number of threads. `Sum` needs a default value of zero and `+=`.
 */
template <class Sum, class Part>
Sum block_sum(size_t count, const Part& part)
{
    if (count <= BLOCK_SIZE) return count > 0 ? part(size_t(0), count) : Sum{};
    std::vector<Sum> sums((count + BLOCK_SIZE - 1) / BLOCK_SIZE);
    parallel_for_blocks(count,
                        [&](size_t first, size_t last) { sums[first / BLOCK_SIZE] = part(first, last); });
    Sum total{};
    for (const Sum& s : sums) total += s;
    return total;
}

}  // namespace mp2p_icp
