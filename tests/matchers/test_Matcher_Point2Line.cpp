#include <mp2p_icp/Matcher_Point2Line.h>
#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/synthetic/random_pose.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cmath>

#include "../icp/icp_test_tools.h"
#include "expect_problem.h"
#include "surface_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using PointToLine = Matcher_Point2Line;

namespace
{
PointToLine loaded(const std::string& text)
{
    PointToLine m;
    m.initialize(yaml_from_text(text, "f.yaml"), {"f.yaml", "params"});
    return m;
}

/// The line that a local point should be paired with, by all the rules; what is unsure ends the search.
std::pair<Answer, SlowPca> expected_line(const PointToLine& m, double threshold, const BruteForce& clouds,
                                         size_t local, const std::vector<uint32_t>& nearest)
{
    for (const uint32_t g : nearest)
    {
        const SlowPca pca(clouds.global, g, m.knn, m.searchRadius);
        const Answer answer =
            all_of({pca.count < m.minimumLinePoints ? Answer::No : Answer::Yes,
                    less(pca.values[1], m.lineEigenThreshold * pca.values[2]),
                    less(pca.direction.cross(to_double(clouds.moved[local]) - pca.mean).norm(), threshold)});
        if (answer != Answer::No) return {answer, pca};
    }
    return {Answer::No, {}};
}

/// Points on x = 0, 1/8, ... 2 along the x axis, and the same 3 m above along y.
Cloud two_lines()
{
    Cloud c;
    for (int i = 0; i <= 16; i++) c.push_back(to_point({i * 0.125, 0, 0}));
    for (int i = 0; i <= 16; i++) c.push_back(to_point({0, i * 0.125, 3}));
    return c;
}
}  // namespace

// ---- Against brute force ----------------------------------------------------------------------------------

TEST(Point2Line, AgreesWithBruteForceForAllItsParameters)
{
    SeededRandom random(1);
    size_t sure = 0, unsure = 0, paired = 0;
    for (const double threshold : {0.1, 0.4})
        for (const uint32_t knn : {4u, 9u})
            for (const uint32_t tried : {1u, 4u})
            {
                SCOPED_TRACE(testing::Message() << threshold << " " << knn << " " << tried);
                const Cloud g = cloud_of_shapes(7, 60, 0.02, random()), l = scattered(g, 0.3, random());
                const CPose3D pose(0.05, -0.02, 0.03, 0.02, -0.03, 0.05);
                PointToLine m(threshold);
                m.knn = knn, m.searchRadius = 1.0, m.nearestPointsTried = tried, m.lineEigenThreshold = 0.05;
                const Pairings p = matched(m, raw_map(g), raw_map(l), pose);
                EXPECT_EQ(p.size(), p.paired_pt2ln.size());
                EXPECT_GT(p.potential_pairings, p.size());
                EXPECT_LT(p.potential_pairings, l.size()) << "those near no line say nothing";

                const BruteForce clouds(g, l, pose);
                const auto nearest = slow_nearest(clouds, tried, threshold);
                size_t next = 0;
                for (size_t i = 0; i < l.size(); i++)
                {
                    const auto [answer, pca] = expected_line(m, threshold, clouds, i, nearest[i]);
                    const bool found =
                        next < p.size() && p.paired_pt2ln[next].pt_local == mrpt::math::TPoint3D(l[i]);
                    (answer == Answer::Unsure ? unsure : sure)++;
                    if (answer != Answer::Unsure)
                    {
                        ASSERT_EQ(found, answer == Answer::Yes) << i;
                    }
                    if (!found) continue;
                    const auto& pair = p.paired_pt2ln[next++];
                    if (answer != Answer::Yes) continue;
                    paired++;
                    EXPECT_LT((to_eigen(pair.ln_global.pBase) - pca.mean).norm(), 5e-7);
                    EXPECT_LT(direction_of(pair).cross(pca.direction).norm(), 1e-6);
                    EXPECT_NEAR(direction_of(pair).norm(), 1, 1e-15);
                }
                EXPECT_EQ(next, p.size());
            }
    EXPECT_GT(paired, 300u);
    EXPECT_LT(unsure, sure / 100);
}

// ---- One rule at a time -----------------------------------------------------------------------------------

