#include <gtest/gtest.h>
#include <mp2p_icp/parallel.h>
#include <mp2p_icp/random.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>

#include "with_threads.h"

using mp2p_icp::BLOCK_SIZE;
using mp2p_icp::block_sum;
using mp2p_icp::parallel_for_blocks;
using mp2p_icp_test::with_threads;

namespace
{
std::vector<double> numbers_of_all_sizes(size_t n)
{
    mp2p_icp::SeededRandom random(7);
    std::vector<double> v(n);
    for (auto& x : v) x = random.gaussian() * std::pow(10.0, random.uniform(-12, 12));
    return v;
}

double sum_of(const std::vector<double>& v)
{
    return block_sum<double>(v.size(),
                             [&](size_t first, size_t last)
                             {
                                 double s = 0;
                                 for (size_t i = first; i < last; i++) s += v[i];
                                 return s;
                             });
}
}  // namespace

TEST(Parallel, EveryItemIsInExactlyOneBlockOfTheSameRangesForAnyNumberOfThreads)
{
    for (const size_t count :
         {size_t(1), BLOCK_SIZE - 1, BLOCK_SIZE, BLOCK_SIZE + 1, 7 * BLOCK_SIZE, 7 * BLOCK_SIZE + 5})
        for (const int threads : {1, 2, 3, 8})
            with_threads(threads,
                         [&]()
                         {
                             std::set<std::pair<size_t, size_t>> ranges;
                             std::mutex mutex;
                             parallel_for_blocks(count,
                                                 [&](size_t first, size_t last)
                                                 {
                                                     const std::lock_guard<std::mutex> lock(mutex);
                                                     EXPECT_TRUE(ranges.emplace(first, last).second);
                                                 });
                             size_t expected_first = 0;
                             for (const auto& [first, last] : ranges)
                             {
                                 EXPECT_EQ(first, expected_first);
                                 EXPECT_EQ(last, std::min(count, first + BLOCK_SIZE));
                                 expected_first = last;
                             }
                             EXPECT_EQ(expected_first, count);
                         });
}

TEST(Parallel, SumsHaveTheSameBitsOnAnyNumberOfThreads)
{
    const auto v = numbers_of_all_sizes(300 * BLOCK_SIZE + 17);
    // The order matters for these numbers: another one gives other bits, so the comparison below says
    // something.
    const std::vector<double> reversed(v.rbegin(), v.rend());
    ASSERT_NE(sum_of(v), sum_of(reversed));
    double in_order = 0;
    for (size_t b = 0; b < v.size(); b += BLOCK_SIZE)
    {
        double block = 0;
        for (size_t i = b; i < std::min(v.size(), b + BLOCK_SIZE); i++) block += v[i];
        in_order += block;
    }
    for (const int threads : {1, 2, 3, 8})
        for (int repeat = 0; repeat < 5; repeat++)
            with_threads(threads, [&]() { EXPECT_EQ(sum_of(v), in_order) << threads << " threads"; });
}

TEST(Parallel, NoItemsMeanNoCallsAndAZeroSum)
{
    parallel_for_blocks(0, [](size_t, size_t) { ADD_FAILURE() << "called"; });
    EXPECT_EQ(sum_of({}), 0.0);
}

TEST(Parallel, AnExceptionOfTheWorkReachesTheCaller)
{
    for (const int threads : {1, 2, 8})
        with_threads(threads,
                     [&]()
                     {
                         try
                         {
                             parallel_for_blocks(50 * BLOCK_SIZE,
                                                 [](size_t first, size_t)
                                                 {
                                                     if (first == 31 * BLOCK_SIZE)
                                                         throw std::out_of_range("block 31");
                                                 });
                             ADD_FAILURE() << "nothing was thrown";
                         }
                         catch (const std::out_of_range& e)
                         {
                             EXPECT_EQ(std::string(e.what()), "block 31");
                         }
                     });
    // ... and leaves nothing behind.
    std::atomic<size_t> items{0};
    parallel_for_blocks(5 * BLOCK_SIZE, [&](size_t first, size_t last) { items += last - first; });
    EXPECT_EQ(items, 5 * BLOCK_SIZE);
}

TEST(Parallel, CallsMayBeNested)
{
    const double total =
        block_sum<double>(3 * BLOCK_SIZE,
                          [](size_t, size_t)
                          {
                              return block_sum<double>(2 * BLOCK_SIZE, [](size_t first, size_t last)
                                                       { return double(last - first); });
                          });
    EXPECT_EQ(total, 3.0 * 2 * BLOCK_SIZE);
}

TEST(run_all, runs_each_task_once_and_throws_what_the_first_of_those_that_threw_did)
{
    for (const int threads : {1, 2, 4})
        mp2p_icp_test::with_threads(threads,
                                    []()
                                    {
                                        std::vector<int> runs(20, 0);
                                        std::vector<std::function<void()>> tasks;
                                        for (size_t i = 0; i < runs.size(); i++)
                                            tasks.emplace_back(
                                                [&runs, i]()
                                                {
                                                    runs[i]++;
                                                    if (i % 7 == 5)
                                                        throw std::runtime_error(std::to_string(i));
                                                });
                                        try
                                        {
                                            mp2p_icp::run_all(tasks);
                                            ADD_FAILURE() << "no exception";
                                        }
                                        catch (const std::runtime_error& e)
                                        {
                                            EXPECT_STREQ(e.what(), "5");
                                        }
                                        EXPECT_EQ(runs, std::vector<int>(20, 1));
                                    });
    mp2p_icp::run_all({});
}
