#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/errors.h>

#include <cmath>
#include <thread>

#include "expect_problem.h"
#include "matcher_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Threshold = Matcher_Points_DistanceThreshold;

namespace
{
Threshold loaded(const std::string& text)
{
    Threshold m;
    m.initialize(yaml_from_text(text, "f.yaml"), {"f.yaml", "params"});
    return m;
}
}  // namespace

// ---- Against brute force ----------------------------------------------------------------------------------

TEST(DistanceThreshold, AgreesWithBruteForceForAllItsParameters)
{
    SeededRandom random(1);
    for (const double threshold : {0.3, 1.0, 100.0})
        for (const double angular_deg : {0.0, 3.0})
            for (const uint32_t k : {1u, 3u, 60u})
                for (const bool shared : {false, true})
                {
                    const Cloud g = random_cloud(50, 5, random()), l = random_cloud(80, 5, random());
                    const CPose3D pose = small_pose(random);
                    const BruteForce brute(g, l, pose);
                    const double angle = angular_deg * M_PI / 180;
                    auto expected =
                        brute.candidates(k,
                                         [&](size_t i) {
                                             return static_cast<float>(threshold * threshold +
                                                                       angle * angle * brute.range_sq(i));
                                         });
                    if (!shared) expected = BruteForce::one_to_one(expected);
                    Threshold m(threshold);
                    m.thresholdAngularDeg = angular_deg, m.pairingsPerPoint = double(k);
                    m.allowMatchAlreadyMatchedGlobalPoints_ = shared;
                    const Pairings p = matched(m, raw_map(g), raw_map(l), pose);
                    EXPECT_EQ(index_pairs(p), BruteForce::indices(expected))
                        << threshold << " " << angular_deg << " " << k << " " << shared;
                    EXPECT_EQ(p.potential_pairings, 80u * k);
                    for (const auto& x : p.paired_pt2pt)
                    {
                        const auto d =
                            pose.composePoint(mrpt::math::TPoint3D(x.local)) - mrpt::math::TPoint3D(x.global);
                        EXPECT_NEAR(x.errorSquareAfterTransformation, d.sqrNorm(), 1e-12);
                        EXPECT_EQ(mrpt::math::TPoint3D(x.global), mrpt::math::TPoint3D(g[x.globalIdx]));
                        EXPECT_EQ(mrpt::math::TPoint3D(x.local), mrpt::math::TPoint3D(l[x.localIdx]));
                    }
                }
}

TEST(DistanceThreshold, LargeCloudsAgreeWithBruteForce)
{
    SeededRandom random(2);
    const Cloud g = random_cloud(3000, 10, 3), l = random_cloud(5000, 10, 4);
    const CPose3D pose = small_pose(random);
    const BruteForce brute(g, l, pose);
    const auto expected = BruteForce::one_to_one(brute.candidates(1, [](size_t) { return 0.25f; }));
    ASSERT_GT(expected.size(), 100u);
    EXPECT_EQ(index_pairs(matched(Threshold(0.5), raw_map(g), raw_map(l), pose)),
              BruteForce::indices(expected));
}

// ---- One rule at a time -----------------------------------------------------------------------------------

TEST(DistanceThreshold, ThePoseMovesTheLocalPointsOntoTheGlobalOnes)
{
    // A pose applied the wrong way round, or not at all, pairs nothing here.
    const CPose3D pose(10, 20, 30, 1.5, 0, 0);
    const Cloud l = random_cloud(50, 3, 1);
    Cloud g;
    for (const auto& p : l) g.push_back(TPoint3Df(pose.composePoint(mrpt::math::TPoint3D(p))));
    const Pairings p = matched(Threshold(0.01), raw_map(g), raw_map(l), pose);
    ASSERT_EQ(p.size(), 50u);
    for (const auto& [a, b] : index_pairs(p)) EXPECT_EQ(a, b);
    EXPECT_TRUE(matched(Threshold(0.01), raw_map(g), raw_map(l)).empty());
}

