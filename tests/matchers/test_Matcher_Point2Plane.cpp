#include <mp2p_icp/Matcher_Point2Plane.h>
#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/synthetic/random_pose.h>
#include <mp2p_icp/synthetic/sample_by_area.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mp2p_icp_filters/FilterDecimateVoxels.h>

#include <cmath>
#include <fstream>
#include <thread>

#include "../icp/icp_test_tools.h"
#include "expect_problem.h"
#include "surface_test_tools.h"
#include "test_data.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using PointToPlane = Matcher_Point2Plane;

namespace
{
PointToPlane loaded(const std::string& text)
{
    PointToPlane m;
    m.initialize(yaml_from_text(text, "f.yaml"), {"f.yaml", "params"});
    return m;
}

/// Is there a plane around this point of the cloud?
Answer has_plane(const PointToPlane& m, const SlowPca& pca)
{
    if (pca.count < m.minimumPlanePoints) return Answer::No;
    return all_of({less(pca.values[0], m.planeEigenThreshold * pca.values[2]),
                   less(m.planeWidthThreshold * pca.values[2], pca.values[1])});
}

/// The plane that a local point should be paired with, by all the rules of the matcher; what is unsure ends
/// the search.
std::pair<Answer, SlowPca> expected_plane(const PointToPlane& m, double threshold, const BruteForce& clouds,
                                          const Eigen::Matrix3d& R, size_t local,
                                          const std::vector<uint32_t>& nearest)
{
    for (const uint32_t g : nearest)
    {
        const SlowPca pca(clouds.global, g, m.knn, m.searchRadius);
        Answer answer =
            all_of({has_plane(m, pca),
                    less(std::abs(pca.normal.dot(to_double(clouds.moved[local]) - pca.mean)), threshold)});
        if (m.localPointMustFitPlaneToo)
        {
            const SlowPca own(clouds.local, local, m.knn, m.searchRadius);
            answer =
                all_of({answer, has_plane(m, own),
                        less(m.localToGlobalPlaneMinAbsCosine, std::abs(pca.normal.dot(R * own.normal)))});
        }
        if (answer != Answer::No) return {answer, pca};
    }
    return {Answer::No, {}};
}

/// Is the local point (on a plane of its own, if it must be) alone, or near a plane that it should lie on?
Answer says_something(const PointToPlane& m, const BruteForce& clouds, size_t local,
                      const std::vector<uint32_t>& nearest)
{
    Answer answer = nearest.empty() ? Answer::Yes : Answer::No;
    for (const uint32_t g : nearest)
        answer = std::max(answer, has_plane(m, SlowPca(clouds.global, g, m.knn, m.searchRadius)));
    if (!m.localPointMustFitPlaneToo) return answer;
    return all_of({answer, has_plane(m, SlowPca(clouds.local, local, m.knn, m.searchRadius))});
}

/// A wall x = 3, a floor z = -1 and a wall y = 2, of lattices.
Cloud corner()
{
    Cloud c;
    add_lattice(c, {3, 0, 0}, {0, 1, 0}, {0, 0, 1}, 6, 0.125);
    add_lattice(c, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}, 6, 0.125);
    add_lattice(c, {0, 2, 0}, {1, 0, 0}, {0, 0, 1}, 6, 0.125);
    return c;
}
}  // namespace

// ---- Against brute force ----------------------------------------------------------------------------------

