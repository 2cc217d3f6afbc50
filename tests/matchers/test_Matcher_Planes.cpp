#include <mp2p_icp/Matcher_Planes.h>
#include <mp2p_icp/errors.h>

#include <limits>

#include "expect_problem.h"
#include "matcher_test_tools.h"
#include "primitives_of_truth.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Eigen::Vector3d;

namespace
{
metric_map_t map_of_planes(const std::vector<fitted_plane_t>& planes)
{
    metric_map_t m;
    m.planes = planes;
    return m;
}

/// (global, local) by their centroids, in the order of the list.
IndexPairs plane_pairs(const Pairings& p, const metric_map_t& global, const metric_map_t& local)
{
    const auto index_in = [](const metric_map_t& map, const plane_patch_t& patch)
    {
        uint32_t i = 0;
        while (map.planes[i].centroid != patch.centroid) i++;
        return i;
    };
    IndexPairs out;
    for (const auto& pair : p.paired_pl2pl)
        out.emplace_back(index_in(global, pair.p_global), index_in(local, pair.p_local));
    return out;
}

std::vector<fitted_plane_t> random_planes(size_t count, SeededRandom& random)
{
    std::vector<fitted_plane_t> out;
    for (size_t i = 0; i < count; i++)
    {
        const Vector3d c(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
        const Vector3d n = random.index(2) ? Vector3d::UnitZ() : Vector3d::UnitX();
        out.push_back(plane_at(c, (n + 0.1 * any_direction(random)).normalized()));
    }
    return out;
}

/// The rules of the class comment for planes without fits, one pair at a time.
IndexPairs brute_force(const Matcher_Planes& m, const metric_map_t& global, const metric_map_t& local,
                       const CPose3D& pose)
{
    struct Best
    {
        uint32_t global, local;
        double sq;
    };
    std::vector<Best> nearest;
    for (uint32_t l = 0; l < local.planes.size(); l++)
    {
        const auto moved_plane = compose(pose, local.planes[l]);
        std::vector<std::pair<double, uint32_t>> all;
        for (uint32_t g = 0; g < global.planes.size(); g++)
        {
            const Vector3d n_g = global.planes[g].normal(), n_l = moved_plane.normal();
            const Vector3d d = to_eigen(moved_plane.centroid) - to_eigen(global.planes[g].centroid);
            const double angle = std::acos(n_g.dot(n_l)) * 180 / M_PI;
            if (angle > m.angleThresholdDeg.value() ||
                std::abs((n_g + n_l).normalized().dot(d)) >= m.distanceThreshold.value())
                continue;
            if (m.maxCentroidDistance.value() > 0 && d.norm() > m.maxCentroidDistance.value()) continue;
            all.emplace_back(d.squaredNorm(), g);
        }
        if (!all.empty())
            nearest.push_back({std::min_element(all.begin(), all.end())->second, l,
                               std::min_element(all.begin(), all.end())->first});
    }
    IndexPairs out;
    for (const auto& a : nearest)
        if (std::none_of(nearest.begin(), nearest.end(),
                         [&a](const Best& b) {
                             return b.global == a.global &&
                                    (b.sq < a.sq || (b.sq == a.sq && b.local < a.local));
                         }))
            out.emplace_back(a.global, a.local);
    return out;
}

const Vector3d Z = Vector3d::UnitZ(), X = Vector3d::UnitX();
}  // namespace

TEST(MatcherPlanes, PairsAsBruteForceDoes)
{
    SeededRandom random(1);
    size_t pairs = 0;
    for (int i = 0; i < 30; i++)
    {
        const auto global = map_of_planes(random_planes(40, random)),
                   local = map_of_planes(random_planes(30, random));
        const CPose3D pose = small_pose(random);
        Matcher_Planes m;
        m.maxCentroidDistance = i % 2 ? 1.5 : 0.0;
        const Pairings p = matched(m, global, local, pose);
        EXPECT_EQ(plane_pairs(p, global, local), brute_force(m, global, local, pose));
        EXPECT_EQ(p.potential_pairings, 30u);
        EXPECT_EQ(expanded_weights(p.pl2pl_weights, p.paired_pl2pl.size()),
                  std::vector<double>(p.paired_pl2pl.size(), 1.0));
        pairs += p.size();
    }
    EXPECT_GT(pairs, 100u);
}

TEST(MatcherPlanes, TheTwoSidesOfAWallNeverMatch)
{
    const auto front = map_of_planes({plane_with_fit({5, 0, 0}, -X)}),
               back = map_of_planes({plane_with_fit({5, 0, 0}, X)});
    EXPECT_EQ(matched(Matcher_Planes(), front, front).size(), 1u);
    EXPECT_EQ(matched(Matcher_Planes(), front, back).size(), 0u);
    EXPECT_EQ(matched(Matcher_Planes(), front, back, CPose3D(10, 0, 0, M_PI, 0, 0)).size(), 1u);
}

TEST(MatcherPlanes, LimitsAreKept)
{
    const auto global = map_of_planes({plane_at({0, 0, 0}, Z)});
    const auto count = [&](const Matcher_Planes& m, const CPose3D& pose)
    { return matched(m, global, global, pose).size(); };
    Matcher_Planes m;
    m.distanceThreshold = 0.3;
    m.angleThresholdDeg = 5.0;
    EXPECT_EQ(count(m, {0, 0, 0.29, 0, 0, 0}), 1u);
    EXPECT_EQ(count(m, {0, 0, 0.31, 0, 0, 0}), 0u);
    EXPECT_EQ(count(m, {0, 0, -0.31, 0, 0, 0}), 0u);
    EXPECT_EQ(count(m, {50, 0, 0, 1, 0, 0}), 1u);
    EXPECT_EQ(count(m, {0, 0, 0, 0, 0.085, 0}), 1u);  // 4.9 degrees
    EXPECT_EQ(count(m, {0, 0, 0, 0, 0.09, 0}), 0u);
    m.maxCentroidDistance = 40;
    EXPECT_EQ(count(m, {50, 0, 0, 0, 0, 0}), 0u);
    EXPECT_EQ(m.gate({}), 0.3);
}

TEST(MatcherPlanes, KnownExtentsMustOverlap)
{
    const auto global = map_of_planes({plane_with_fit({0, 0, 0}, Z)});  // 2 x 2 m
    Matcher_Planes m;
    m.minimumOverlap = 0.25;
    const auto count = [&](double x, double y, double yaw)
    { return matched(m, global, global, CPose3D(x, y, 0, yaw, 0, 0)).size(); };
    EXPECT_EQ(count(1.45, 0, 0), 1u);   // 27 %
    EXPECT_EQ(count(1.55, 0, 0), 0u);   // 22 %
    EXPECT_EQ(count(0.9, 0.9, 0), 1u);  // 30 %
    EXPECT_EQ(count(1.1, 1.1, 0), 0u);  // 20 %
    EXPECT_EQ(count(1.1, 1.1, M_PI / 4), 0u);
    EXPECT_EQ(count(0, 0, M_PI / 4), 1u);
    m.minimumOverlap = 0;
    EXPECT_EQ(count(100, 0, 0), 1u);
    m.maxCentroidDistance = 1;  // only where an extent is unknown
    EXPECT_EQ(count(100, 0, 0), 1u);
    auto small = global;  // of the smaller one, all is shared
    small.planes[0].fit->u_max = small.planes[0].fit->v_max = -0.8;
    m.minimumOverlap = 1 - 1e-9;
    EXPECT_EQ(matched(m, global, small).size(), 1u);
    EXPECT_EQ(matched(m, small, global).size(), 1u);
}

TEST(MatcherPlanes, OneToOneAndTiesGoToTheLowerIndex)
{
    const auto two = map_of_planes({plane_at({1, 0, 0}, Z), plane_at({-1, 0, 0}, Z)});
    const auto one = map_of_planes({plane_at({0, 0, 0}, Z)});
    EXPECT_EQ(plane_pairs(matched(Matcher_Planes(), two, one), two, one), (IndexPairs{{0, 0}}));
    EXPECT_EQ(plane_pairs(matched(Matcher_Planes(), one, two), one, two), (IndexPairs{{0, 0}}));
    EXPECT_EQ(plane_pairs(matched(Matcher_Planes(), one, two, CPose3D(0.1, 0, 0, 0, 0, 0)), one, two),
              (IndexPairs{{0, 1}}));
}

TEST(MatcherPlanes, WhatIsNotFinitePairsWithNothing)
{
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    auto global = map_of_planes({plane_at({nan, 0, 0}, Z), plane_at({0, 0, 0}, {0, 0, inf}),
                                 plane_at({0, 0, 0}, {0, 0, 0}), plane_at({0, nan, inf}, {nan, 0, 1}),
                                 plane_with_fit({0, 0, 0.1}, Z)});
    global.planes[4].fit->covariance(0, 1) = nan;
    global.planes[4].fit->u_max = nan;
    const Pairings p = matched(Matcher_Planes(), global, global);
    ASSERT_EQ(p.size(), 1u);
    EXPECT_EQ(p.paired_pl2pl[0].p_global.centroid, global.planes[4].centroid);
    EXPECT_EQ(p.potential_pairings, 1u);
    EXPECT_EQ(p.pl2pl_weights, (WeightRuns{{1, 1.0}}));  // as if there were no fit
    EXPECT_EQ(matched(Matcher_Planes(), global, global, CPose3D(nan, 0, 0, 0, 0, 0)).size(), 0u);
    EXPECT_EQ(matched(Matcher_Planes(), {}, global).size(), 0u);
    EXPECT_EQ(matched(Matcher_Planes(), global, {}).size(), 0u);
    MatchState state(global, global);
    EXPECT_EQ(Matcher_Planes().truncated_costs(global, global, {}, {}, state, 0.5), std::vector<double>{0.0});
}

TEST(MatcherPlanes, NormalsNeedNotBeUnit)
{
    auto global = map_of_planes({plane_with_fit({0, 0, 2}, Z)}), local = global;
    for (double& c : local.planes[0].plane.coefs) c *= 3;
    for (const bool as_points : {false, true})
    {
        Matcher_Planes m;
        m.pairAsPoints = as_points;
        EXPECT_EQ(matched(m, global, local).size(), as_points ? 4u : 1u);
        EXPECT_EQ(matched(m, local, global).size(), as_points ? 4u : 1u);
    }
}

TEST(MatcherPlanes, WeightsTellHowWellTheDistanceIsKnown)
{
    auto global = map_of_planes({plane_with_fit({0, 0, 0}, Z)}), local = global;
    global.planes[0].fit->covariance = Vector3d(9e-4, 1e-8, 3e-4).asDiagonal();
    local.planes[0].fit->covariance = Vector3d(1, 1, 1e-4).asDiagonal();
    Matcher_Planes m;
    m.unitWeightSigma = 0.02;
    EXPECT_NEAR(matched(m, global, local).pl2pl_weights.at(0).second, 4e-4 / 4e-4, 1e-9);
    // u of the global plane is its axis: 0.5 m away along it, its turn matters
    const Vector3d along = 0.5 * global.planes[0].fit->axis_u;
    const CPose3D pose(along.x(), along.y(), along.z(), 0, 0, 0);
    EXPECT_NEAR(matched(m, global, local, pose).pl2pl_weights.at(0).second, 4e-4 / (4e-4 + 0.25 * 9e-4),
                1e-9);
    m.weightByFit = false;
    EXPECT_EQ(matched(m, global, local).pl2pl_weights.at(0).second, 1);
}

TEST(MatcherPlanes, PointsInPlaceOfAPairCostWhatTheCovariancesSay)
{
    SeededRandom random(3);
    Matcher_Planes m;
    m.pairAsPoints = true;
    m.minimumOverlap = 0;
    m.unitWeightSigma = 0.1;
    for (int i = 0; i < 50; i++)
    {
        const CPose3D pose = small_pose(random);
        auto g = plane_with_fit(3 * any_direction(random), any_direction(random));
        g.fit->covariance = any_covariance<3>({0.01, 0.003, 0.002}, random);
        auto l = compose(-pose, plane_with_fit(to_eigen(g.centroid) + 0.5 * g.fit->axis_u, g.normal()));
        l.fit->axis_u = Eigen::AngleAxisd(random.uniform(-3, 3), l.normal()) * l.fit->axis_u;
        l.fit->covariance = any_covariance<3>({0.002, 0.005, 0.003}, random);
        l = displaced(l, Vector3d(1e-4, -2e-4, 1e-4));
        const Pairings p = matched(m, map_of_planes({g}), map_of_planes({l}), pose);
        ASSERT_EQ(p.paired_pt2pl.size(), 4u);
        EXPECT_EQ(p.size(), 4u);
        EXPECT_EQ(p.potential_pairings, 4u);
        const auto weights = expanded_weights(p.pt2pl_weights, 4);
        Matrix6d of_points = Matrix6d::Zero();
        for (size_t k = 0; k < 4; k++)
        {
            const Vector3d x = to_eigen(pose.composePoint(p.paired_pt2pl[k].pt_local)), n = g.normal();
            EXPECT_NEAR(to_eigen(p.paired_pt2pl[k].pt_local).dot(l.normal()), -l.plane.coefs[3], 1e-9);
            Vector6d row;
            row << n, (x - translation_of(pose)).cross(n);
            of_points += weights[k] * row * row.transpose() / 0.01;
        }
        const Matrix6d expected = information_of(g, l, pose);
        EXPECT_LT((of_points - expected).norm(), 2e-3 * expected.norm());
    }
}

TEST(MatcherPlanes, CostsAreThoseOfTheNearestThatMayBePaired)
{
    const auto global =
        map_of_planes({plane_at({0, 0, 0}, Z), plane_at({0, 0, 0.3}, Z), plane_at({0, 0, 0}, X)});
    const auto local = map_of_planes({plane_at({0, 0, 0.1}, Z), plane_at({5, 0, 0.29}, Z),
                                      plane_at({0.7, 0, 0}, X), plane_at({0, 0, 0}, Vector3d::UnitY())});
    MatchState state(global, local);
    const auto costs = Matcher_Planes().truncated_costs(global, local, {}, {}, state, 0.5);
    ASSERT_EQ(costs.size(), 4u);
    EXPECT_NEAR(costs[0], 0.01, 1e-12);
    EXPECT_NEAR(costs[1], 1e-4, 1e-12);
    EXPECT_EQ(costs[2], 0.25);
    EXPECT_EQ(costs[3], 0.25);
}

TEST(MatcherPlanes, TheSameBitsOnAnyNumberOfThreads)
{
    SeededRandom random(5);
    const auto global = map_of_planes(random_planes(60, random)),
               local = map_of_planes(random_planes(60, random));
    const auto once = plane_pairs(matched(Matcher_Planes(), global, local), global, local);
    EXPECT_GT(once.size(), 5u);
    for (const int threads : {1, 2, 8})
        with_threads(
            threads,
            [&]() { EXPECT_EQ(plane_pairs(matched(Matcher_Planes(), global, local), global, local), once); });
}

TEST(MatcherPlanes, ParametersFromYaml)
{
    const auto made = [](const std::string& text)
    {
        Matcher_Planes m;
        m.initialize(yaml_from_text(text));
        return m;
    };
    const auto m =
        made("distanceThreshold: '0.1 * x'\nangleThresholdDeg: 3\nminimumOverlap: 0.5\npairAsPoints: true");
    EXPECT_EQ(m.minimumOverlap, 0.5);
    EXPECT_TRUE(m.pairAsPoints);
    MatchContext context;
    context.variables["x"] = 3;
    EXPECT_NEAR(*m.gate(context), 0.3, 1e-15);
    context.variables["x"] = -3;
    EXPECT_THROW(m.gate(context), std::runtime_error);
    expect_problem_with<ConfigError>({"distanceThreshold"}, [&]() { made("angleThresholdDeg: 3"); });
    for (const char* bad :
         {"distanceThreshold: 0", "distanceThreshold: 1\nangleThresholdDeg: 90",
          "distanceThreshold: 1\nminimumOverlap: 2", "distanceThreshold: 1\nunitWeightSigma: 0",
          "distanceThreshold: 1\nmaxCentroidDistance: -1", "distanceThreshold: 1\nangle: 2"})
        EXPECT_THROW(made(bad), ConfigError) << bad;
}