TEST(DistanceThreshold, TheThresholdItselfIsTooFar)
{
    const metric_map_t l = raw_map({{0, 0, 0}});
    EXPECT_TRUE(matched(Threshold(0.5), raw_map({{0.5f, 0, 0}}), l).empty());
    EXPECT_EQ(matched(Threshold(0.5), raw_map({{std::nextafter(0.5f, 0.0f), 0, 0}}), l).size(), 1u);
    Threshold no_margin(0.5);
    no_margin.bounding_box_intersection_check_epsilon_ = 0;
    EXPECT_EQ(matched(no_margin, raw_map({{std::nextafter(0.5f, 0.0f), 0, 0}}), l).size(), 1u);
}

TEST(DistanceThreshold, AmongEquallyNearLocalPointsTheLowerIndexWins)
{
    // In an order in which the last would win by overwriting.
    EXPECT_EQ(index_pairs(matched(Threshold(2), raw_map({{0, 0, 0}}),
                                  raw_map({{0, 0, 1.5f}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}}))),
              (IndexPairs{{0, 1}}));
}

TEST(DistanceThreshold, AmongEquallyNearGlobalPointsTheLowerIndexWins)
{
    EXPECT_EQ(index_pairs(matched(Threshold(2), raw_map({{0, 0, 1.5f}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}}),
                                  raw_map({{0, 0, 0}}))),
              (IndexPairs{{1, 0}}));
}

TEST(DistanceThreshold, TheBestPairWinsAGlobalPointNotTheFirst)
{
    const Cloud l = {{0.3f, 0, 0}, {0.1f, 0, 0}, {0.2f, 0, 0}};
    EXPECT_EQ(index_pairs(matched(Threshold(1), raw_map({{0, 0, 0}}), raw_map(l))), (IndexPairs{{0, 1}}));
    Threshold shared(1);
    shared.allowMatchAlreadyMatchedGlobalPoints_ = true;
    EXPECT_EQ(index_pairs(matched(shared, raw_map({{0, 0, 0}}), raw_map(l))),
              (IndexPairs{{0, 0}, {0, 1}, {0, 2}}));
}

TEST(DistanceThreshold, TheAngularTermGrowsWithTheRangeFromTheLocalOrigin)
{
    // 1 degree at 100 m: 1.745 m. The pose moves the local origin far from the global one: only the local
    // range counts.
    const CPose3D pose(1000, 0, 0, 0, 0, 0);
    Threshold m(0.1);
    m.thresholdAngularDeg = 1.0;
    const auto reach = std::sqrt(0.1 * 0.1 + std::pow(M_PI / 180 * 100, 2));
    for (const double offset : {reach * 0.999, reach * 1.001})
    {
        const Pairings p =
            matched(m, raw_map({{1100, static_cast<float>(offset), 0}}), raw_map({{100, 0, 0}}), pose);
        EXPECT_EQ(p.size(), offset < reach ? 1u : 0u);
    }
    EXPECT_TRUE(matched(m, raw_map({{1000, 0.11f, 0}}), raw_map({{0, 0, 0}}), pose).empty());
    EXPECT_EQ(matched(m, raw_map({{1000, 0.09f, 0}}), raw_map({{0, 0, 0}}), pose).size(), 1u);
}

TEST(DistanceThreshold, FormulasSeeTheVariablesOfTheRun)
{
    const Threshold m = loaded(
        "threshold: 2 - ICP_ITERATION\nthresholdAngularDeg: 0*ICP_ITERATION\npairingsPerPoint: 1 + "
        "(ICP_ITERATION < 1)");
    const metric_map_t g = raw_map({{0, 0, 0}, {1.5f, 0, 0}}), l = raw_map({{0, 0, 0}});
    EXPECT_EQ(matched(m, g, l, {}, {0, {{"ICP_ITERATION", 0}}}).size(), 2u);
    EXPECT_EQ(matched(m, g, l, {}, {1, {{"ICP_ITERATION", 1}}}).size(), 1u);
    EXPECT_EQ(m.gate({1, {{"ICP_ITERATION", 1}}}), 1.0);
    MatchState state(g, l);
    Pairings out;
    expect_problem_with<std::runtime_error>({"ICP_ITERATION"}, [&]() { m.match(g, l, {}, {}, state, out); });
    expect_problem_with<std::runtime_error>({"threshold", "(0, inf)"},
                                            [&]() {
                                                m.match(g, l, {}, {2, {{"ICP_ITERATION", 2}}}, state, out);
                                            });
    EXPECT_THROW(m.gate({2, {{"ICP_ITERATION", 3}}}), std::runtime_error);
}

