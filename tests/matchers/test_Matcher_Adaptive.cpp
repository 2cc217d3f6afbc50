#include <mp2p_icp/Matcher_Adaptive.h>
#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/synthetic/random_pose.h>
#include <mp2p_icp/synthetic/sample_by_area.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cmath>
#include <thread>

#include "../icp/icp_test_tools.h"
#include "expect_problem.h"
#include "surface_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Adaptive = Matcher_Adaptive;

namespace
{
Adaptive loaded(const std::string& text)
{
    Adaptive m;
    m.initialize(yaml_from_text(text, "f.yaml"), {"f.yaml", "params"});
    return m;
}

Adaptive only_points()
{
    Adaptive m;
    m.enableDetectPlanes = m.enableDetectLines = false;
    m.allowMatchAlreadyMatchedGlobalPoints_ = true;
    return m;
}

/// Global points 20 m apart along x, and a local point beside each, at these distances.
struct Ladder
{
    metric_map_t global, local;
    explicit Ladder(const std::vector<float>& distances)
    {
        Cloud g, l;
        for (size_t i = 0; i < distances.size(); i++)
        {
            g.push_back({20.0f * static_cast<float>(i), 0, 0});
            l.push_back({20.0f * static_cast<float>(i), distances[i], 0});
        }
        global = raw_map(g), local = raw_map(l);
    }
    /// The distances that are paired.
    std::vector<float> paired_by(const Adaptive& m) const
    {
        std::vector<float> out;
        for (const auto& pair : matched(m, global, local).paired_pt2pt)
            out.push_back(static_cast<float>(pair.local.y));
        return out;
    }
};

/// The squared threshold by the documented rule, from all distances.
float slow_threshold_sq(const Adaptive& m, const BruteForce& clouds)
{
    const double largest = m.absoluteMaxSearchDistance.value();
    std::vector<float> found;
    for (const auto& c : clouds.candidates(1, [&](size_t) { return static_cast<float>(largest * largest); }))
        found.push_back(c.dist_sq);
    std::sort(found.begin(), found.end());
    const float least = static_cast<float>(m.minimumCorrDist * m.minimumCorrDist);
    if (found.empty()) return least;
    const double rank = std::ceil(m.confidenceInterval * static_cast<double>(found.size()));
    return std::min(std::max(least, found[static_cast<size_t>(rank) - 1]),
                    static_cast<float>(largest * largest));
}
}  // namespace

// ---- The threshold ----------------------------------------------------------------------------------------

TEST(Adaptive, TheThresholdIsTheQuantileOfTheNearestDistances)
{
    const Ladder ladder({0.5f, 1.0f, 0.25f, 2.0f, 1.5f, 0.75f, 1.25f, 1.75f, 3.0f, 4.0f});
    Adaptive m = only_points();
    m.confidenceInterval = 0.5;  // the fifth of ten
    EXPECT_EQ(ladder.paired_by(m), (std::vector<float>{0.5f, 1.0f, 0.25f, 0.75f, 1.25f}));
    m.confidenceInterval = 0.41;  // the fifth, rounded up
    EXPECT_EQ(ladder.paired_by(m).size(), 5u);
    m.confidenceInterval = 0.4;
    EXPECT_EQ(ladder.paired_by(m).size(), 4u);
    m.confidenceInterval = 0.999;
    EXPECT_EQ(ladder.paired_by(m).size(), 10u);
    m.confidenceInterval = 0.001;
    EXPECT_EQ(ladder.paired_by(m), (std::vector<float>{0.25f}));
}

TEST(Adaptive, TheThresholdStaysBetweenItsLimits)
{
    const Ladder ladder({0.5f, 1.0f, 0.25f, 2.0f, 1.5f, 0.75f, 1.25f, 1.75f, 3.0f, 4.0f});
    Adaptive m = only_points();
    m.confidenceInterval = 0.1, m.minimumCorrDist = 1.0;
    EXPECT_EQ(ladder.paired_by(m), (std::vector<float>{0.5f, 1.0f, 0.25f, 0.75f}));
    // What is beyond the largest distance does not count in the quantile either.
    m.confidenceInterval = 0.5, m.minimumCorrDist = 0.1, m.absoluteMaxSearchDistance = 1.1;
    EXPECT_EQ(ladder.paired_by(m), (std::vector<float>{0.5f, 0.25f}));
    // The largest one wins.
    m.minimumCorrDist = 3;
    EXPECT_EQ(ladder.paired_by(m), (std::vector<float>{0.5f, 1.0f, 0.25f, 0.75f}));
}

