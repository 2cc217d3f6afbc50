#include "repetitions.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

namespace mp2p_icp_apps::experiments
{
mp2p_icp::SeededRandom stream_of(uint64_t seed, std::initializer_list<uint64_t> path)
{
    // Each step is the output of a generator whose state the next element changes: no two paths are near.
    uint64_t state = mp2p_icp::SeededRandom(seed)();
    for (const uint64_t element : path) state = mp2p_icp::SeededRandom(state + element)();
    return mp2p_icp::SeededRandom(state);
}

std::string progress_bar(size_t done, size_t count)
{
    constexpr size_t WIDTH = 30;
    const size_t filled = count ? WIDTH * done / count : WIDTH;
    return "[" + std::string(filled, '#') + std::string(WIDTH - filled, '.') + "] " +
           std::to_string(count ? 100 * done / count : 100) + " %";
}

Repetitions::Repetitions(const std::optional<unsigned>& threads, Progress& progress)
    : threads_(threads ? *threads : std::max(1u, std::thread::hardware_concurrency())), progress_(progress)
{
}

namespace
{
/// The exception of the lowest index, from any thread.
class FirstFailure
{
 public:
    void note(size_t index)
    {
        const std::lock_guard lock(mutex_);
        if (index < index_) index_ = index, exception_ = std::current_exception();
    }
    void rethrow() const
    {
        if (exception_) std::rethrow_exception(exception_);
    }

 private:
    std::mutex mutex_;
    size_t index_ = std::numeric_limits<size_t>::max();
    std::exception_ptr exception_;
};
}  // namespace

void Repetitions::run(const std::string& what, size_t count, const std::function<void(size_t)>& work) const
{
    progress_.stage(what);
    FirstFailure failure;
    std::atomic<size_t> next{0}, done{0};
    std::atomic<bool> failed{false};
    const auto worker = [&]
    {
        // An index that was given out is worked on: so all below the first failure are.
        while (!failed)
        {
            const size_t i = next++;
            if (i >= count) break;
            try
            {
                work(i);
                progress_.detail(progress_bar(++done, count));
            }
            catch (...)
            {
                failure.note(i), failed = true;
            }
        }
    };
    std::vector<std::thread> helpers;
    for (size_t k = 1; k < std::min<size_t>(threads_, count); k++) helpers.emplace_back(worker);
    worker();
    for (auto& helper : helpers) helper.join();
    progress_.stage("");
    failure.rethrow();
}

}  // namespace mp2p_icp_apps::experiments