TEST(Point2Line, LinesOfExactDataAreExact)
{
    const Pairings p = matched(PointToLine(0.5), raw_map(two_lines()),
                               raw_map({{1, 0.2f, 0.1f}, {0.1f, 1, 3.3f}, {5, 5, 5}}));
    ASSERT_EQ(p.paired_pt2ln.size(), 2u);
    EXPECT_EQ(direction_of(p.paired_pt2ln[0]), Eigen::Vector3d(1, 0, 0));
    EXPECT_EQ(p.paired_pt2ln[0].ln_global.pBase, mrpt::math::TPoint3D(1, 0, 0));
    EXPECT_EQ(direction_of(p.paired_pt2ln[1]), Eigen::Vector3d(0, 1, 0));
    EXPECT_EQ(p.paired_pt2ln[1].ln_global.pBase, mrpt::math::TPoint3D(0, 1, 3));
    EXPECT_EQ(p.potential_pairings, 3u);
}

TEST(Point2Line, PlanesAndBallsHaveNoLines)
{
    SeededRandom random(2);
    Cloud plane, ball;
    add_lattice(plane, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 8, 0.125);
    for (int i = 0; i < 500; i++) ball.push_back(to_point(random.uniform(0, 1) * random_unit(random)));
    PointToLine m(1);
    m.knn = 20;
    EXPECT_TRUE(matched(m, raw_map(plane), raw_map(plane)).empty());
    EXPECT_LT(matched(m, raw_map(ball), raw_map(ball)).size(), 5u);
    m.lineEigenThreshold = 1;
    EXPECT_EQ(matched(m, raw_map(plane), raw_map(plane)).size(), plane.size());
}

TEST(Point2Line, TheLineEndsWhereItsPointsEnd)
{
    EXPECT_EQ(matched(PointToLine(0.3), raw_map(two_lines()), raw_map({{2.2f, 0, 0}})).size(), 1u);
    EXPECT_TRUE(matched(PointToLine(0.3), raw_map(two_lines()), raw_map({{2.4f, 0, 0}})).empty());
}

TEST(Point2Line, TheThresholdItselfIsTooFar)
{
    EXPECT_TRUE(matched(PointToLine(0.5), raw_map(two_lines()), raw_map({{1, 0.5f, 0}})).empty());
    EXPECT_EQ(
        matched(PointToLine(0.5), raw_map(two_lines()), raw_map({{1, std::nextafter(0.5f, 0.0f), 0}})).size(),
        1u);
}

TEST(Point2Line, OfEquallyNearGlobalPointsTheLineOfTheLowerIndexIsTaken)
{
    const metric_map_t l = raw_map({{0, 0, 1.5f}});
    const PointToLine m(2);
    Cloud g = two_lines();
    ASSERT_EQ(matched(m, raw_map(g), l).size(), 1u);
    EXPECT_EQ(matched(m, raw_map(g), l).paired_pt2ln[0].ln_global.pBase.z, 0);
    std::reverse(g.begin(), g.end());
    EXPECT_EQ(matched(m, raw_map(g), l).paired_pt2ln[0].ln_global.pBase.z, 3);
}

TEST(Point2Line, ANeighbourhoodOfTooFewPointsHasNoLine)
{
    PointToLine m(1);
    const Cloud four = {{0, 0, 0}, {0.1f, 0, 0}, {0.2f, 0, 0}, {0.3f, 0, 0}};
    m.minimumLinePoints = 4;
    EXPECT_EQ(matched(m, raw_map(four), raw_map({{0, 0.1f, 0}})).size(), 1u);
    m.minimumLinePoints = 5;
    EXPECT_TRUE(matched(m, raw_map(four), raw_map({{0, 0.1f, 0}})).empty());
}

TEST(Point2Line, LocalPointsArePairedOnceWithTheWeightsOfTheirLayers)
{
    const metric_map_t g = raw_map(two_lines()), l = raw_map({{1, 0.1f, 0}, {1, 0.2f, 0}, {0, 0, 9}});
    PointToLine m(0.3);
    m.weight_pt2pt_layers["raw"]["raw"] = 3;
    MatchState state(g, l);
    Pairings p;
    m.match(g, l, {}, {}, state, p);
    m.match(g, l, {}, {}, state, p);
    EXPECT_EQ(expanded_weights(p.pt2ln_weights, p.paired_pt2ln.size()), (std::vector<double>{3, 3}));
    EXPECT_EQ(state.localPairedBitField.point_layers.at("raw"), (std::vector<bool>{true, true, false}));
    EXPECT_EQ(p.potential_pairings, 4u);
}