TEST(Adaptive, EqualDistancesAreAllPaired)
{
    // All distances equal, and all zero: the quantile is each of them.
    for (const float d : {0.0f, 0.7f})
        EXPECT_EQ(Ladder(std::vector<float>(7, d)).paired_by(only_points()).size(), 7u);
}

TEST(Adaptive, AgreesWithBruteForceOnPoints)
{
    SeededRandom random(1);
    for (const double fraction : {0.3, 0.8})
        for (const double least : {0.01, 0.6})
            for (const uint32_t k : {1u, 4u})
                for (const bool shared : {false, true})
                {
                    SCOPED_TRACE(testing::Message() << fraction << " " << least << " " << k << " " << shared);
                    const Cloud g = random_cloud(200, 3, random()), l = random_cloud(150, 3, random());
                    Adaptive m = only_points();
                    m.confidenceInterval = fraction, m.minimumCorrDist = least,
                    m.absoluteMaxSearchDistance = 2.0;
                    m.maxPt2PtCorrespondences = k, m.firstToSecondDistanceMax = 1.5;
                    m.allowMatchAlreadyMatchedGlobalPoints_ = shared;
                    const CPose3D pose = small_pose(random);
                    const BruteForce clouds(g, l, pose);
                    const float limit = slow_threshold_sq(m, clouds);
                    const float just_above = std::nextafter(limit, std::numeric_limits<float>::infinity());
                    std::vector<BruteForce::Candidate> expected;
                    float first = 0;
                    uint32_t last = UINT32_MAX;
                    for (const auto& c : clouds.candidates(k, [&](size_t) { return just_above; }))
                    {
                        if (c.local != last) first = c.dist_sq, last = c.local;
                        if (double(c.dist_sq) <= 1.5 * 1.5 * double(first)) expected.push_back(c);
                    }
                    if (!shared) expected = BruteForce::one_to_one(expected);
                    const Pairings p = matched(m, raw_map(g), raw_map(l), pose);
                    ASSERT_GT(p.size(), 10u);
                    EXPECT_EQ(index_pairs(p), BruteForce::indices(expected));
                    EXPECT_EQ(p.size(), p.paired_pt2pt.size());
                    EXPECT_EQ(p.potential_pairings, 150u * k);
                }
}

// ---- What is paired ---------------------------------------------------------------------------------------

