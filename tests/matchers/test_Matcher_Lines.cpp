#include <mp2p_icp/Matcher_Lines.h>
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
metric_map_t map_of_lines(const std::vector<fitted_line_t>& lines)
{
    metric_map_t m;
    m.lines = lines;
    return m;
}

/// (global, local) by their base points, in the order of the list.
IndexPairs line_pairs(const Pairings& p, const metric_map_t& global, const metric_map_t& local)
{
    const auto index_in = [](const metric_map_t& map, const mrpt::math::TLine3D& line)
    {
        uint32_t i = 0;
        while (map.lines[i].pBase != line.pBase) i++;
        return i;
    };
    IndexPairs out;
    for (const auto& pair : p.paired_ln2ln)
        out.emplace_back(index_in(global, pair.ln_global), index_in(local, pair.ln_local));
    return out;
}

std::vector<fitted_line_t> random_lines(size_t count, SeededRandom& random)
{
    std::vector<fitted_line_t> out;
    for (size_t i = 0; i < count; i++)
    {
        const Vector3d base(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
        const Vector3d d =
            (random.index(2) ? Vector3d::UnitZ() : Vector3d::UnitX()) + 0.1 * any_direction(random);
        out.push_back(line_at(base, random.index(2) ? d.normalized() : Vector3d(-d.normalized())));
    }
    return out;
}

/// The rules of the class comment for lines without fits, one pair at a time.
IndexPairs brute_force(const Matcher_Lines& m, const metric_map_t& global, const metric_map_t& local,
                       const CPose3D& pose)
{
    struct Pair
    {
        uint32_t global, local;
        double sq;
    };
    std::vector<Pair> nearest;
    for (uint32_t l = 0; l < local.lines.size(); l++)
    {
        Pair best{0, l, std::pow(m.distanceThreshold.value(), 2)};
        bool any = false;
        for (uint32_t g = 0; g < global.lines.size(); g++)
        {
            const auto line = compose(pose, local.lines[l]);
            Vector3d d_l = to_eigen(line.director);
            const Vector3d d_g = to_eigen(global.lines[g].director);
            if (d_l.dot(d_g) < 0) d_l = -d_l;
            if (std::acos(d_l.dot(d_g)) * 180 / M_PI > m.angleThresholdDeg.value()) continue;
            const Vector3d between = to_eigen(line.pBase) - to_eigen(global.lines[g].pBase);
            const double along = (d_l + d_g).normalized().dot(between),
                         sq = between.squaredNorm() - along * along;
            if (m.maxAlongDistance.value() > 0 && std::abs(along) > m.maxAlongDistance.value()) continue;
            if (sq < best.sq) best = {g, l, sq}, any = true;
        }
        if (any) nearest.push_back(best);
    }
    IndexPairs out;
    for (const auto& a : nearest)
        if (std::none_of(nearest.begin(), nearest.end(),
                         [&a](const Pair& b)
                         { return b.global == a.global && b.local != a.local && b.sq < a.sq; }))
            out.emplace_back(a.global, a.local);
    return out;
}

const Vector3d Z = Vector3d::UnitZ(), X = Vector3d::UnitX();
}  // namespace

TEST(MatcherLines, PairsAsBruteForceDoes)
{
    SeededRandom random(1);
    size_t pairs = 0;
    for (int i = 0; i < 30; i++)
    {
        const auto global = map_of_lines(random_lines(40, random)),
                   local = map_of_lines(random_lines(30, random));
        const CPose3D pose = small_pose(random);
        Matcher_Lines m;
        m.distanceThreshold = 1.0;
        m.maxAlongDistance = i % 2 ? 1.5 : 0.0;
        const Pairings p = matched(m, global, local, pose);
        EXPECT_EQ(line_pairs(p, global, local), brute_force(m, global, local, pose));
        EXPECT_EQ(p.potential_pairings, 30u);
        pairs += p.size();
    }
    EXPECT_GT(pairs, 100u);
}

TEST(MatcherLines, DirectionsHaveNoSignAndLimitsAreKept)
{
    const auto global = map_of_lines({line_at({0, 0, 0}, Z)}),
               other_way = map_of_lines({line_at({0, 0, 0}, -Z)});
    const auto count = [&](const Matcher_Lines& m, const CPose3D& pose)
    {
        const size_t n = matched(m, global, global, pose).size();
        EXPECT_EQ(matched(m, global, other_way, pose).size(), n);
        return n;
    };
    Matcher_Lines m;
    m.distanceThreshold = 0.3;
    m.angleThresholdDeg = 5.0;
    EXPECT_EQ(count(m, {0.29, 0, 0, 0, 0, 0}), 1u);
    EXPECT_EQ(count(m, {0.2, 0.23, 0, 0, 0, 0}), 0u);
    EXPECT_EQ(count(m, {0, 0, 50, 0, 0, 0}), 1u);
    EXPECT_EQ(count(m, {0, 0, 0, 0, 0.085, 0}), 1u);
    EXPECT_EQ(count(m, {0, 0, 0, 0, 0.09, 0}), 0u);
    m.maxAlongDistance = 40;
    EXPECT_EQ(count(m, {0, 0, 50, 0, 0, 0}), 0u);
    EXPECT_EQ(m.gate({}), 0.3);
}

