#include <mp2p_icp/consistency_graph.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "solver_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Indices = std::vector<size_t>;

namespace
{
constexpr double SIGMA = 1e-3, TOLERANCE = 6 * SIGMA, SIDE = 50;
const double NaN = std::numeric_limits<double>::quiet_NaN();
const double INF = std::numeric_limits<double>::infinity();

Indices inliers_of(const Pairings& p, double tolerance = TOLERANCE, size_t max_partners = 64,
                   uint64_t seed = 1)
{
    ConsistencyGraphParameters params;
    params.tolerance = tolerance;
    params.max_partners = max_partners;
    params.seed = seed;
    return consistency_graph_inliers(p.paired_pt2pt, params);
}

/// At most 3 sigma long: the lengths between two inliers differ by at most 6 sigma.
Vector3d cut_gaussian(SeededRandom& random)
{
    Vector3d v;
    do v = SIGMA * Vector3d(random.gaussian(), random.gaussian(), random.gaussian());
    while (v.norm() > 3 * SIGMA);
    return v;
}
Vector3d in_cube(SeededRandom& random)
{
    return random_point(random, SIDE / 2) + Vector3d::Constant(SIDE / 2);
}
bool consistent(const Pairings& p, size_t i, size_t j, double tolerance)
{
    return std::abs((global_of(p, i) - global_of(p, j)).norm() - (local_of(p, i) - local_of(p, j)).norm()) <=
           tolerance;
}

struct Scene
{
    Pairings p;
    Indices inliers;
    Indices outliers;
};

/// Points that move as one; appended, with their indices.
Indices add_body(Pairings& p, size_t count, SeededRandom& random)
{
    const Matrix3d R = any_rotation(random);
    const Vector3d t = random_point(random, 30);
    Indices out;
    for (size_t k = 0; k < count; k++)
    {
        const Vector3d b = in_cube(random);
        out.push_back(p.paired_pt2pt.size());
        add_pair(p, R * b + t + cut_gaussian(random), b);
    }
    return out;
}

/// A pairing with points uniform in the cubes, consistent with less than a quarter of the inliers.
void add_outlier(Scene& s, SeededRandom& random, double tolerance)
{
    const size_t i = s.p.paired_pt2pt.size();
    for (;;)
    {
        add_pair(s.p, in_cube(random), in_cube(random));
        const auto agreeing = std::count_if(s.inliers.begin(), s.inliers.end(),
                                            [&](size_t j) { return consistent(s.p, i, j, tolerance); });
        if (4 * static_cast<size_t>(agreeing) < s.inliers.size()) break;
        s.p.paired_pt2pt.pop_back();
    }
    s.outliers.push_back(i);
}

/// What p's pairings become in the given order; `where[i]`: where pairing i is then.
Pairings reordered(const Pairings& p, const Indices& order, Indices& where)
{
    Pairings out;
    where.resize(order.size());
    for (size_t k = 0; k < order.size(); k++)
    {
        add_pair(out, global_of(p, order[k]), local_of(p, order[k]));
        where[order[k]] = k;
    }
    return out;
}
Indices mapped(const Indices& indices, const Indices& where)
{
    Indices out;
    for (const size_t i : indices) out.push_back(where[i]);
    std::sort(out.begin(), out.end());
    return out;
}
Indices any_order(size_t count, SeededRandom& random)
{
    Indices order(count);
    std::iota(order.begin(), order.end(), size_t(0));
    for (size_t left = count; left > 1; left--) std::swap(order[left - 1], order[random.index(left)]);
    return order;
}
void reorder(Scene& s, SeededRandom& random)
{
    Indices where;
    s.p = reordered(s.p, any_order(s.p.paired_pt2pt.size(), random), where);
    s.inliers = mapped(s.inliers, where);
    s.outliers = mapped(s.outliers, where);
}

/** Inliers and outliers in any order. Every two inliers are consistent, an outlier is so with less than a
 * quarter of them: a jury with a majority of inliers cannot err.
 */
Scene make_scene(size_t inliers, size_t outliers, uint64_t seed, double tolerance = TOLERANCE)
{
    SeededRandom random(seed);
    Scene s;
    s.inliers = add_body(s.p, inliers, random);
    for (size_t k = 0; k < outliers; k++) add_outlier(s, random, tolerance);
    reorder(s, random);
    return s;
}
Indices all_of(const Pairings& p)
{
    Indices all(p.paired_pt2pt.size());
    std::iota(all.begin(), all.end(), size_t(0));
    return all;
}
Pairings shifted(const Pairings& p, const Vector3d& global, const Vector3d& local)
{
    Pairings out;
    for (size_t i = 0; i < p.paired_pt2pt.size(); i++)
        add_pair(out, global_of(p, i) + global, local_of(p, i) + local);
    return out;
}

/// The core of the whole graph: as long as a vertex has fewer than k neighbours left, it goes; the last k
/// with any left.
Indices brute_force_core(const Pairings& p, double tolerance)
{
    const size_t n = p.paired_pt2pt.size();
    Indices left = all_of(p), last;
    for (size_t k = 1; !left.empty(); k++)
    {
        last = left;
        for (size_t before = n + 1; before != left.size();)
        {
            before = left.size();
            const Indices now = left;
            left.erase(std::remove_if(left.begin(), left.end(),
                                      [&](size_t i)
                                      {
                                          const auto degree = std::count_if(
                                              now.begin(), now.end(),
                                              [&](size_t j)
                                              { return i != j && consistent(p, i, j, tolerance); });
                                          return static_cast<size_t>(degree) < k;
                                      }),
                       left.end());
        }
    }
    return last;
}
}  // namespace