TEST(Point2Plane, AgreesWithBruteForceForAllItsParameters)
{
    SeededRandom random(1);
    size_t sure = 0, unsure = 0, paired = 0;
    for (const double threshold : {0.1, 0.4})
        for (const uint32_t knn : {6u, 12u})
            for (const uint32_t tried : {1u, 4u})
                for (const bool must_fit : {false, true})
                {
                    SCOPED_TRACE(testing::Message()
                                 << threshold << " " << knn << " " << tried << " " << must_fit);
                    const Cloud g = cloud_of_shapes(6, 60, 0.02, random()), l = scattered(g, 0.3, random());
                    const CPose3D pose(0.05, -0.02, 0.03, 0.02, -0.03, 0.05);
                    PointToPlane m(threshold);
                    m.knn = knn, m.searchRadius = 1.0, m.nearestPointsTried = tried;
                    m.planeEigenThreshold = 0.05, m.planeWidthThreshold = 0.2;
                    m.localPointMustFitPlaneToo = must_fit, m.localToGlobalPlaneMinAbsCosine = 0.7;
                    const Pairings p = matched(m, raw_map(g), raw_map(l), pose);
                    EXPECT_EQ(p.size(), p.paired_pt2pl.size());

                    const BruteForce clouds(g, l, pose);
                    const auto nearest = slow_nearest(clouds, tried, threshold);
                    size_t next = 0, potential = 0, perhaps = 0;
                    for (size_t i = 0; i < l.size(); i++)
                    {
                        const Answer says = says_something(m, clouds, i, nearest[i]);
                        potential += says == Answer::Yes, perhaps += says == Answer::Unsure;
                        const auto [answer, pca] =
                            expected_plane(m, threshold, clouds, rotation_of(pose), i, nearest[i]);
                        const bool found =
                            next < p.size() && p.paired_pt2pl[next].pt_local == mrpt::math::TPoint3D(l[i]);
                        (answer == Answer::Unsure ? unsure : sure)++;
                        if (answer != Answer::Unsure)
                        {
                            ASSERT_EQ(found, answer == Answer::Yes) << i;
                        }
                        if (!found) continue;
                        const auto& pair = p.paired_pt2pl[next++];
                        if (answer != Answer::Yes) continue;
                        paired++;
                        EXPECT_LT((to_eigen(pair.pl_global.centroid) - pca.mean).norm(), 5e-7);
                        EXPECT_LT(normal_of(pair).cross(pca.normal).norm(), 1e-5);
                    }
                    EXPECT_EQ(next, p.size());
                    EXPECT_GE(p.potential_pairings, potential);
                    EXPECT_LE(p.potential_pairings, potential + perhaps);
                    EXPECT_LT(potential, l.size());
                }
    EXPECT_GT(paired, 500u);
    EXPECT_LT(unsure, sure / 100);
}

TEST(Point2Plane, PlanesAreUnitNormalsThroughTheirCentroids)
{
    const Cloud g = cloud_of_shapes(9, 100, 0.01, 2);
    const Pairings p = matched(PointToPlane(0.3), raw_map(g), raw_map(scattered(g, 0.1, 3)));
    ASSERT_GT(p.paired_pt2pl.size(), 100u);
    for (const auto& pair : p.paired_pt2pl)
    {
        EXPECT_NEAR(normal_of(pair).norm(), 1, 1e-15);
        EXPECT_NEAR(pair.pl_global.plane.evaluatePoint(pair.pl_global.centroid), 0, 1e-14);
    }
}

// ---- Exact planes -----------------------------------------------------------------------------------------

TEST(Point2Plane, PlanesOfExactDataAreExact)
{
    const CPose3D pose(0.03, -0.02, 0.05, 0.01, 0.02, -0.01);
    Cloud l;
    for (const auto& p : corner())
        l.push_back(to_point(to_eigen(pose.inverseComposePoint(mrpt::math::TPoint3D(p)))));
    const Pairings p = matched(PointToPlane(0.2), raw_map(corner()), raw_map(l), pose);
    EXPECT_EQ(p.paired_pt2pl.size(), l.size());
    size_t of_axis[3] = {0, 0, 0};
    for (const auto& pair : p.paired_pt2pl)
    {
        Eigen::Index axis = 0;
        EXPECT_EQ(normal_of(pair).maxCoeff(&axis), 1.0);
        EXPECT_EQ(normal_of(pair).norm(), 1.0);
        EXPECT_EQ(pair.pl_global.plane.coefs[3], (axis == 0 ? -3.0 : axis == 1 ? -2.0 : 1.0));
        of_axis[axis]++;
        // Half a unit in the last place of floats up to 4 m, on each axis.
        EXPECT_NEAR(pair.pl_global.plane.evaluatePoint(pose.composePoint(pair.pt_local)), 0, 4e-7);
    }
    for (const size_t n : of_axis) EXPECT_EQ(n, 13u * 13u);
    EXPECT_TRUE(
        matched(PointToPlane(0.2), raw_map(corner()), raw_map(l), CPose3D(20, 0, 0, 0, 0, 0)).empty());
}

