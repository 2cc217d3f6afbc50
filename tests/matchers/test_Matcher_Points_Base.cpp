#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/Matcher_Points_InlierRatio.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <cmath>
#include <numeric>
#include <set>

#include "expect_problem.h"
#include "matcher_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Threshold = Matcher_Points_DistanceThreshold;

// ---- Layers -----------------------------------------------------------------------------------------------

TEST(MatcherPointsBase, LayersOfEqualNamesAreMatchedByDefault)
{
    metric_map_t g = map_of({{"a", random_cloud(10, 1, 1)},
                             {"b", random_cloud(10, 1, 2)},
                             {"only_global", random_cloud(10, 1, 3)}});
    metric_map_t l = map_of({{"a", random_cloud(20, 1, 4)},
                             {"b", random_cloud(30, 1, 5)},
                             {"only_local", random_cloud(10, 1, 6)}});
    // A layer that is no cloud is passed over, on either side.
    g.layers["grid"] = mrpt::maps::COccupancyGridMap2D::Create();
    l.layers["grid"] = points_map(random_cloud(5, 1, 7));
    const Threshold m(10);
    const auto pairs = m.layer_pairs(g, l);
    ASSERT_EQ(pairs.size(), 2u);
    EXPECT_EQ(pairs[0].global + pairs[0].local + pairs[1].global + pairs[1].local, "aabb");
    const Pairings p = matched(m, g, l);
    EXPECT_EQ(p.potential_pairings, 50u);
    EXPECT_EQ(matched(m, g, map_of({{"other", random_cloud(5, 1, 1)}})).potential_pairings, 0u);
}

TEST(MatcherPointsBase, NamedLayersAreMatchedWithTheirWeights)
{
    const metric_map_t g = map_of({{"g1", {{0, 0, 0}, {1, 0, 0}}}, {"g2", {{5, 0, 0}}}});
    const metric_map_t l =
        map_of({{"l1", {{0, 0.1f, 0}, {1, 0.1f, 0}}}, {"l2", {{5, 0.1f, 0}}}, {"l3", {{5, 0.2f, 0}}}});
    Threshold m(0.5);
    m.weight_pt2pt_layers["g1"]["l1"] = 0.25;
    m.weight_pt2pt_layers["g2"]["l2"] = 4;
    const Pairings p = matched(m, g, l);
    EXPECT_EQ(index_pairs(p), (IndexPairs{{0, 0}, {1, 1}, {0, 0}}));
    EXPECT_EQ(p.expanded_point_weights(), (std::vector<double>{0.25, 0.25, 4}));
    EXPECT_EQ(p.potential_pairings, 3u);
}

TEST(MatcherPointsBase, ALayerThatIsMissingIsNamedWithThoseThatAreThere)
{
    const metric_map_t g = map_of({{"raw", random_cloud(5, 1, 1)}, {"edges", random_cloud(5, 1, 1)}}),
                       l = raw_map(random_cloud(5, 1, 2));
    for (const bool missing_global : {true, false})
    {
        Threshold m(1);
        m.weight_pt2pt_layers[missing_global ? "planes" : "edges"][missing_global ? "raw" : "planes"] = 1;
        expect_problem_with<std::invalid_argument>({"planes", "raw"}, [&]() { matched(m, g, l); });
        MatchState state(g, l);
        expect_problem_with<std::invalid_argument>({"planes", "raw"},
                                                   [&]() { m.truncated_costs(g, l, {}, {}, state, 1.0); });
    }
    metric_map_t grid = raw_map(random_cloud(5, 1, 1));
    grid.layers["raw"] = mrpt::maps::COccupancyGridMap2D::Create();
    Threshold m(1);
    m.weight_pt2pt_layers["raw"]["raw"] = 1;
    EXPECT_THROW(matched(m, grid, l), std::invalid_argument);
}

// ---- Several matchers -------------------------------------------------------------------------------------