TEST(Adaptive, PlanesLinesAndPointsAreEachPairedByTheirShape)
{
    SeededRandom random(2);
    size_t planes = 0, lines = 0, points = 0, unsure = 0;
    for (int round = 0; round < 4; round++)
    {
        SCOPED_TRACE(round);
        const Cloud g = cloud_of_shapes(9, 60, 0.01, random()), l = scattered(g, 0.2, random());
        Adaptive m;
        m.searchRadius = 1.0, m.planeSearchPoints = 9, m.absoluteMaxSearchDistance = 1.0;
        m.planeEigenThreshold = m.lineEigenThreshold = 0.03;
        m.allowMatchAlreadyMatchedGlobalPoints_ = true;
        const Pairings p = matched(m, raw_map(g), raw_map(l));
        EXPECT_EQ(p.potential_pairings, l.size());
        const BruteForce clouds(g, l, CPose3D());
        const float limit = slow_threshold_sq(m, clouds);
        const double threshold = std::sqrt(double(limit));
        size_t plane = 0, line = 0, point = 0;
        for (const auto& c : clouds.candidates(1, [](size_t) { return 1.0f; }))
        {
            const mrpt::math::TPoint3D here(l[c.local]);
            const bool with_plane = plane < p.paired_pt2pl.size() && p.paired_pt2pl[plane].pt_local == here;
            const bool with_line = line < p.paired_pt2ln.size() && p.paired_pt2ln[line].pt_local == here;
            const bool with_point =
                point < p.paired_pt2pt.size() && p.paired_pt2pt[point].localIdx == c.local;
            plane += with_plane, line += with_line, point += with_point;
            ASSERT_EQ(int(with_plane) + int(with_line) + int(with_point), c.dist_sq <= limit ? 1 : 0);
            if (c.dist_sq > limit) continue;

            const SlowPca pca(g, c.global, 9, 1.0);
            const auto& e = pca.values;
            const Eigen::Vector3d d = to_double(clouds.moved[c.local]) - pca.mean;
            const Answer enough = pca.count < 4 ? Answer::No : Answer::Yes;
            const Answer is_line =
                all_of({enough, less(e[1], 0.03 * e[2]), less(pca.direction.cross(d).norm(), threshold)});
            const Answer is_plane = all_of({enough, less(e[0], 0.03 * e[2]), less(0.1 * e[2], e[1]),
                                            less(std::abs(pca.normal.dot(d)), threshold)});
            if (is_line == Answer::Unsure || is_plane == Answer::Unsure)
            {
                unsure++;
                continue;
            }
            ASSERT_EQ(with_line, is_line == Answer::Yes);
            ASSERT_EQ(with_plane, is_plane == Answer::Yes);
            if (with_point)
            {
                EXPECT_EQ(p.paired_pt2pt[point - 1].globalIdx, c.global);
            }
            planes += with_plane, lines += with_line, points += with_point;
        }
        EXPECT_EQ(plane + line + point, p.size());
    }
    EXPECT_GT(planes, 100u);
    EXPECT_GT(lines, 100u);
    EXPECT_GT(points, 100u);
    EXPECT_LT(unsure, 20u);
}

TEST(Adaptive, EachShapeCanBeSwitchedOff)
{
    const Cloud g = cloud_of_shapes(9, 60, 0.005, 3), l = scattered(g, 0.05, 4);
    for (const bool planes : {false, true})
        for (const bool lines : {false, true})
        {
            Adaptive m;
            m.enableDetectPlanes = planes, m.enableDetectLines = lines, m.searchRadius = 1.0;
            m.allowMatchAlreadyMatchedGlobalPoints_ = true;
            const Pairings p = matched(m, raw_map(g), raw_map(l));
            EXPECT_EQ(p.paired_pt2pl.size() > 50, planes);
            EXPECT_EQ(p.paired_pt2ln.size() > 50, lines);
            EXPECT_EQ(p.paired_pt2pl.empty(), !planes);
            EXPECT_EQ(p.paired_pt2ln.empty(), !lines);
            // What has no surface falls back to the point: as many are paired.
            EXPECT_EQ(p.size(), matched(only_points(), raw_map(g), raw_map(l)).size());
        }
}

TEST(Adaptive, PointsFarFromThePlaneArePairedWithThePointIfThatIsAsked)
{
    Cloud floor;
    add_lattice(floor, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 5, 0.125);
    const metric_map_t g = raw_map(floor), l = raw_map({{0, 0, 0.05f}, {0.25f, 0, 0.2f}});
    Adaptive m;
    m.confidenceInterval = 0.99;
    EXPECT_EQ(matched(m, g, l).paired_pt2pl.size(), 2u);
    m.planeMinimumDistance = 0.1;
    const Pairings p = matched(m, g, l);
    ASSERT_EQ(p.paired_pt2pl.size(), 1u);
    ASSERT_EQ(p.paired_pt2pt.size(), 1u);
    EXPECT_EQ(p.paired_pt2pt[0].localIdx, 1u);
}

TEST(Adaptive, NormalsPointToTheSensorWhereThatIsKnown)
{
    Cloud floor;
    add_lattice(floor, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, 5, 0.125);
    Adaptive m;
    EXPECT_EQ(normal_of(matched(m, raw_map(floor), raw_map({{0, 0, 1}})).paired_pt2pl.at(0)).z(), 1);
    m.sensorAtOrigin = true;
    EXPECT_EQ(normal_of(matched(m, raw_map(floor), raw_map({{0, 0, 1}})).paired_pt2pl.at(0)).z(), -1);
}