TEST(Point2Plane, LinesAndBallsHaveNoPlanes)
{
    SeededRandom random(4);
    Cloud line, ball;
    for (int i = 0; i < 200; i++) line.push_back(to_point(0.01 * i * Eigen::Vector3d(1, 2, 3).normalized()));
    for (int i = 0; i < 500; i++) ball.push_back(to_point(random.uniform(0, 1) * random_unit(random)));
    PointToPlane m(1);
    m.knn = 30;
    EXPECT_TRUE(matched(m, raw_map(line), raw_map(line)).empty());
    for (auto& p : line) p += to_point(0.001 * random_unit(random));
    EXPECT_TRUE(matched(m, raw_map(line), raw_map(line)).empty());
    EXPECT_LT(matched(m, raw_map(ball), raw_map(ball)).size(), 5u);
    m.planeEigenThreshold = 1;  // any blob will do now: it is this limit that kept the ball away
    EXPECT_GT(matched(m, raw_map(ball), raw_map(ball)).size(), 300u);
}

// ---- One rule at a time -----------------------------------------------------------------------------------

TEST(Point2Plane, ThePlaneEndsWhereItsPointsEnd)
{
    // In the plane z = -1 of the corner, the floor, but far from its points.
    const metric_map_t g = raw_map(corner());
    EXPECT_EQ(matched(PointToPlane(0.3), g, raw_map({{0, 0, -0.9f}})).size(), 1u);
    EXPECT_TRUE(matched(PointToPlane(0.3), g, raw_map({{-2, 0, -1}})).empty());
}

TEST(Point2Plane, TheThresholdItselfIsTooFar)
{
    const metric_map_t g = raw_map(corner());
    EXPECT_TRUE(matched(PointToPlane(0.5), g, raw_map({{0, 0, -0.5f}})).empty());
    EXPECT_EQ(matched(PointToPlane(0.5), g, raw_map({{0, 0, std::nextafter(-0.5f, -1.0f)}})).size(), 1u);
}

TEST(Point2Plane, OfEquallyNearGlobalPointsThePlaneOfTheLowerIndexIsTaken)
{
    Cloud floor_and_ceiling;
    add_lattice(floor_and_ceiling, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, 3, 0.125);
    add_lattice(floor_and_ceiling, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}, 3, 0.125);
    PointToPlane m(2);
    const auto height = [&](const Cloud& g)
    {
        const Pairings p = matched(m, raw_map(g), raw_map({{0, 0, 0}}));
        return p.paired_pt2pl.size() == 1 ? p.paired_pt2pl[0].pl_global.centroid.z : 0.0;
    };
    EXPECT_EQ(height(floor_and_ceiling), 1.0);
    std::reverse(floor_and_ceiling.begin(), floor_and_ceiling.end());
    EXPECT_EQ(height(floor_and_ceiling), -1.0);
}

TEST(Point2Plane, FartherPointsAreTriedWhereTheNearestHasNoPlane)
{
    Cloud g = corner();
    g.push_back({0, 0, -0.5f});  // alone above the floor, its neighbourhood is no plane
    const metric_map_t l = raw_map({{0, 0, -0.6f}});
    PointToPlane m(1);
    m.planeEigenThreshold = 0.001;
    EXPECT_TRUE(matched(m, raw_map(g), l).empty());
    m.nearestPointsTried = 2;
    m.searchRadius = 0.3;
    ASSERT_EQ(matched(m, raw_map(g), l).size(), 1u);
    EXPECT_EQ(matched(m, raw_map(g), l).paired_pt2pl[0].pl_global.centroid.z, -1.0);
}

TEST(Point2Plane, ANeighbourhoodOfTooFewPointsHasNoPlane)
{
    Cloud g;
    add_lattice(g, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1, 0.25);  // nine points
    PointToPlane m(1);
    m.searchRadius = 5, m.knn = 20, m.minimumPlanePoints = 9;
    EXPECT_EQ(matched(m, raw_map(g), raw_map({{0, 0, 0.1f}})).size(), 1u);
    m.minimumPlanePoints = 10;
    EXPECT_TRUE(matched(m, raw_map(g), raw_map({{0, 0, 0.1f}})).empty());
}

