#include <gtest/gtest.h>
#include <mp2p_icp/random.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

using mp2p_icp::random_subset;
using mp2p_icp::SeededRandom;

namespace
{
/// Pearson's statistic of counts that should all be `expected`, as a number of standard deviations from its
/// mean.
double chi_square_deviations(const std::vector<size_t>& counts, double expected)
{
    double sum = 0;
    for (const size_t c : counts) sum += (double(c) - expected) * (double(c) - expected) / expected;
    const double freedom = double(counts.size()) - 1;
    return (sum - freedom) / std::sqrt(2 * freedom);
}
}  // namespace

TEST(SeededRandom, IsSplitMix64)
{
    // The reference values of the generator for seed 1234567, so that seeds mean the same for ever.
    SeededRandom random(1234567);
    EXPECT_EQ(random(), 6457827717110365317u);
    EXPECT_EQ(random(), 3203168211198807973u);
    EXPECT_EQ(random(), 9817491932198370423u);
    EXPECT_EQ(random(), 4593380528125082431u);
    EXPECT_EQ(random(), 16408922859458223821u);
}

TEST(SeededRandom, WorksWithTheStandardLibrary)
{
    static_assert(SeededRandom::min() == 0 && SeededRandom::max() == UINT64_MAX);
    SeededRandom random(1);
    std::vector<int> v = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, sorted = v;
    std::shuffle(v.begin(), v.end(), random);
    EXPECT_NE(v, sorted);
    std::sort(v.begin(), v.end());
    EXPECT_EQ(v, sorted);
}

TEST(SeededRandom, UniformFillsTheUnitIntervalEvenly)
{
    SeededRandom random(42);
    std::vector<size_t> counts(1000);
    const int n = 1000000;
    for (int i = 0; i < n; i++)
    {
        const double u = random.uniform();
        ASSERT_GE(u, 0.0);
        ASSERT_LT(u, 1.0);
        counts[static_cast<size_t>(u * 1000)]++;
    }
    EXPECT_LT(std::abs(chi_square_deviations(counts, n / 1000.0)), 4.0);
}

TEST(SeededRandom, UniformNeverReachesItsUpperEnd)
{
    SeededRandom random(5);
    const double next = std::nextafter(1.0, 2.0);  // lo + (hi - lo) u rounds to hi for half of all u
    for (int i = 0; i < 100; i++)
    {
        EXPECT_EQ(random.uniform(1.0, next), 1.0);
        const double u = random.uniform(-3.0, 2.5);
        EXPECT_GE(u, -3.0);
        EXPECT_LT(u, 2.5);
    }
    EXPECT_EQ(random.uniform(2.0, 2.0), 2.0);  // nothing else is there to return
}

TEST(SeededRandom, GaussianHasTheMomentsOfANormal)
{
    SeededRandom random(3);
    const int n = 1000000;
    double m1 = 0, m2 = 0, m4 = 0;
    int beyond_3_sigma = 0;
    for (int i = 0; i < n; i++)
    {
        const double g = random.gaussian(2.0) / 2.0;
        ASSERT_TRUE(std::isfinite(g));
        m1 += g, m2 += g * g, m4 += g * g * g * g;
        if (std::abs(g) > 3) beyond_3_sigma++;
    }
    // 4 standard deviations of each estimate: 1, sqrt(2), sqrt(96) over sqrt(n), and of the count.
    EXPECT_NEAR(m1 / n, 0.0, 4.0e-3);
    EXPECT_NEAR(m2 / n, 1.0, 4 * 1.42e-3);
    EXPECT_NEAR(m4 / n, 3.0, 4 * 9.8e-3);
    EXPECT_NEAR(beyond_3_sigma, 0.0026998 * n, 4 * std::sqrt(0.0027 * n));
    EXPECT_EQ(random.gaussian(0.0), 0.0);
}