TEST(Adaptive, PointPairingsAreOneToOneAndSurfacesAreShared)
{
    Cloud g;
    add_lattice(g, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 5, 0.125);
    g.push_back({0, 0, 3});
    const Cloud l = {{0, 0, 0.1f}, {0, 0, 0.12f}, {0, 0, 3.2f}, {0, 0, 3.1f}};
    Adaptive m;
    m.confidenceInterval = 0.99;
    const metric_map_t global = raw_map(g), local = raw_map(l);
    MatchState run(global, local);
    Pairings p;
    m.match(global, local, {}, {}, run, p);
    EXPECT_EQ(p.paired_pt2pl.size(), 2u);
    EXPECT_EQ(index_pairs(p), (IndexPairs{{121, 3}}));
    EXPECT_EQ(run.localPairedBitField.point_layers.at("raw"), (std::vector<bool>{true, true, false, true}));
    const auto& global_paired = run.globalPairedBitField.point_layers.at("raw");
    EXPECT_EQ(std::count(global_paired.begin(), global_paired.end(), true), 1);
    EXPECT_TRUE(global_paired[121]);
    // A global point that is paired already is left alone, in the next call too.
    Pairings again;
    m.match(global, local, {}, {}, run, again);
    EXPECT_TRUE(again.empty());
    EXPECT_EQ(again.potential_pairings, 1u);
}

TEST(Adaptive, EachKindCarriesTheWeightOfTheLayers)
{
    const Cloud g = cloud_of_shapes(9, 60, 0.005, 3), l = scattered(g, 0.05, 4);
    Adaptive m;
    m.searchRadius = 1.0;
    m.weight_pt2pt_layers["raw"]["raw"] = 2.5;
    const Pairings p = matched(m, raw_map(g), raw_map(l));
    ASSERT_FALSE(p.paired_pt2pt.empty() || p.paired_pt2pl.empty() || p.paired_pt2ln.empty());
    EXPECT_EQ(p.point_weights, (WeightRuns{{p.paired_pt2pt.size(), 2.5}}));
    EXPECT_EQ(p.pt2pl_weights, (WeightRuns{{p.paired_pt2pl.size(), 2.5}}));
    EXPECT_EQ(p.pt2ln_weights, (WeightRuns{{p.paired_pt2ln.size(), 2.5}}));
}

// ---- The contract of the base, little and bad data, threads -----------------------------------------------

TEST(Adaptive, TheGateIsTheLargestDistance)
{
    const Adaptive m = loaded("absoluteMaxSearchDistance: 3 - ICP_ITERATION");
    EXPECT_EQ(m.gate({1, {{"ICP_ITERATION", 1}}}), 2.0);
    EXPECT_THROW(m.gate({3, {{"ICP_ITERATION", 3}}}), std::runtime_error);
    const metric_map_t g = raw_map({{0, 0, 0}}), l = raw_map({{2, 0, 0}});
    EXPECT_EQ(matched(m, g, l, {}, {0, {{"ICP_ITERATION", 0}}}).size(), 1u);
    EXPECT_TRUE(matched(m, g, l, {}, {1, {{"ICP_ITERATION", 1}}}).empty()) << "not at the distance itself";
}

TEST(Adaptive, CostsCompareSurfacesWithSurfacesAndPointsWithPoints)
{
    Cloud plane_and_point = {{20, 0, 0}};
    add_lattice(plane_and_point, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 6, 0.125);
    const metric_map_t g = raw_map(plane_and_point),
                       l = raw_map({{20, 0.5f, 0}, {0, 0, 9}, {NaN, 0, 0}, {0.0625f, 0, 0.25f}});
    MatchState state(g, l);
    const Adaptive m;
    Pairings p;
    m.match(g, l, {}, {}, state, p);
    const auto costs = m.truncated_costs(g, l, {}, {}, state, 1.0);
    ASSERT_EQ(costs.size(), 6u) << "of the three finite points, as surfaces and as points";
    EXPECT_TRUE(std::isnan(costs[0]));
    EXPECT_EQ(costs[1], 1.0);
    EXPECT_EQ(costs[2], 0.0625);  // its nearest point is farther
    EXPECT_EQ(costs[3], 0.25);
    EXPECT_EQ(costs[4], 1.0);
    EXPECT_TRUE(std::isnan(costs[5]));
}