TEST(Point2Plane, TheLocalPlaneMustAgreeIfThatIsAsked)
{
    // The same floor, seen by a local cloud that is turned by 30 degrees about x.
    Cloud floor;
    add_lattice(floor, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 6, 0.125);
    const metric_map_t map = raw_map(floor);
    const CPose3D turned(0, 0, 0, 0, 0, 30 * M_PI / 180);
    PointToPlane m(1);
    const size_t all = matched(m, map, map, turned).size();
    EXPECT_EQ(all, floor.size());
    m.localPointMustFitPlaneToo = true;
    m.localToGlobalPlaneMinAbsCosine = std::cos(31 * M_PI / 180);
    EXPECT_EQ(matched(m, map, map, turned).size(), all);
    m.localToGlobalPlaneMinAbsCosine = std::cos(29 * M_PI / 180);
    EXPECT_TRUE(matched(m, map, map, turned).empty());
    EXPECT_EQ(matched(m, map, map).size(), all);
    // Loose local points have no plane.
    EXPECT_TRUE(matched(m, map, raw_map({{0, 0, 0}, {0.25f, 0, 0}})).empty());
}

TEST(Point2Plane, NormalsPointToTheSensorWhereThatIsKnown)
{
    PointToPlane m(0.5);
    for (const bool known : {false, true})
    {
        m.sensorAtOrigin = known;
        size_t flipped = 0;
        const Pairings p = matched(m, raw_map(corner()), raw_map(corner()));
        ASSERT_EQ(p.size(), corner().size());
        for (const auto& pair : p.paired_pt2pl)
        {
            const bool towards = normal_of(pair).dot(-to_eigen(pair.pl_global.centroid)) > 0;
            flipped += !towards;
        }
        EXPECT_EQ(flipped, known ? 0u : 2u * 13u * 13u) << "x = 3 and y = 2 lie the other way";
    }
}

TEST(Point2Plane, TheSensorOfAFarAwayScanStandsAtItsOriginalOrigin)
{
    // Stored relative to (0, 0, -2): the origin of the original coordinates is 2 m above, over the ceiling.
    metric_map_t g = raw_map(corner());
    g.set_coordinate_offset({0, 0, -2});
    PointToPlane m(0.5);
    m.sensorAtOrigin = true;
    const Pairings p = matched(m, g, raw_map({{0, 0, -0.9f}}));
    ASSERT_EQ(p.size(), 1u);
    EXPECT_EQ(normal_of(p.paired_pt2pl[0]).z(), 1);
    g.set_coordinate_offset({0, 0, 2});
    EXPECT_EQ(normal_of(matched(m, g, raw_map({{0, 0, -0.9f}})).paired_pt2pl[0]).z(), -1);
}

TEST(Point2Plane, TheTwoSidesOfAWallDifferForScans)
{
    // The global scan sees the wall x = 3 from x = 0, the local one from the other side.
    Cloud g, l;
    add_lattice(g, {3, 0, 0}, {0, 1, 0}, {0, 0, 1}, 6, 0.125);
    add_lattice(l, {-2, 0, 0}, {0, 1, 0}, {0, 0, 1}, 6, 0.125);
    const CPose3D beyond(5, 0, 0, 0, 0, 0);
    PointToPlane m(0.5);
    m.localPointMustFitPlaneToo = true;
    EXPECT_EQ(matched(m, raw_map(g), raw_map(l), beyond).size(), l.size());
    m.sensorAtOrigin = true;
    EXPECT_TRUE(matched(m, raw_map(g), raw_map(l), beyond).empty());
    EXPECT_EQ(matched(m, raw_map(g), raw_map(g)).size(), g.size());
}