TEST(ConsistencyGraph, exactly_the_inliers_among_95_percent_outliers)
{
    size_t exact = 0;
    for (uint64_t seed = 1; seed <= 200; seed++)
    {
        const Scene s = make_scene(50, 950, seed);
        exact += inliers_of(s.p) == s.inliers;
    }
    EXPECT_GE(exact, 199u);  // chance in the graph, none in the scene: 99 % are asked for
}

TEST(ConsistencyGraph, exactly_the_inliers_at_any_ratio)
{
    for (const size_t inliers : {20u, 100u, 300u, 700u, 950u, 1000u})
        for (uint64_t seed = 1; seed <= 5; seed++)
        {
            const Scene s = make_scene(inliers, 1000 - inliers, 1000 + seed);
            EXPECT_EQ(inliers_of(s.p, TOLERANCE, 64, seed), s.inliers) << inliers << " seed " << seed;
        }
}

TEST(ConsistencyGraph, is_the_core_of_the_whole_graph_when_nothing_caps_it)
{
    const double tolerance = 0.3;  // many edges by chance
    for (uint64_t seed = 1; seed <= 20; seed++)
    {
        const Scene s = make_scene(25, 75, seed, tolerance);
        const Indices core = brute_force_core(s.p, tolerance);
        EXPECT_EQ(core, s.inliers) << "seed " << seed;
        EXPECT_EQ(inliers_of(s.p, tolerance, 100), core) << "seed " << seed;
        EXPECT_EQ(inliers_of(s.p, tolerance, std::numeric_limits<size_t>::max()), core) << "seed " << seed;
        EXPECT_EQ(inliers_of(s.p, tolerance, 12), core) << "seed " << seed;
    }
}

TEST(ConsistencyGraph, ten_thousand_pairings)
{
    const Scene s = make_scene(500, 9500, 1);
    EXPECT_EQ(inliers_of(s.p), s.inliers);
}

TEST(ConsistencyGraph, the_larger_of_two_bodies_although_the_cap_makes_their_cores_alike)
{
    for (uint64_t seed = 1; seed <= 10; seed++)
    {
        SeededRandom random(seed);
        Scene s;
        add_body(s.p, 2000, random);
        s.inliers = add_body(s.p, 2200, random);
        add_body(s.p, 1900, random);
        reorder(s, random);
        EXPECT_EQ(inliers_of(s.p, TOLERANCE, 64, seed), s.inliers) << "seed " << seed;
    }
}

