#include <mp2p_icp/Matcher_Points_InlierRatio.h>
#include <mp2p_icp/errors.h>

#include <cmath>

#include "expect_problem.h"
#include "matcher_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
std::vector<BruteForce::Candidate> nearest_fraction(const BruteForce& brute, size_t count)
{
    auto all = brute.candidates(1, [](size_t) { return std::numeric_limits<float>::infinity(); });
    std::sort(all.begin(), all.end(),
              [](const auto& a, const auto& b)
              { return std::pair(a.dist_sq, a.local) < std::pair(b.dist_sq, b.local); });
    all.resize(std::min(count, all.size()));
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.local < b.local; });
    return all;
}
}  // namespace

TEST(InlierRatio, KeepsExactlyTheNearestFraction)
{
    SeededRandom random(1);
    for (const double ratio : {0.001, 0.1, 0.5, 0.83, 0.999})
        for (const size_t n : {size_t(1), size_t(37), size_t(150)})
        {
            const Cloud g = random_cloud(60, 5, random()), l = random_cloud(n, 5, random());
            const CPose3D pose = small_pose(random);
            const auto count = static_cast<size_t>(std::lround(ratio * double(n)));
            const auto kept = nearest_fraction(BruteForce(g, l, pose), count);
            EXPECT_EQ(kept.size(), count);
            Matcher_Points_InlierRatio m(ratio);
            const Pairings one_to_one = matched(m, raw_map(g), raw_map(l), pose);
            EXPECT_EQ(index_pairs(one_to_one), BruteForce::indices(BruteForce::one_to_one(kept)));
            m.allowMatchAlreadyMatchedGlobalPoints_ = true;
            const Pairings shared = matched(m, raw_map(g), raw_map(l), pose);
            EXPECT_EQ(index_pairs(shared), BruteForce::indices(kept));
            EXPECT_EQ(shared.potential_pairings, n);
        }
}

TEST(InlierRatio, HasNoLimitOfDistance)
{
    const Pairings p =
        matched(Matcher_Points_InlierRatio(0.9), raw_map({{0, 0, 0}}), raw_map({{1e6f, 0, 0}}));
    EXPECT_EQ(p.size(), 1u);
    EXPECT_FALSE(Matcher_Points_InlierRatio(0.9).gate({}).has_value());
}

TEST(InlierRatio, TiesGoToTheLowerLocalIndex)
{
    Cloud g, l;  // four pairs at the same distance
    for (int i = 0; i < 4; i++) g.push_back({10.0f * float(i), 0, 0}), l.push_back({10.0f * float(i), 1, 0});
    EXPECT_EQ(index_pairs(matched(Matcher_Points_InlierRatio(0.5), raw_map(g), raw_map(l))),
              (IndexPairs{{0, 0}, {1, 1}}));
}

TEST(InlierRatio, BadPointsDoNotCount)
{
    Cloud g = random_cloud(20, 5, 1), l = random_cloud(20, 5, 2);
    const IndexPairs clean = index_pairs(matched(Matcher_Points_InlierRatio(0.5), raw_map(g), raw_map(l)));
    for (int i = 0; i < 20; i++) l.push_back({NaN, 0, 0}), g.push_back({0, NaN, 0});
    const Pairings p = matched(Matcher_Points_InlierRatio(0.5), raw_map(g), raw_map(l));
    EXPECT_EQ(index_pairs(p), clean);
    EXPECT_EQ(p.potential_pairings, 20u);
    EXPECT_TRUE(matched(Matcher_Points_InlierRatio(0.5), raw_map({}), raw_map(l)).empty());
    EXPECT_TRUE(matched(Matcher_Points_InlierRatio(0.5), raw_map(g), raw_map({})).empty());
}

TEST(InlierRatio, HasTheSamePairsOnAnyNumberOfThreads)
{
    const metric_map_t g = raw_map(random_cloud(20000, 10, 1)), l = raw_map(random_cloud(20000, 10, 2));
    IndexPairs one;
    with_threads(1, [&]() { one = index_pairs(matched(Matcher_Points_InlierRatio(0.7), g, l)); });
    for (const int threads : {2, 8})
        with_threads(threads,
                     [&]() { EXPECT_EQ(index_pairs(matched(Matcher_Points_InlierRatio(0.7), g, l)), one); });
}

TEST(InlierRatio, TheRatioIsRequiredAndStrictlyBetweenZeroAndOne)
{
    const auto load = [](const std::string& text)
    {
        Matcher_Points_InlierRatio m;
        m.initialize(yaml_from_text(text));
        return m.inliersRatio;
    };
    EXPECT_EQ(load("inliersRatio: 0.6"), 0.6);
    for (const char* bad : {"0", "1", "-0.1", "1.1", ".nan"})
        expect_problem_with<ConfigError>({"inliersRatio", "(0, 1)"},
                                         [&]() { load(std::string("inliersRatio: ") + bad); });
    expect_problem_with<ConfigError>({"'inliersRatio'", "missing"}, [&]() { load("{}"); });
    expect_problem_with<ConfigError>({"did you mean 'inliersRatio'"}, [&]() { load("inlierRatio: 0.5"); });
}