TEST(Point2Plane, LocalPointsArePairedOnceAndPlanesAreNotUsedUp)
{
    const metric_map_t g = raw_map(corner()), l = raw_map({{0, 0, -0.9f}, {0.01f, 0, -0.9f}, {0, 0, 9}});
    const PointToPlane m(0.3);
    MatchState state(g, l);
    Pairings p;
    m.match(g, l, {}, {}, state, p);
    EXPECT_EQ(p.paired_pt2pl.size(), 2u);
    EXPECT_EQ(state.localPairedBitField.point_layers.at("raw"), (std::vector<bool>{true, true, false}));
    const auto& global_paired = state.globalPairedBitField.point_layers.at("raw");
    EXPECT_EQ(std::count(global_paired.begin(), global_paired.end(), true), 0);
    m.match(g, l, {}, {}, state, p);
    EXPECT_EQ(p.paired_pt2pl.size(), 2u);
    EXPECT_EQ(p.potential_pairings, 4u);
    PointToPlane again(0.3);
    again.allowMatchAlreadyMatchedPoints_ = true;
    again.match(g, l, {}, {}, state, p);
    EXPECT_EQ(p.paired_pt2pl.size(), 4u);
}

TEST(Point2Plane, PairingsCarryTheWeightsOfTheirLayers)
{
    const metric_map_t g = map_of({{"a", corner()}, {"b", corner()}});
    const metric_map_t l = map_of({{"p", {{0, 0, -0.9f}, {0.2f, 0, -0.9f}}}, {"q", {{2.9f, 0, 0}}}});
    PointToPlane m(0.3);
    m.weight_pt2pt_layers["a"]["p"] = 0.25;
    m.weight_pt2pt_layers["b"]["q"] = 4;
    const Pairings p = matched(m, g, l);
    EXPECT_EQ(expanded_weights(p.pt2pl_weights, p.paired_pt2pl.size()), (std::vector<double>{0.25, 0.25, 4}));
}

TEST(Point2Plane, ASubsetOfTheLocalPointsIsTheSameThroughoutARun)
{
    const metric_map_t g = raw_map(corner());
    PointToPlane m(0.3);
    m.maxLocalPointsPerLayer_ = 50;
    const Pairings a = matched(m, g, g), b = matched(m, g, g);
    EXPECT_EQ(a.size(), 50u);
    expect_same_pairings(a, b);
}

// ---- The contract of the base -----------------------------------------------------------------------------

TEST(Point2Plane, TheThresholdIsAFormulaAndTheGate)
{
    const PointToPlane m = loaded("distanceThreshold: 2 - ICP_ITERATION");
    EXPECT_EQ(m.gate({1, {{"ICP_ITERATION", 1}}}), 1.0);
    const metric_map_t g = raw_map(corner()), l = raw_map({{0, 0, 0.25f}});
    EXPECT_EQ(matched(m, g, l, {}, {0, {{"ICP_ITERATION", 0}}}).size(), 1u);
    EXPECT_TRUE(matched(m, g, l, {}, {1, {{"ICP_ITERATION", 1}}}).empty());
    MatchState state(g, l);
    Pairings out;
    expect_problem_with<std::runtime_error>({"distanceThreshold", "(0, inf)"},
                                            [&]() {
                                                m.match(g, l, {}, {2, {{"ICP_ITERATION", 2}}}, state, out);
                                            });
}

TEST(Point2Plane, CostsAreTheSquaredDistancesToThePlanesBetweenRoundsOfMatching)
{
    Cloud g = corner();
    g.push_back({20, 0, 0});  // without a plane
    const Cloud l = {{0.0625f, 0, -0.75f}, {0, 0, 9}, {NaN, 0, 0}, {3.5f, 0, 0}, {20.25f, 0, 0}};
    const metric_map_t global = raw_map(g), local = raw_map(l);
    const PointToPlane m(0.3);
    MatchState state(global, local);
    Pairings p;
    m.match(global, local, {}, {}, state, p);
    const auto costs = m.truncated_costs(global, local, {}, {}, state, 1.0);
    ASSERT_EQ(costs.size(), 4u);
    EXPECT_EQ(costs[0], 0.0625);  // its nearest point is farther
    EXPECT_EQ(costs[1], 1.0);
    EXPECT_EQ(costs[2], 0.25);
    EXPECT_TRUE(std::isnan(costs[3])) << "no plane, and not alone: nothing is known";
    Pairings again;
    state.initialize();
    m.match(global, local, {}, {}, state, again);
    expect_same_pairings(p, again);
    EXPECT_EQ(again.size(), 1u);
}

// ---- Little and bad data ----------------------------------------------------------------------------------