TEST(DistanceThreshold, PairingsPerPointIsAWholeNumber)
{
    const metric_map_t g = raw_map({{0, 0, 0}}), l = raw_map({{0, 0, 0}});
    for (const double bad : {0.0, 0.5, 1.5, 1001.0})
    {
        Threshold m(1);
        m.pairingsPerPoint = bad;
        MatchState state(g, l);
        Pairings out;
        expect_problem_with<std::runtime_error>({"pairingsPerPoint"},
                                                [&]() { m.match(g, l, {}, {}, state, out); });
    }
}

TEST(DistanceThreshold, TheGateIsTheThreshold)
{
    EXPECT_EQ(Threshold(0.75).gate({}), 0.75);
}

// ---- Points that are not finite, and clouds far apart -----------------------------------------------------

TEST(DistanceThreshold, PointsThatAreNotFiniteAreNeitherPairedNorInTheWay)
{
    SeededRandom random(5);
    const float inf = std::numeric_limits<float>::infinity();
    for (const float bad : {NaN, inf, -inf})
        for (const bool in_global : {true, false})
        {
            const Cloud g = random_cloud(200, 5, 6), l = random_cloud(200, 5, 7);
            const IndexPairs expected = index_pairs(matched(Threshold(1), raw_map(g), raw_map(l)));
            ASSERT_GT(expected.size(), 50u);
            // Bad points between the good ones shift the indices behind them.
            Cloud dirty;
            std::vector<uint32_t> place;
            for (const auto& p : in_global ? g : l)
            {
                if (random.uniform() < 0.3) dirty.push_back({bad, 0, 0}), dirty.push_back({0, 0, bad});
                place.push_back(static_cast<uint32_t>(dirty.size()));
                dirty.push_back(p);
            }
            dirty.push_back({0, bad, 0});
            IndexPairs moved = expected;
            for (auto& [a, b] : moved) (in_global ? a : b) = place[in_global ? a : b];
            const Pairings p = in_global ? matched(Threshold(1), raw_map(dirty), raw_map(l))
                                         : matched(Threshold(1), raw_map(g), raw_map(dirty));
            EXPECT_EQ(index_pairs(p), moved) << bad << " " << in_global;
            EXPECT_EQ(p.potential_pairings, 200u);
        }
}

TEST(DistanceThreshold, BadPointsDoNotHideTheGoodOnesBeforeOrBehindThem)
{
    // A box of the cloud that forgot all before (or behind) a NaN would leave nothing within reach.
    for (const size_t bad : {size_t(1), size_t(4), size_t(5), size_t(8)})
        for (const float at : {10.0f, -10.0f})
        {
            Cloud g(8, {at, at, at});
            g.insert(g.end(), bad, {NaN, NaN, NaN});
            g.insert(g.end(), 8, {-at, -at, -at});
            EXPECT_EQ(matched(Threshold(0.1), raw_map(g), raw_map({{at, at, at}})).size(), 1u)
                << bad << " " << at;
            EXPECT_EQ(matched(Threshold(0.1), raw_map(g), raw_map({{-at, -at, -at}})).size(), 1u)
                << bad << " " << at;
        }
}

TEST(DistanceThreshold, CloudsOfOnlyBadPointsOrNonePairNothing)
{
    const metric_map_t good = raw_map(random_cloud(10, 1, 1)), bad = raw_map({{NaN, 0, 0}, {0, NaN, 0}}),
                       none = raw_map({});
    for (const auto* g : {&good, &bad, &none})
        for (const auto* l : {&good, &bad, &none})
        {
            const Pairings p = matched(Threshold(1), *g, *l);
            EXPECT_EQ(p.empty(), g != &good || l != &good);
            EXPECT_EQ(p.potential_pairings, l == &good ? 10u : 0u);
        }
}