TEST(Point2Line, TheThresholdIsAFormulaAndTheGate)
{
    const PointToLine m = loaded("distanceThreshold: 2 - ICP_ITERATION");
    EXPECT_EQ(m.gate({1, {{"ICP_ITERATION", 1}}}), 1.0);
    const metric_map_t g = raw_map(two_lines()), l = raw_map({{1, 1.25f, 0}});
    EXPECT_EQ(matched(m, g, l, {}, {0, {{"ICP_ITERATION", 0}}}).size(), 1u);
    EXPECT_TRUE(matched(m, g, l, {}, {1, {{"ICP_ITERATION", 1}}}).empty());
}

TEST(Point2Line, CostsAreTheSquaredDistancesToTheLines)
{
    Cloud with_one_alone = two_lines();
    with_one_alone.push_back({0, 0, 20});
    const metric_map_t g = raw_map(with_one_alone),
                       l = raw_map({{1.0625f, 0.25f, 0}, {0, 0, 9}, {NaN, 0, 0}, {0, 0, 20.25f}});
    MatchState state(g, l);
    const PointToLine m(0.3);
    Pairings p;
    m.match(g, l, {}, {}, state, p);
    const auto costs = m.truncated_costs(g, l, {}, {}, state, 1.0);
    ASSERT_EQ(costs.size(), 3u);
    EXPECT_EQ(costs[0], 0.0625);  // its nearest point is farther
    EXPECT_EQ(costs[1], 1.0);
    EXPECT_TRUE(std::isnan(costs[2])) << "no line, and not alone: nothing is known";
}

// ---- Little and bad data, threads, YAML -------------------------------------------------------------------

TEST(Point2Line, PointsThatAreNotFiniteAreNeitherPairedNorInTheWay)
{
    const Cloud g = cloud_of_shapes(7, 60, 0.002, 5), l = scattered(g, 0.1, 6);
    const Pairings expected = matched(PointToLine(0.3), raw_map(g), raw_map(l));
    ASSERT_GT(expected.size(), 50u);
    const auto dirty = [](const Cloud& cloud)
    {
        Cloud out;
        for (size_t i = 0; i < cloud.size(); i++)
        {
            if (i % 4 == 0) out.push_back({NaN, 0, 0}), out.push_back({0, NaN, NaN});
            out.push_back(cloud[i]);
        }
        return raw_map(out);
    };
    expect_same_pairings(matched(PointToLine(0.3), dirty(g), dirty(l)), expected);
}

TEST(Point2Line, EmptyAndTinyLayersPairNothing)
{
    const metric_map_t good = raw_map(two_lines()), none = raw_map({}), one = raw_map({{0, 0, 0}}),
                       two = raw_map({{0, 0, 0}, {0.1f, 0, 0}}), bad = raw_map({{NaN, 0, 0}});
    for (const auto* few : {&none, &one, &two, &bad})
    {
        EXPECT_TRUE(matched(PointToLine(1), *few, good).empty());
        EXPECT_EQ(matched(PointToLine(1), good, *few).size(), few == &bad ? 0u : few->size());
    }
}

TEST(Point2Line, HasTheSameBitsOnAnyNumberOfThreads)
{
    const Cloud g = cloud_of_shapes(31, 300, 0.002, 7), l = scattered(g, 0.1, 8);
    const PointToLine m(0.3);
    Pairings one;
    with_threads(1, [&]() { one = matched(m, raw_map(g), raw_map(l)); });
    ASSERT_GT(one.size(), 500u);
    for (const int threads : {2, 8})
        with_threads(threads, [&]() { expect_same_pairings(matched(m, raw_map(g), raw_map(l)), one); });
}