TEST(SeededRandom, IndexIsEvenAndStaysBelowItsCount)
{
    SeededRandom random(9);
    for (const size_t count : {size_t(1), size_t(2), size_t(7), size_t(1000)})
    {
        std::vector<size_t> counts(count);
        for (size_t i = 0; i < 1000 * count; i++) counts.at(random.index(count))++;
        if (count > 1)
        {
            EXPECT_LT(std::abs(chi_square_deviations(counts, 1000)), 4.0) << count;
        }
    }
}

TEST(SeededRandom, IndexHasNoModuloBiasForHugeCounts)
{
    // A plain modulo by 3 * 2^62 would draw the lowest third twice as often.
    SeededRandom random(11);
    const size_t count = size_t(3) << 62;
    std::vector<size_t> thirds(3);
    for (int i = 0; i < 30000; i++) thirds.at(random.index(count) >> 62)++;
    EXPECT_LT(std::abs(chi_square_deviations(thirds, 10000)), 4.0);
}

TEST(SeededRandom, TheSeedDecides)
{
    SeededRandom a(1), b(1), c(2);
    EXPECT_EQ(a(), b());
    EXPECT_NE(a(), c());
}

TEST(RandomSubset, IsSortedWithoutDuplicatesAndOfTheWantedSize)
{
    for (uint64_t seed = 0; seed < 50; seed++)
        for (const size_t wanted : {size_t(0), size_t(1), size_t(5), size_t(99)})
        {
            const auto s = random_subset(100, wanted, seed);
            ASSERT_EQ(s.size(), wanted);
            for (size_t i = 0; i < s.size(); i++)
            {
                ASSERT_LT(s[i], 100u);
                if (i > 0)
                {
                    ASSERT_LT(s[i - 1], s[i]);
                }
            }
        }
}

TEST(RandomSubset, IsEverythingWhenAtLeastAllAreWanted)
{
    const std::vector<size_t> all = {0, 1, 2, 3};
    EXPECT_EQ(random_subset(4, 4, 1), all);
    EXPECT_EQ(random_subset(4, 5, 1), all);
    EXPECT_EQ(random_subset(4, SIZE_MAX, 1), all);
    EXPECT_TRUE(random_subset(0, 0, 1).empty());
    EXPECT_TRUE(random_subset(0, 3, 1).empty());
}

TEST(RandomSubset, EveryIndexHasTheSameChance)
{
    for (const size_t wanted : {size_t(1), size_t(10), size_t(45)})
    {
        const size_t count = 50, draws = 20000;
        std::vector<size_t> counts(count);
        for (uint64_t seed = 0; seed < draws; seed++)
            for (const size_t i : random_subset(count, wanted, seed)) counts[i]++;
        // Drawn without replacement: Pearson's statistic shrinks by (count - wanted) / (count - 1).
        const double p = double(wanted) / double(count);
        double sum = 0;
        for (const size_t c : counts) sum += std::pow(double(c) - p * draws, 2) / (p * (1 - p) * draws);
        sum *= double(count - 1) / double(count);
        const double freedom = double(count) - 1;
        EXPECT_LT(std::abs(sum - freedom) / std::sqrt(2 * freedom), 4.0) << "wanted " << wanted;
    }
}

TEST(RandomSubset, EveryPairHasTheSameChance)
{
    const size_t count = 8, draws = 28000;
    std::vector<size_t> counts;
    std::vector<std::vector<size_t>> pairs(count, std::vector<size_t>(count));
    for (uint64_t seed = 0; seed < draws; seed++)
    {
        const auto s = random_subset(count, 2, seed);
        pairs[s[0]][s[1]]++;
    }
    for (size_t i = 0; i < count; i++)
        for (size_t j = i + 1; j < count; j++) counts.push_back(pairs[i][j]);
    EXPECT_LT(std::abs(chi_square_deviations(counts, 1000)), 4.0);
}

TEST(RandomSubset, TheSeedDecides)
{
    EXPECT_EQ(random_subset(1000, 100, 1), random_subset(1000, 100, 1));
    EXPECT_NE(random_subset(1000, 100, 1), random_subset(1000, 100, 2));
}