TEST(MatcherLines, KnownExtentsMustOverlap)
{
    const auto global = map_of_lines({line_with_fit({0, 0, 0}, Z)});  // 2 m
    Matcher_Lines m;
    m.minimumOverlap = 0.25;
    const auto count = [&](double z) { return matched(m, global, global, CPose3D(0, 0, z, 0, 0, 0)).size(); };
    EXPECT_EQ(count(1.45), 1u);
    EXPECT_EQ(count(1.55), 0u);
    EXPECT_EQ(count(-1.45), 1u);
    EXPECT_EQ(count(-1.55), 0u);
    EXPECT_EQ(matched(m, global, global, CPose3D(0, 0, 1.55, 0, 0, M_PI)).size(), 0u);  // upside down
    EXPECT_EQ(matched(m, global, global, CPose3D(0, 0, 1.45, 0, 0, M_PI)).size(), 1u);
    m.minimumOverlap = 0;
    EXPECT_EQ(count(100), 1u);
}

TEST(MatcherLines, DistanceIsMeasuredWhereBothWereSeen)
{
    auto far_based = line_with_fit({0, 0.1, 0}, Z);  // the same piece, told from a base point far along
    far_based.pBase.z = -100;
    far_based.fit->begin = 99, far_based.fit->end = 101;
    auto turned = line_with_fit({0, 0, 0}, Vector3d(0, 0.02, 1).normalized());
    Matcher_Lines m;
    const auto global = map_of_lines({far_based}), local = map_of_lines({turned});
    MatchState state(global, local);
    const auto cost = m.truncated_costs(global, local, {}, {}, state, 5);
    ASSERT_EQ(cost.size(), 1u);
    EXPECT_NEAR(std::sqrt(cost[0]), 0.1, 0.001);
}

TEST(MatcherLines, OneToOneAndTiesGoToTheLowerIndex)
{
    const auto two = map_of_lines({line_at({0.1, 0, 0}, Z), line_at({-0.1, 0, 0}, Z)});
    const auto one = map_of_lines({line_at({0, 0, 0}, Z)});
    EXPECT_EQ(line_pairs(matched(Matcher_Lines(), two, one), two, one), (IndexPairs{{0, 0}}));
    EXPECT_EQ(line_pairs(matched(Matcher_Lines(), one, two), one, two), (IndexPairs{{0, 0}}));
    EXPECT_EQ(line_pairs(matched(Matcher_Lines(), one, two, CPose3D(0.01, 0, 0, 0, 0, 0)), one, two),
              (IndexPairs{{0, 1}}));
}

TEST(MatcherLines, WhatIsNotFinitePairsWithNothing)
{
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    auto global =
        map_of_lines({line_at({nan, 0, 0}, Z), line_at({0, 0, 0}, {0, 0, inf}), line_at({0, 0, 0}, {0, 0, 0}),
                      line_at({0, inf, 0}, Z), line_with_fit({0, 0, 0.1}, Z)});
    global.lines[4].fit->end = nan;
    const Pairings p = matched(Matcher_Lines(), global, global);
    ASSERT_EQ(p.size(), 1u);
    EXPECT_EQ(p.paired_ln2ln[0].ln_global.pBase, global.lines[4].pBase);
    EXPECT_EQ(p.ln2ln_weights, (WeightRuns{{1, 1.0}}));
    EXPECT_EQ(matched(Matcher_Lines(), global, global, CPose3D(nan, 0, 0, 0, 0, 0)).size(), 0u);
    EXPECT_EQ(matched(Matcher_Lines(), {}, global).size(), 0u);
    EXPECT_EQ(matched(Matcher_Lines(), global, {}).size(), 0u);
}

TEST(MatcherLines, WeightsTellHowWellTheDistanceIsKnown)
{
    auto global = map_of_lines({line_with_fit({0, 0, 0}, Z)}), local = global;
    global.lines[0].fit->covariance = Eigen::Vector4d(1e-4, 3e-4, 4e-4, 0).asDiagonal();
    local.lines[0].fit->covariance = Eigen::Vector4d(2e-4, 2e-4, 1, 1).asDiagonal();
    Matcher_Lines m;
    m.unitWeightSigma = 0.02;
    EXPECT_NEAR(matched(m, global, local).ln2ln_weights.at(0).second, 1, 1e-9);
    const CPose3D along(0, 0, 0.5, 0, 0, 0);
    EXPECT_NEAR(matched(m, global, local, along).ln2ln_weights.at(0).second,
                4e-4 / (4e-4 + 0.5 * 0.25 * 4e-4), 1e-9);
    m.weightByFit = false;
    EXPECT_EQ(matched(m, global, local).ln2ln_weights.at(0).second, 1);
}