TEST(ConsistencyGraph, an_inlier_need_not_agree_with_all_others)
{
    // At 2 sigma every sixth edge is missing; most of the jury agree nevertheless.
    size_t missed = 0, inliers = 0;
    for (uint64_t seed = 1; seed <= 10; seed++)
    {
        const Scene s = make_scene(100, 900, seed);
        const Indices found = inliers_of(s.p, 2 * SIGMA);
        EXPECT_TRUE(std::includes(s.inliers.begin(), s.inliers.end(), found.begin(), found.end())) << seed;
        missed += s.inliers.size() - found.size();
        inliers += s.inliers.size();
    }
    EXPECT_LT(missed, inliers / 50);
}

TEST(ConsistencyGraph, copies_of_a_wrong_pairing_do_not_support_each_other)
{
    Scene s = make_scene(40, 100, 2);
    for (int k = 0; k < 200; k++) add_pair(s.p, global_of(s.p, s.outliers[3]), local_of(s.p, s.outliers[3]));
    EXPECT_EQ(inliers_of(s.p), s.inliers);
    // nor do they with noise, as a sensor that stands still makes them
    SeededRandom random(3);
    for (int k = 0; k < 200; k++)
        add_pair(s.p, global_of(s.p, s.outliers[5]) + cut_gaussian(random) / 3, local_of(s.p, s.outliers[5]));
    EXPECT_EQ(inliers_of(s.p), s.inliers);
}

TEST(ConsistencyGraph, copies_of_a_right_pairing_stay_and_do_not_outvote_the_others)
{
    Scene s = make_scene(40, 100, 4);
    for (int k = 0; k < 500; k++)
    {
        s.inliers.push_back(s.p.paired_pt2pt.size());
        add_pair(s.p, global_of(s.p, s.inliers[7]), local_of(s.p, s.inliers[7]));
    }
    // at the distance of the copied one, but elsewhere
    const size_t copied = s.inliers[7];
    const Vector3d offset(0, 0, 20);
    add_pair(s.p, global_of(s.p, copied) + offset, local_of(s.p, copied) - offset);
    add_pair(s.p, global_of(s.p, copied) - offset, local_of(s.p, copied) + offset);
    EXPECT_EQ(inliers_of(s.p), s.inliers);
}

TEST(ConsistencyGraph, far_coordinates_change_nothing)
{
    const Scene s = make_scene(100, 400, 5);
    const Vector3d far(1e7, -1e7, 1e7), zero = Vector3d::Zero();
    const double rounding = 1e-8;
    for (const auto& [global, local] :
         {std::pair(far, zero), std::pair(zero, far), std::pair(far, Vector3d(-far))})
        EXPECT_EQ(inliers_of(shifted(s.p, global, local), TOLERANCE + rounding), s.inliers);
}

TEST(ConsistencyGraph, permuted_pairings_give_the_permuted_result)
{
    const Scene s = make_scene(100, 900, 6);
    SeededRandom random(7);
    for (int k = 0; k < 3; k++)
    {
        Indices where;
        const Pairings permuted = reordered(s.p, any_order(1000, random), where);
        EXPECT_EQ(inliers_of(permuted), mapped(s.inliers, where));
    }
}

TEST(ConsistencyGraph, same_result_on_any_number_of_threads)
{
    // Noise above the tolerance: borderline cases, which any difference would tip.
    const Scene s = make_scene(1500, 2500, 9);
    const double tolerance = SIGMA;
    Indices one;
    with_threads(1, [&] { one = inliers_of(s.p, tolerance); });
    EXPECT_GT(one.size(), 200u);
    EXPECT_LT(one.size(), 1500u);
    for (const int threads : {2, 8})
        with_threads(threads, [&] { EXPECT_EQ(inliers_of(s.p, tolerance), one); });
}