TEST(MatcherPointsBase, ALaterMatcherSeesOnlyWhatIsStillUnpaired)
{
    const Cloud g = {{0, 0, 0}, {10, 0, 0}}, l = {{0, 0.1f, 0}, {0, 0.4f, 0}, {10, 0.4f, 0}};
    const auto near = std::make_shared<Threshold>(0.2), far = std::make_shared<Threshold>(1.0);
    // near: local 0 with global 0. far: local 1's nearest is taken; local 2 pairs.
    const Pairings p = run_matchers({near, far}, raw_map(g), raw_map(l), {}, {});
    EXPECT_EQ(index_pairs(p), (IndexPairs{{0, 0}, {1, 2}}));
    EXPECT_EQ(p.potential_pairings, 3u + 2u);

    far->allowMatchAlreadyMatchedPoints_ = true;  // local 0 again, but global 0 is taken
    EXPECT_EQ(index_pairs(run_matchers({near, far}, raw_map(g), raw_map(l), {}, {})),
              (IndexPairs{{0, 0}, {1, 2}}));

    far->allowMatchAlreadyMatchedGlobalPoints_ = true;
    EXPECT_EQ(index_pairs(run_matchers({near, far}, raw_map(g), raw_map(l), {}, {})),
              (IndexPairs{{0, 0}, {0, 0}, {0, 1}, {1, 2}}));

    far->allowMatchAlreadyMatchedPoints_ = false;
    EXPECT_EQ(index_pairs(run_matchers({near, far}, raw_map(g), raw_map(l), {}, {})),
              (IndexPairs{{0, 0}, {0, 1}, {1, 2}}));
}

TEST(MatcherPointsBase, TwoMatchersAgreeWithBruteForce)
{
    SeededRandom random(3);
    const Cloud g = random_cloud(60, 3, 4), l = random_cloud(80, 3, 5);
    const CPose3D pose = small_pose(random);
    const BruteForce brute(g, l, pose);
    const auto first = BruteForce::one_to_one(brute.candidates(1, [](size_t) { return 0.25f; }));
    std::set<uint32_t> used_global, used_local;
    for (const auto& c : first) used_global.insert(c.global), used_local.insert(c.local);
    std::vector<BruteForce::Candidate> second;
    for (const auto& c : brute.candidates(1, [](size_t i) { return i < 1000 ? 4.0f : 0.0f; }))
        if (!used_global.count(c.global) && !used_local.count(c.local)) second.push_back(c);
    second = BruteForce::one_to_one(second);
    ASSERT_GT(second.size(), 3u);
    IndexPairs expected = BruteForce::indices(first);
    for (const auto& c : second) expected.emplace_back(c.global, c.local);
    EXPECT_EQ(index_pairs(run_matchers({std::make_shared<Threshold>(0.5), std::make_shared<Threshold>(2.0)},
                                       raw_map(g), raw_map(l), pose, {})),
              expected);
}

TEST(MatcherPointsBase, AStateIsGoodForManyRounds)
{
    // Scratch memory of earlier rounds, at other poses, leaves no trace.
    SeededRandom random(6);
    const metric_map_t g = raw_map(random_cloud(300, 3, 1)), l = raw_map(random_cloud(200, 3, 2));
    const matcher_list_t list = {std::make_shared<Threshold>(0.4),
                                 std::make_shared<Matcher_Points_InlierRatio>(0.5)};
    MatchState state(g, l);
    for (int k = 0; k < 20; k++)
    {
        const CPose3D pose = k % 5 == 4 ? CPose3D(1000, 0, 0, 0, 0, 0) : small_pose(random);
        EXPECT_EQ(index_pairs(run_matchers(list, g, l, pose, {}, state)),
                  index_pairs(run_matchers(list, g, l, pose, {})));
    }
}

// ---- Subsets ----------------------------------------------------------------------------------------------

TEST(MatcherPointsBase, ALimitOfLocalPointsTakesARandomSubsetAndNotTheFirst)
{
    const Cloud cloud = random_cloud(100, 50, 1);
    std::vector<int> used(100);
    const int draws = 2000;
    Threshold m(0.01);
    m.maxLocalPointsPerLayer_ = 20;
    for (int seed = 0; seed < draws; seed++)
    {
        m.localPointsSampleSeed_ = static_cast<uint32_t>(seed);
        const Pairings p = matched(m, raw_map(cloud), raw_map(cloud));
        ASSERT_EQ(p.size(), 20u);
        ASSERT_EQ(p.potential_pairings, 20u);
        for (const auto& [g, l] : index_pairs(p)) used[l]++;
    }
    // Drawn without replacement, each with probability 1/5: Pearson's statistic with 99 degrees of freedom.
    double chi_square = 0;
    for (const int u : used) chi_square += std::pow(u - 0.2 * draws, 2) / (0.2 * 0.8 * draws) * 99 / 100;
    EXPECT_LT(std::abs(chi_square - 99) / std::sqrt(2 * 99.0), 4.0);
}