TEST(Adaptive, PointsThatAreNotFiniteAreNeitherPairedNorInTheWay)
{
    const Cloud g = cloud_of_shapes(6, 60, 0.005, 5), l = scattered(g, 0.1, 6);
    Adaptive m;
    m.searchRadius = 1.0;
    const Pairings expected = matched(m, raw_map(g), raw_map(l));
    ASSERT_FALSE(expected.paired_pt2pt.empty() || expected.paired_pt2pl.empty() ||
                 expected.paired_pt2ln.empty());
    const auto dirty = [](const Cloud& cloud)
    {
        Cloud out;
        for (const auto& p : cloud) out.push_back({NaN, 0, 0}), out.push_back(p);
        return raw_map(out);
    };
    const Pairings p = matched(m, dirty(g), dirty(l));
    EXPECT_TRUE(same_bits_of(p.paired_pt2pl, expected.paired_pt2pl));
    EXPECT_TRUE(same_bits_of(p.paired_pt2ln, expected.paired_pt2ln));
    EXPECT_EQ(p.potential_pairings, expected.potential_pairings);
    IndexPairs moved = index_pairs(expected);
    for (auto& [a, b] : moved) a = 2 * a + 1, b = 2 * b + 1;
    EXPECT_EQ(index_pairs(p), moved);
}

TEST(Adaptive, EmptyAndTinyLayersAndBadPosesAreNoTrouble)
{
    const metric_map_t good = raw_map(random_cloud(20, 1, 1)), none = raw_map({}), one = raw_map({{0, 0, 0}}),
                       bad = raw_map({{NaN, 0, 0}});
    const Adaptive m;
    for (const auto* g : {&good, &none, &one, &bad})
        for (const auto* l : {&good, &none, &one, &bad})
        {
            const bool possible = (g == &good || g == &one) && (l == &good || l == &one);
            EXPECT_EQ(matched(m, *g, *l).empty(), !possible);
            EXPECT_EQ(matched(m, *g, *l).potential_pairings, l == &good ? 20u : l == &one ? 1u : 0u);
        }
    EXPECT_TRUE(matched(m, good, good, CPose3D(double(NaN), 0, 0, 0, 0, 0)).empty());
}

TEST(Adaptive, HasTheSameBitsOnAnyNumberOfThreads)
{
    const Cloud g = cloud_of_shapes(30, 300, 0.005, 7), l = scattered(g, 0.1, 8);
    Adaptive m;
    m.maxPt2PtCorrespondences = 2;
    Pairings one;
    with_threads(1, [&]() { one = matched(m, raw_map(g), raw_map(l)); });
    ASSERT_GT(one.paired_pt2pl.size(), 200u);
    ASSERT_GT(one.paired_pt2ln.size(), 50u);
    ASSERT_GT(one.paired_pt2pt.size(), 200u);
    for (const int threads : {2, 8})
        with_threads(threads, [&]() { expect_same_pairings(matched(m, raw_map(g), raw_map(l)), one); });
}

// ---- YAML -------------------------------------------------------------------------------------------------

TEST(Adaptive, LoadsTheKeysOfTheOriginal)
{
    const Adaptive m = loaded(
        "confidenceInterval: 0.75\nfirstToSecondDistanceMax: 1.3\nabsoluteMaxSearchDistance: 2.5\n"
        "enableDetectPlanes: false\nminimumCorrDist: 0.2\nplaneSearchPoints: 10\nplaneMinimumFoundPoints: 5\n"
        "planeEigenThreshold: 0.02\nmaxPt2PtCorrespondences: 3\nplaneMinimumDistance: 0.15\n");
    EXPECT_EQ(m.confidenceInterval, 0.75);
    EXPECT_EQ(m.firstToSecondDistanceMax, 1.3);
    EXPECT_EQ(m.absoluteMaxSearchDistance.value(), 2.5);
    EXPECT_FALSE(m.enableDetectPlanes);
    EXPECT_EQ(m.minimumCorrDist, 0.2);
    EXPECT_EQ(m.planeSearchPoints, 10u);
    EXPECT_EQ(m.planeMinimumFoundPoints, 5u);
    EXPECT_EQ(m.planeEigenThreshold, 0.02);
    EXPECT_EQ(m.maxPt2PtCorrespondences, 3u);
    EXPECT_EQ(m.planeMinimumDistance, 0.15);
    Adaptive back;
    back.initialize(m.save_parameters());
    EXPECT_EQ(back.confidenceInterval, 0.75);
    EXPECT_FALSE(back.enableDetectPlanes);
    EXPECT_EQ(back.planeMinimumDistance, 0.15);
}