TEST(Point2Plane, PointsThatAreNotFiniteAreNeitherPairedNorInTheWay)
{
    const float inf = std::numeric_limits<float>::infinity();
    const Cloud g = cloud_of_shapes(6, 100, 0.01, 5), l = scattered(g, 0.1, 6);
    const Pairings expected = matched(PointToPlane(0.3), raw_map(g), raw_map(l));
    ASSERT_GT(expected.size(), 100u);
    for (const float bad : {NaN, inf, -inf})
    {
        const auto dirty = [bad](const Cloud& cloud)
        {
            Cloud out;
            for (size_t i = 0; i < cloud.size(); i++)
            {
                if (i % 4 == 0) out.push_back({bad, 0, 0}), out.push_back({0, bad, bad});
                out.push_back(cloud[i]);
            }
            return raw_map(out);
        };
        expect_same_pairings(matched(PointToPlane(0.3), dirty(g), dirty(l)), expected);
    }
}

TEST(Point2Plane, EmptyAndTinyLayersAndBadPosesPairNothing)
{
    const metric_map_t good = raw_map(corner()), none = raw_map({}), one = raw_map({{0, 0, -1}}),
                       two = raw_map({{0, 0, -1}, {0, 0.1f, -1}}), bad = raw_map({{NaN, 0, 0}});
    for (const bool must_fit : {false, true})
    {
        PointToPlane m(1);
        m.localPointMustFitPlaneToo = must_fit;
        for (const auto* few : {&none, &one, &two, &bad})
        {
            EXPECT_TRUE(matched(m, *few, good).empty());
            const bool empty = few == &none || few == &bad;
            EXPECT_EQ(matched(m, *few, good).potential_pairings == corner().size(), empty)
                << "of a point or two, nothing is known";
            EXPECT_EQ(matched(m, good, *few).size(), must_fit || few == &bad ? 0u : few->size());
        }
        EXPECT_EQ(matched(m, good, good).size(), corner().size());
        EXPECT_TRUE(matched(m, good, good, CPose3D(double(NaN), 0, 0, 0, 0, 0)).empty());
    }
}

// ---- Threads ----------------------------------------------------------------------------------------------

TEST(Point2Plane, HasTheSameBitsOnAnyNumberOfThreads)
{
    const Cloud g = cloud_of_shapes(30, 300, 0.01, 7);
    const Cloud l = scattered(g, 0.02, 8);
    PointToPlane m(0.3);
    m.localPointMustFitPlaneToo = true;
    Pairings one;
    with_threads(1, [&]() { one = matched(m, raw_map(g), raw_map(l)); });
    ASSERT_GT(one.size(), 1000u);
    for (const int threads : {2, 8})
        with_threads(threads, [&]() { expect_same_pairings(matched(m, raw_map(g), raw_map(l)), one); });
}

TEST(Point2Plane, OneMatcherAndOneMapServeSeveralThreads)
{
    const PointToPlane m(0.5);
    for (uint64_t round = 0; round < 10; round++)
    {
        const metric_map_t g = raw_map(cloud_of_shapes(6, 200, 0.01, 20 + round)),
                           l = raw_map(cloud_of_shapes(6, 200, 0.01, 20 + round));
        std::vector<Pairings> found(4);
        std::vector<std::thread> threads;
        for (auto& f : found) threads.emplace_back([&]() { f = matched(m, g, l); });
        for (auto& t : threads) t.join();
        ASSERT_GT(found[0].size(), 100u);
        for (const auto& f : found) expect_same_pairings(f, found[0]);
    }
}

TEST(Point2Plane, PlanesAreMadeOncePerRun)
{
    const metric_map_t g = raw_map(corner()), l = raw_map({{0, 0, -0.9f}});
    const PointToPlane m(0.3);
    MatchState state(g, l);
    Pairings p;
    m.match(g, l, {}, {}, state, p);
    const auto surfaces = g.local_surfaces("raw", {m.knn, m.searchRadius});
    EXPECT_EQ(surfaces.use_count(), 3) << "kept by the map, by the run and here: it was not made again";
}

// ---- YAML -------------------------------------------------------------------------------------------------