TEST(MatcherPointsBase, TheSubsetIsDecidedByTheSeedAlone)
{
    const metric_map_t map = raw_map(random_cloud(100, 50, 1));
    Threshold m(0.01);
    m.maxLocalPointsPerLayer_ = 20;
    const IndexPairs zero = index_pairs(matched(m, map, map));
    EXPECT_EQ(index_pairs(matched(m, map, map)), zero);
    m.localPointsSampleSeed_ = 1;
    EXPECT_NE(index_pairs(matched(m, map, map)), zero);
    m.maxLocalPointsPerLayer_ = 1000;
    EXPECT_EQ(matched(m, map, map).size(), 100u);
    // The same during a run, whatever was paired in earlier rounds.
    m.maxLocalPointsPerLayer_ = 20, m.localPointsSampleSeed_ = 0;
    MatchState state(map, map);
    const auto shared = std::make_shared<Threshold>(m);
    for (int i = 0; i < 3; i++) EXPECT_EQ(index_pairs(run_matchers({shared}, map, map, {}, {}, state)), zero);
}

// ---- The truncated cost -----------------------------------------------------------------------------------

namespace
{
double sum(const std::vector<double>& values)
{
    return std::accumulate(values.begin(), values.end(), 0.0);
}
}  // namespace

TEST(MatcherPointsBase, TheTruncatedCostIsThatOfBruteForce)
{
    SeededRandom random(7);
    for (const double gate : {0.1, 0.5, 3.0})
    {
        const Cloud g = random_cloud(100, 3, random());
        Cloud l = random_cloud(150, 3, random());
        l.push_back({NaN, 0, 0});
        const CPose3D pose = small_pose(random);
        const BruteForce brute(g, l, pose);
        double expected = 0;
        for (size_t i = 0; i < 150; i++)
        {
            double nearest = gate * gate;
            for (size_t k = 0; k < 100; k++) nearest = std::min(nearest, double(brute.dist_sq(k, i)));
            expected += nearest;
        }
        Threshold m(0.7);
        m.thresholdAngularDeg = 5;
        const metric_map_t gm = raw_map(g), lm = raw_map(l);
        MatchState own(gm, lm);
        // What is paired already does not matter, nor do the matcher's own limits.
        Pairings before;
        m.match(gm, lm, pose, {}, own, before);
        const auto cost = m.truncated_costs(gm, lm, pose, {}, own, gate);
        EXPECT_NEAR(sum(cost), expected, 1e-6 * expected);
        EXPECT_EQ(cost.size(), 150u);
        const auto other = Matcher_Points_InlierRatio(0.5).truncated_costs(gm, lm, pose, {}, own, gate);
        EXPECT_EQ(sum(other), sum(cost));
    }
}

TEST(MatcherPointsBase, TheTruncatedCostOfNothingInReachIsTheGateForEachPoint)
{
    const metric_map_t g = raw_map(random_cloud(10, 1, 1)), empty = raw_map({}),
                       l = raw_map(random_cloud(20, 1, 2));
    for (const auto* global : {&g, &empty})
    {
        MatchState state(*global, l);
        const auto cost =
            Threshold(1).truncated_costs(*global, l, CPose3D(100, 0, 0, 0, 0, 0), {}, state, 0.5);
        EXPECT_EQ(sum(cost), 20 * 0.25);
        EXPECT_EQ(cost.size(), 20u);
    }
    MatchState state(g, empty);
    EXPECT_EQ(Threshold(1).truncated_costs(g, empty, {}, {}, state, 0.5).size(), 0u);
}

// ---- One-to-one -------------------------------------------------------------------------------------------

TEST(KeepBestPerGlobal, KeepsTheNearestInTheGivenOrderAndCleansUp)
{
    std::vector<uint32_t> best;
    for (int round = 0; round < 2; round++)
    {
        std::vector<PairCandidate> c = {{0, 3, 2.0f}, {1, 1, 5.0f}, {2, 3, 1.0f},
                                        {3, 3, 1.0f}, {4, 0, 9.0f}, {5, 1, 4.0f}};
        keep_best_per_global(c, 4, best);
        ASSERT_EQ(c.size(), 3u);
        EXPECT_EQ(c[0].local, 2u);
        EXPECT_EQ(c[1].local, 4u);
        EXPECT_EQ(c[2].local, 5u);
    }
    std::vector<PairCandidate> none;
    keep_best_per_global(none, 4, best);
    EXPECT_TRUE(none.empty());
    std::vector<PairCandidate> other_size = {{0, 9, 1.0f}};
    keep_best_per_global(other_size, 10, best);
    EXPECT_EQ(other_size.size(), 1u);
}