TEST(DistanceThreshold, APoseThatIsNotFinitePairsNothing)
{
    const metric_map_t m = raw_map(random_cloud(10, 1, 1));
    EXPECT_TRUE(matched(Threshold(1), m, m, CPose3D(double(NaN), 0, 0, 0, 0, 0)).empty());
}

TEST(DistanceThreshold, CloudsFarApartStillHaveTheirPotential)
{
    const Pairings p = matched(Threshold(1), raw_map(random_cloud(10, 1, 1)), raw_map(random_cloud(20, 1, 2)),
                               CPose3D(100, 0, 0, 0, 0, 0));
    EXPECT_TRUE(p.empty());
    EXPECT_EQ(p.potential_pairings, 20u);
}

TEST(DistanceThreshold, TheQuickTestForFarCloudsLosesNoPair)
{
    // One point each, in every direction and just near enough, with the least margin.
    SeededRandom random(8);
    for (int k = 0; k < 300; k++)
    {
        const double size = std::pow(10.0, random.uniform(-2, 4)), reach = random.uniform(0.01, 1) * size;
        const Eigen::Vector3d u =
            Eigen::Vector3d(random.gaussian(), random.gaussian(), random.gaussian()).normalized() * reach *
            0.999;
        const Eigen::Vector3d g(random.uniform(-size, size), random.uniform(-size, size),
                                random.uniform(-size, size)),
            l = g + u;
        Threshold m(reach);
        m.bounding_box_intersection_check_epsilon_ = 0;
        const auto cloud = [](const Eigen::Vector3d& p) {
            return raw_map(
                {{static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())}});
        };
        EXPECT_EQ(matched(m, cloud(g), cloud(l)).size(), 1u) << k;
    }
}

// ---- Threads ----------------------------------------------------------------------------------------------

TEST(DistanceThreshold, HasTheSameBitsOnAnyNumberOfThreads)
{
    const metric_map_t g = raw_map(random_cloud(20000, 10, 1)), l = raw_map(random_cloud(20000, 10, 2));
    Threshold m(0.5);
    m.pairingsPerPoint = 2;
    Pairings one;
    with_threads(1, [&]() { one = matched(m, g, l); });
    for (const int threads : {2, 8})
        with_threads(threads,
                     [&]()
                     {
                         const Pairings p = matched(m, g, l);
                         EXPECT_EQ(index_pairs(p), index_pairs(one));
                         for (size_t i = 0; i < std::min(p.size(), one.size()); i++)
                         {
                             const double a = p.paired_pt2pt[i].errorSquareAfterTransformation,
                                          b = one.paired_pt2pt[i].errorSquareAfterTransformation;
                             ASSERT_EQ(a, b);
                         }
                     });
}

TEST(DistanceThreshold, OneMatcherAndOneMapServeSeveralThreads)
{
    const Threshold m(0.5);
    for (int repeat = 0; repeat < 20; repeat++)
    {
        // Fresh maps each time: their lazily made parts are made by all threads at once.
        const metric_map_t g = raw_map(random_cloud(2000, 5, 1)), l = raw_map(random_cloud(500, 5, 2));
        std::vector<IndexPairs> found(4);
        std::vector<std::thread> threads;
        for (auto& f : found) threads.emplace_back([&]() { f = index_pairs(matched(m, g, l)); });
        for (auto& t : threads) t.join();
        ASSERT_GT(found[0].size(), 100u);
        for (const auto& f : found) ASSERT_EQ(f, found[0]);
    }
}

// ---- YAML -------------------------------------------------------------------------------------------------