TEST(Point2Plane, LoadsTheKeysOf022)
{
    const PointToPlane m = loaded(
        "distanceThreshold: 0.25\nsearchRadius: 0.75\nknn: 8\nminimumPlanePoints: 6\nplaneEigenThreshold: "
        "0.02\nlocalPointMustFitPlaneToo: true\nlocalToGlobalPlaneMinAbsCosine: 0.9\nrunFromIteration: 1\n");
    EXPECT_EQ(m.distanceThreshold.value(), 0.25);
    EXPECT_EQ(m.searchRadius, 0.75);
    EXPECT_EQ(m.knn, 8u);
    EXPECT_EQ(m.minimumPlanePoints, 6u);
    EXPECT_EQ(m.planeEigenThreshold, 0.02);
    EXPECT_TRUE(m.localPointMustFitPlaneToo);
    EXPECT_EQ(m.localToGlobalPlaneMinAbsCosine, 0.9);
    EXPECT_EQ(m.runFromIteration, 1u);
}

TEST(Point2Plane, MistakesInItsParametersAreNamed)
{
    const auto refused = [](const std::string& text, const std::vector<std::string>& parts)
    { expect_problem_with<ConfigError>(parts, [&]() { loaded(text); }); };
    refused("knn: 5", {"'distanceThreshold'", "missing"});
    refused("distanceThreshold: 0", {"params.distanceThreshold", "(0, inf)"});
    refused("distanceThreshold: 1\nsearchRadius: 0", {"params.searchRadius"});
    refused("distanceThreshold: 1\nknn: 2", {"params.knn"});
    refused("distanceThreshold: 1\nminimumPlanePoints: 2", {"params.minimumPlanePoints"});
    refused("distanceThreshold: 1\nminimumPlanePoints: 6\nknn: 5", {"'minimumPlanePoints'", "'knn'"});
    refused("distanceThreshold: 1\nplaneEigenThreshold: 1.5", {"params.planeEigenThreshold"});
    refused("distanceThreshold: 1\nthreshold: 1", {"f.yaml:2", "threshold"});
}

TEST(Point2Plane, WhatIsSavedLoadsAgain)
{
    const PointToPlane m = loaded(
        "distanceThreshold: 0.1 + 1/(1+ICP_ITERATION)\nknn: 7\nnearestPointsTried: 3\nsensorAtOrigin: true\n"
        "planeWidthThreshold: 0.3\n");
    PointToPlane back;
    back.initialize(m.save_parameters());
    EXPECT_EQ(back.distanceThreshold.text(), m.distanceThreshold.text());
    EXPECT_EQ(back.knn, 7u);
    EXPECT_EQ(back.nearestPointsTried, 3u);
    EXPECT_TRUE(back.sensorAtOrigin);
    EXPECT_EQ(back.planeWidthThreshold, 0.3);
}

// ---- In ICP -----------------------------------------------------------------------------------------------

namespace
{
/// Gauss-Newton on the pairings of one matcher.
Results aligned_by(const Matcher::Ptr& matcher, const metric_map_t& local, const metric_map_t& global,
                   double smallest_step)
{
    ICP icp;
    icp.matchers().push_back(matcher);
    icp.solvers().push_back(std::make_shared<Solver_GaussNewton>());
    Parameters parameters;
    parameters.maxIterations = 200;
    parameters.minAbsStep_trans = smallest_step, parameters.minAbsStep_rot = smallest_step;
    Results result;
    icp.align(local, global, CPose3D().asTPose(), parameters, result);
    return result;
}

Matcher::Ptr points_within(const Formula& threshold)
{
    const auto m = std::make_shared<Matcher_Points_DistanceThreshold>();
    m->threshold = threshold, m->allowMatchAlreadyMatchedGlobalPoints_ = true;
    return m;
}
}  // namespace