TEST(Adaptive, MistakesInItsParametersAreNamed)
{
    const auto refused = [](const std::string& text, const std::vector<std::string>& parts)
    { expect_problem_with<ConfigError>(parts, [&]() { loaded(text); }); };
    refused("confidenceInterval: 0.5", {"'absoluteMaxSearchDistance'", "missing"});
    const std::string most = "absoluteMaxSearchDistance: 1\n";
    refused(most + "confidenceInterval: 1", {"params.confidenceInterval", "(0, 1)"});
    refused(most + "minimumCorrDist: 0", {"params.minimumCorrDist"});
    refused(most + "firstToSecondDistanceMax: 0.9", {"params.firstToSecondDistanceMax", "[1, inf)"});
    refused(most + "maxPt2PtCorrespondences: 0", {"params.maxPt2PtCorrespondences"});
    refused(most + "planeSearchPoints: 4\nplaneMinimumFoundPoints: 5",
            {"'planeMinimumFoundPoints'", "'planeSearchPoints'"});
    refused(most + "confidenceIntervall: 0.5", {"f.yaml:2", "did you mean 'confidenceInterval'"});
}

// ---- In ICP -----------------------------------------------------------------------------------------------

TEST(Adaptive, IcpConvergesInFewerStepsThanWithTheLeastThreshold)
{
    const auto room = synthetic::room_with_boxes(8, 6, 2.5, 4, 4);
    for (uint64_t seed = 1; seed <= 3; seed++)
    {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        SeededRandom random(seed);
        const CPose3D truth = synthetic::random_pose({0.4, 0.4, 0.1, 0.15, 0.03, 0.03}, random);
        const metric_map_t global = map_of(synthetic::sample_by_area(room, 8000, seed)),
                           local =
                               map_of(seen_from(truth, *synthetic::sample_by_area(room, 4000, seed + 50)));
        const auto align = [&](double largest)
        {
            const auto matcher = std::make_shared<Adaptive>();
            matcher->absoluteMaxSearchDistance = largest;
            ICP icp;
            icp.matchers().push_back(matcher);
            icp.solvers().push_back(std::make_shared<Solver_GaussNewton>());
            Parameters parameters;
            parameters.maxIterations = 100;
            parameters.maxMotionOverThreshold = 1000;  // the narrow one may go as far
            Results result;
            icp.align(local, global, CPose3D().asTPose(), parameters, result);
            return result;
        };
        const Results result = align(1.0), narrow = align(0.1);
        EXPECT_EQ(result.verdict, Verdict::aligned) << result.verdict_reason;
        const double error = translation_error(result.optimal_tf.mean, truth),
                     narrow_error = translation_error(narrow.optimal_tf.mean, truth);
        std::cout << "error " << error << " m, "
                  << mrpt::RAD2DEG(rotation_error(result.optimal_tf.mean, truth)) << " deg after "
                  << result.nIterations << ": " << result.finalPairings.contents_summary()
                  << "; with the least threshold " << narrow_error << " m after " << narrow.nIterations
                  << "\n";
        EXPECT_LT(error, 0.01);
        EXPECT_LT(rotation_error(result.optimal_tf.mean, truth), mrpt::DEG2RAD(0.1));
        EXPECT_LT(3 * result.nIterations, 2 * narrow.nIterations) << "the threshold adapts to the guess";
        EXPECT_GT(translation_error(CPose3D(), truth), 0.05) << "the identity must not pass";
    }
}