TEST(MatcherLines, PointsInPlaceOfAPairCostWhatTheCovariancesSay)
{
    SeededRandom random(3);
    Matcher_Lines m;
    m.pairAsPoints = true;
    m.minimumOverlap = 0;
    for (int i = 0; i < 50; i++)
    {
        const CPose3D pose = small_pose(random);
        auto g = line_with_fit(3 * any_direction(random), any_direction(random));
        const Vector3d d = to_eigen(g.director), a = g.fit->axis_a, b = d.cross(a);
        // errors along two directions across, at any angle, independent of each other: as of two planes
        const double angle = random.uniform(0.5, 2.5);
        Eigen::Matrix2d directions;
        directions << 1, std::cos(angle), 0, std::sin(angle);
        Eigen::Matrix4d mixed = Eigen::Matrix4d::Zero();
        for (int k = 0; k < 2; k++)
        {
            const Eigen::Matrix2d of_k = any_covariance<2>({0.002 * (k + 1), 0.004 / (k + 1)}, random),
                                  across = directions.col(k) * directions.col(k).transpose();
            for (int row = 0; row < 2; row++)
                for (int column = 0; column < 2; column++)
                    mixed.block<2, 2>(2 * row, 2 * column) += of_k(row, column) * across;
        }
        g.fit->covariance = mixed;
        auto l = g;  // the same place told from another base point, another axis, the other direction
        l.pBase = to_mrpt(Vector3d(to_eigen(g.pBase) + 0.3 * d));
        l.director = to_mrpt(Vector3d(-d));
        l.fit->axis_a = (0.6 * a + 0.8 * b).normalized();
        l.fit->covariance = Eigen::Vector4d(1e-10, 1e-10, 1e-10, 1e-10).asDiagonal();
        l = compose(-pose, l);
        const Pairings p = matched(m, map_of_lines({g}), map_of_lines({l}), pose);
        ASSERT_EQ(p.paired_pt2pl.size(), 4u);
        EXPECT_EQ(p.size(), 4u);
        EXPECT_EQ(p.potential_pairings, 4u);
        const auto weights = expanded_weights(p.pt2pl_weights, 4);
        Matrix6d of_points = Matrix6d::Zero();
        for (size_t k = 0; k < 4; k++)
        {
            const Vector3d x = to_eigen(pose.composePoint(p.paired_pt2pl[k].pt_local));
            const auto& c = p.paired_pt2pl[k].pl_global.plane.coefs;
            const Vector3d n(c[0], c[1], c[2]);
            EXPECT_NEAR(n.norm(), 1, 1e-12);
            EXPECT_NEAR(n.dot(d), 0, 1e-9);
            EXPECT_NEAR(n.dot(x) + c[3], 0, 1e-9);
            Vector6d row;
            row << n, (x - translation_of(pose)).cross(n);
            of_points += weights[k] * row * row.transpose() / 1e-4;
        }
        const Matrix6d expected = information_of(g, l, pose);
        EXPECT_LT((of_points - expected).norm(), 1e-2 * expected.norm());
    }
}

TEST(MatcherLines, TheSameBitsOnAnyNumberOfThreads)
{
    SeededRandom random(5);
    const auto global = map_of_lines(random_lines(60, random)),
               local = map_of_lines(random_lines(60, random));
    const auto once = line_pairs(matched(Matcher_Lines(), global, local), global, local);
    EXPECT_GT(once.size(), 3u);
    for (const int threads : {1, 2, 8})
        with_threads(
            threads,
            [&]() { EXPECT_EQ(line_pairs(matched(Matcher_Lines(), global, local), global, local), once); });
}

TEST(MatcherLines, ParametersFromYaml)
{
    const auto made = [](const std::string& text)
    {
        Matcher_Lines m;
        m.initialize(yaml_from_text(text));
        return m;
    };
    const auto m =
        made("distanceThreshold: 0.2\nangleThresholdDeg: 3\nminimumOverlap: 0.5\npairAsPoints: true");
    EXPECT_EQ(m.minimumOverlap, 0.5);
    EXPECT_TRUE(m.pairAsPoints);
    expect_problem_with<ConfigError>({"distanceThreshold"}, [&]() { made("angleThresholdDeg: 3"); });
    for (const char* bad :
         {"distanceThreshold: 0", "distanceThreshold: 1\nangleThresholdDeg: 90",
          "distanceThreshold: 1\nminimumOverlap: 2", "distanceThreshold: 1\nunitWeightSigma: 0",
          "distanceThreshold: 1\nmaxAlongDistance: -1", "distanceThreshold: 1\nangle: 2"})
        EXPECT_THROW(made(bad), ConfigError) << bad;
}