TEST(Point2Plane, IcpFindsTheExactPoseInARoomAndInFewerStepsThanWithPoints)
{
    const auto room = synthetic::room_with_boxes(8, 6, 2.5, 4, 4);
    for (uint64_t seed = 1; seed <= 3; seed++)
    {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        SeededRandom random(seed);
        const CPose3D truth = synthetic::random_pose({0.2, 0.2, 0.1, 0.05, 0.03, 0.03}, random);
        ASSERT_GT(translation_of(truth).norm(), 0.03) << "the identity must not pass";
        // No two points of the maps are the same.
        const metric_map_t global = map_of(synthetic::sample_by_area(room, 8000, seed)),
                           local =
                               map_of(seen_from(truth, *synthetic::sample_by_area(room, 4000, seed + 50)));
        const Formula threshold("max(0.2, 0.5*0.8^ICP_ITERATION)");
        const auto planes = std::make_shared<PointToPlane>();
        planes->distanceThreshold = threshold;
        // Neighbourhoods that reach around an edge are no planes, and no point goes to the wall next to its
        // own.
        planes->planeEigenThreshold = 1e-6, planes->localPointMustFitPlaneToo = true;
        const Results by_planes = aligned_by(planes, local, global, 1e-6),
                      by_points = aligned_by(points_within(threshold), local, global, 1e-6);
        EXPECT_EQ(by_planes.verdict, Verdict::aligned) << by_planes.verdict_reason;
        EXPECT_EQ(by_points.verdict, Verdict::aligned) << by_points.verdict_reason;
        // Some 2500 pairs on coordinates rounded by 1e-7 m: a few nanometres are expected.
        EXPECT_LT(translation_error(by_planes.optimal_tf.mean, truth), 5e-8);
        EXPECT_LT(rotation_error(by_planes.optimal_tf.mean, truth), 1e-8);
        EXPECT_LT(by_planes.residual_rms, 2e-7);
        EXPECT_GT(by_planes.finalPairings.paired_pt2pl.size(), 2000u);
        EXPECT_LT(2 * by_planes.nIterations, by_points.nIterations);
        EXPECT_GT(translation_error(by_points.optimal_tf.mean, truth), 1e-4) << "points are not exact here";
    }
}

TEST(Point2Plane, IcpAlignsALidarPair)
{
    const auto source = shared_data("lidar_pair/source.ply"), target = shared_data("lidar_pair/target.ply"),
               truth_file = shared_data("lidar_pair/T_target_source.txt");
    MP2P_ICP_SKIP_WITHOUT(truth_file);
    Eigen::Matrix4d T;
    std::ifstream text(truth_file);
    for (int i = 0; i < 16; i++) text >> T(i / 4, i % 4);
    const CPose3D truth = make_pose(T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>());
    const auto decimated = [](const std::string& path)
    {
        metric_map_t map = *load_map(path).map, out;
        mp2p_icp_filters::FilterDecimateVoxels filter;
        filter.initialize(
            yaml_from_text("input_pointcloud_layer: raw\noutput_pointcloud_layer: small\n"
                           "voxel_filter_resolution: 0.25\ndecimate_method: VoxelAverage\n"));
        filter.filter(map);
        out.layers["raw"] = map.layers.at("small");
        return out;
    };
    const metric_map_t local = decimated(source), global = decimated(target);
    const Formula threshold("max(0.4, 0.8^ICP_ITERATION)");
    const auto planes = std::make_shared<PointToPlane>();
    planes->distanceThreshold = threshold;
    planes->searchRadius = 0.75, planes->localPointMustFitPlaneToo = true;
    const Results by_planes = aligned_by(planes, local, global, 1e-4),
                  by_points = aligned_by(points_within(threshold), local, global, 1e-4);
    ASSERT_EQ(by_planes.verdict, Verdict::aligned) << by_planes.verdict_reason;
    const double metres = translation_error(by_planes.optimal_tf.mean, truth),
                 degrees = mrpt::RAD2DEG(rotation_error(by_planes.optimal_tf.mean, truth));
    std::cout << "planes: " << metres << " m, " << degrees << " deg after " << by_planes.nIterations
              << " iterations; points: " << translation_error(by_points.optimal_tf.mean, truth) << " m, "
              << mrpt::RAD2DEG(rotation_error(by_points.optimal_tf.mean, truth)) << " deg after "
              << by_points.nIterations << " (truth is good to 0.02 m, 0.23 deg)\n";
    EXPECT_LT(metres, 0.03);
    EXPECT_LT(degrees, 0.35);
    EXPECT_LT(by_planes.nIterations, by_points.nIterations);
    EXPECT_GT(translation_error(CPose3D(), truth), 0.4) << "the identity must not pass";
}