TEST(Point2Line, LoadsTheKeysOfTheOriginal)
{
    const PointToLine m =
        loaded("distanceThreshold: 0.25\nknn: 6\nminimumLinePoints: 3\nlineEigenThreshold: 0.02\n");
    EXPECT_EQ(m.distanceThreshold.value(), 0.25);
    EXPECT_EQ(m.knn, 6u);
    EXPECT_EQ(m.minimumLinePoints, 3u);
    EXPECT_EQ(m.lineEigenThreshold, 0.02);
    PointToLine back;
    back.initialize(m.save_parameters());
    EXPECT_EQ(back.knn, 6u);
    EXPECT_EQ(back.lineEigenThreshold, 0.02);
}

TEST(Point2Line, MistakesInItsParametersAreNamed)
{
    const auto refused = [](const std::string& text, const std::vector<std::string>& parts)
    { expect_problem_with<ConfigError>(parts, [&]() { loaded(text); }); };
    refused("knn: 5", {"'distanceThreshold'", "missing"});
    refused("distanceThreshold: -1", {"params.distanceThreshold", "(0, inf)"});
    refused("distanceThreshold: 1\nminimumLinePoints: 2", {"params.minimumLinePoints"});
    refused("distanceThreshold: 1\nminimumLinePoints: 7\nknn: 6", {"'minimumLinePoints'", "'knn'"});
    refused("distanceThreshold: 1\nlineEigenThreshold: -1", {"params.lineEigenThreshold"});
    refused("distanceThreshold: 1\nlineEigenTreshold: 1", {"f.yaml:2", "did you mean 'lineEigenThreshold'"});
}

// ---- In ICP -----------------------------------------------------------------------------------------------

TEST(Point2Line, IcpFindsTheExactPoseOfALaserScannerAndInFewerStepsThanWithPoints)
{
    const synthetic::RayTracer room(synthetic::room_with_boxes(8, 6, 2.5, 4, 4));
    for (uint64_t seed = 1; seed <= 3; seed++)
    {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        SeededRandom random(seed);
        const CPose3D there(0, 0, 1, 0, 0, 0),
            truth = synthetic::random_pose({0.15, 0.15, 0, 0.1, 0, 0}, random);
        synthetic::LaserScanner2D scanner;
        scanner.beams = 721, scanner.aperture_deg = 359.5;
        const metric_map_t global = map_of(scan_from(room, there, scanner).points),
                           local = map_of(scan_from(room, there + truth, scanner).points);
        const auto align = [&](const Matcher::Ptr& matcher)
        {
            ICP icp;
            icp.matchers().push_back(matcher);
            icp.solvers().push_back(std::make_shared<Solver_GaussNewton>());
            Parameters parameters;
            parameters.maxIterations = 200;
            parameters.minAbsStep_trans = parameters.minAbsStep_rot = 1e-6;
            Results result;
            icp.align(local, global, CPose3D().asTPose(), parameters, result);
            return result;
        };
        const Formula threshold("max(0.03, 0.3*0.8^ICP_ITERATION)");
        const auto lines = std::make_shared<PointToLine>();
        lines->distanceThreshold = threshold, lines->lineEigenThreshold = 1e-6;
        const auto points = std::make_shared<Matcher_Points_DistanceThreshold>();
        points->threshold = threshold, points->allowMatchAlreadyMatchedGlobalPoints_ = true;
        const Results by_lines = align(lines), by_points = align(points);
        EXPECT_EQ(by_lines.verdict, Verdict::aligned) << by_lines.verdict_reason;
        std::cout << "lines: " << translation_error(by_lines.optimal_tf.mean, truth) << " m, "
                  << by_lines.nIterations << " iterations, " << by_lines.finalPairings.size()
                  << " pairs; points: " << translation_error(by_points.optimal_tf.mean, truth) << " m, "
                  << by_points.nIterations << "\n";
        // Some 700 pairs on coordinates rounded by 2e-7 m.
        EXPECT_LT(translation_error(by_lines.optimal_tf.mean, truth), 5e-8);
        EXPECT_LT(rotation_error(by_lines.optimal_tf.mean, truth), 5e-8);
        EXPECT_GT(translation_error(CPose3D(), truth), 0.02);
        EXPECT_LT(by_lines.nIterations, by_points.nIterations);
    }
}