TEST(DistanceThreshold, LoadsTheKeysOf022)
{
    const Threshold m = loaded(
        "threshold: 0.25\npairingsPerPoint: 2\nmaxLocalPointsPerLayer: 50\nlocalPointsSampleSeed: "
        "7\nallowMatchAlreadyMatchedPoints: true\n"
        "allowMatchAlreadyMatchedGlobalPoints: true\nkdtree_leaf_max_points: 20\nrunFromIteration: "
        "1\nrunUpToIteration: 9\n"
        "pointLayerMatches:\n  - {global: \"raw\", local: \"decimated\", weight: 2.5}\n  - {global: raw, "
        "local: raw}\n");
    EXPECT_EQ(m.threshold.value(), 0.25);
    EXPECT_EQ(m.thresholdAngularDeg.value(), 0);
    EXPECT_EQ(m.pairingsPerPoint.value(), 2);
    EXPECT_EQ(m.maxLocalPointsPerLayer_, 50u);
    EXPECT_EQ(m.localPointsSampleSeed_, 7u);
    EXPECT_TRUE(m.allowMatchAlreadyMatchedPoints_);
    EXPECT_TRUE(m.allowMatchAlreadyMatchedGlobalPoints_);
    EXPECT_EQ(m.kdtree_leaf_max_points_, 20u);
    EXPECT_EQ(m.runFromIteration, 1u);
    EXPECT_EQ(m.runUpToIteration, 9u);
    EXPECT_EQ(m.weight_pt2pt_layers,
              (decltype(m.weight_pt2pt_layers){{"raw", {{"decimated", 2.5}, {"raw", 1.0}}}}));
}

TEST(DistanceThreshold, LoadsTheKeysOfNewerReleases)
{
    const Threshold m = loaded(
        "threshold: 0.5 + 2*exp(-ICP_ITERATION)\nthresholdAngularDeg: 1.5\npairingsPerPoint: 1\nenabled: "
        "false\n"
        "bounding_box_intersection_check_epsilon: 0.4\n");
    EXPECT_NEAR(m.threshold.value({{"ICP_ITERATION", 1}}), 0.5 + 2 * std::exp(-1), 1e-15);
    EXPECT_EQ(m.thresholdAngularDeg.value(), 1.5);
    EXPECT_FALSE(m.enabled);
    EXPECT_EQ(m.bounding_box_intersection_check_epsilon_, 0.4);
}

TEST(DistanceThreshold, MistakesInItsParametersAreNamed)
{
    const auto refused = [](const std::string& text, const std::vector<std::string>& parts)
    { expect_problem_with<ConfigError>(parts, [&]() { loaded(text); }); };
    refused("pairingsPerPoint: 1", {"'threshold'", "missing"});
    refused("threshold: 0", {"params.threshold", "(0, inf)"});
    refused("threshold: -1", {"params.threshold"});
    refused("threshold: 1\nthresholdAngularDeg: -1", {"f.yaml:2", "params.thresholdAngularDeg"});
    refused("threshold: 1\npairingsPerPoint: 0", {"params.pairingsPerPoint"});
    refused("threshold: 1\nthresholdAngular: 1", {"f.yaml:2", "did you mean 'thresholdAngularDeg'"});
    refused("threshold: 1\npointLayerMatches: raw", {"params.pointLayerMatches", "list"});
    refused("threshold: 1\npointLayerMatches:\n  - {global: raw}\n",
            {"params.pointLayerMatches[0]", "'local'"});
    refused("threshold: 1\npointLayerMatches:\n  - {global: raw, local: raw, weigth: 2}\n",
            {"f.yaml:3", "did you mean 'weight'"});
    refused("threshold: 1\npointLayerMatches:\n  - {global: raw, local: raw, weight: -2}\n",
            {"params.pointLayerMatches[0].weight"});
    refused(
        "threshold: 1\npointLayerMatches:\n  - {global: raw, local: raw}\n  - {global: raw, local: raw}\n",
        {"pointLayerMatches[1]", "twice"});
}

TEST(DistanceThreshold, WhatIsSavedLoadsAgain)
{
    const Threshold m = loaded(
        "threshold: 0.1 + 1/(1+ICP_ITERATION)\nthresholdAngularDeg: 0.3\npointLayerMatches: [{global: a, "
        "local: b, weight: 0.3}]");
    Threshold back;
    back.initialize(m.save_parameters());
    EXPECT_EQ(back.threshold.text(), m.threshold.text());
    EXPECT_EQ(back.thresholdAngularDeg.value(), 0.3);
    EXPECT_EQ(back.weight_pt2pt_layers, m.weight_pt2pt_layers);
}