TEST(ConsistencyGraph, numbers_that_are_not_finite_are_never_inliers)
{
    Scene s = make_scene(50, 50, 10);
    const size_t a = s.inliers[0], b = s.inliers[5], c = s.inliers[9];
    s.p.paired_pt2pt[a].global.x = NaN;
    s.p.paired_pt2pt[b].local.y = INF;
    s.p.paired_pt2pt[c].global.z = -INF;
    for (const size_t i : {a, b, c})
        s.inliers.erase(std::remove(s.inliers.begin(), s.inliers.end(), i), s.inliers.end());
    EXPECT_EQ(inliers_of(s.p), s.inliers);
    // squares of these overflow
    add_pair(s.p, Vector3d(1e200, 0, 0), Vector3d(-1e200, 1e200, 0));
    add_pair(s.p, Vector3d(1e308, 0, 0), Vector3d(-1e308, -1e308, 0));
    EXPECT_EQ(inliers_of(s.p), s.inliers);
}

TEST(ConsistencyGraph, few_pairings)
{
    Pairings p;
    EXPECT_EQ(inliers_of(p, 0.1), Indices());
    add_pair(p, {1, 0, 0}, {5, 0, 0});
    EXPECT_EQ(inliers_of(p, 0.1), Indices({0}));
    add_pair(p, {3, 0, 0}, {5, 2, 0});
    EXPECT_EQ(inliers_of(p, 0.1), Indices({0, 1}));
    add_pair(p, {40, 0, 0}, {5, 1, 0});
    EXPECT_EQ(inliers_of(p, 0.1), Indices({0, 1}));

    Pairings contradiction;
    add_pair(contradiction, {1, 0, 0}, {5, 0, 0});
    add_pair(contradiction, {3, 0, 0}, {5, 1, 0});
    EXPECT_EQ(inliers_of(contradiction, 0.1), Indices());
    Pairings nothing_finite;
    add_pair(nothing_finite, {NaN, 0, 0}, {5, 0, 0});
    EXPECT_EQ(inliers_of(nothing_finite, 0.1), Indices());
}

TEST(ConsistencyGraph, equal_points)
{
    Pairings same, one_to_many;
    for (int k = 0; k < 100; k++)
    {
        add_pair(same, {1, 2, 3}, {4, 5, 6});
        add_pair(one_to_many, {1, 2, 3}, {double(k), double(k * k), 6});
    }
    EXPECT_EQ(inliers_of(same, 1e-9), all_of(same));
    EXPECT_EQ(inliers_of(one_to_many, 0.1), Indices());
}

TEST(ConsistencyGraph, rejects_nothing_from_a_cloud_about_as_small_as_the_tolerance)
{
    for (const double size : {0.4, 0.8, 1.2, 2.0, 5.0})
        for (uint64_t seed = 1; seed <= 5; seed++)
        {
            SeededRandom random(seed);
            const Pairings p = moved_points(random_points(200, size * TOLERANCE, seed), any_rotation(random),
                                            random_point(random, 30));
            EXPECT_EQ(inliers_of(p), all_of(p)) << size << " seed " << seed;
        }
}

TEST(ConsistencyGraph, refuses_bad_parameters)
{
    const Scene s = make_scene(10, 0, 11);
    const auto complaint = [&](double tolerance, size_t max_partners) -> std::string
    {
        try
        {
            inliers_of(s.p, tolerance, max_partners);
        }
        catch (const std::invalid_argument& e)
        {
            return e.what();
        }
        return "none";
    };
    for (const double tolerance : {0.0, -1.0, NaN, INF, ConsistencyGraphParameters().tolerance})
        EXPECT_NE(complaint(tolerance, 64).find("tolerance"), std::string::npos) << tolerance;
    EXPECT_NE(complaint(1, 0).find("max_partners"), std::string::npos);
    EXPECT_EQ(complaint(1, 1), "none");
}
