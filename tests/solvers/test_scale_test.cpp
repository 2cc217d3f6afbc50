#include <mp2p_icp/scale_test.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>

#include "solver_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Indices = std::vector<size_t>;

namespace
{
constexpr double SIGMA = 1e-3, TOLERANCE = 3e-3, SIDE = 50;
const double NaN = std::numeric_limits<double>::quiet_NaN();
const double INF = std::numeric_limits<double>::infinity();

Vector3d gaussian(SeededRandom& random)
{
    const double x = random.gaussian(), y = random.gaussian();
    return SIGMA * Vector3d(x, y, random.gaussian());
}
/// At most SIGMA long: no inlier can then leave a gate of TOLERANCE.
Vector3d bounded(SeededRandom& random)
{
    return random_direction(random) * random.uniform(0, SIGMA);
}
using Noise = std::function<Vector3d(SeededRandom&)>;

struct Scene
{
    Pairings p;
    Matrix3d R;
    Vector3d t;
    Indices inliers;
};

enum class Outliers
{
    InGlobalCube,  ///< uniform in the cube of the local cloud, wherever that has moved to
    InMovedBox     ///< uniform in the box of the moved cloud
};

double length_difference(const Pairings& p, size_t i, const Vector3d& a, size_t j)
{
    return std::abs((a - global_of(p, j)).norm() - (local_of(p, i) - local_of(p, j)).norm());
}

/// Replaces the global point of pairing i by a uniform one that contradicts all inliers by far.
void make_outlier(Scene& s, size_t i, const Eigen::AlignedBox3d& box, SeededRandom& random)
{
    Vector3d a;
    do
    {
        const Vector3d u = random_point(random, 0.5) + Vector3d::Constant(0.5);
        a = box.min() + u.cwiseProduct(box.sizes());
    } while (std::any_of(s.inliers.begin(), s.inliers.end(),
                         [&](size_t j) { return length_difference(s.p, i, a, j) <= 4 * TOLERANCE; }));
    s.p.paired_pt2pt[i].global = to_mrpt(a);
}

Scene make_scene(const std::vector<Vector3d>& local, double outlier_ratio, uint64_t seed,
                 const Noise& noise = bounded, Outliers kind = Outliers::InGlobalCube)
{
    SeededRandom random(seed);
    Scene s{{}, any_rotation(random), random_point(random, 30), {}};
    Eigen::AlignedBox3d box(Vector3d::Zero(), Vector3d::Constant(SIDE)), moved;
    for (const auto& b : local)
    {
        add_pair(s.p, s.R * b + s.t + noise(random), b);
        moved.extend(global_of(s.p, s.p.size() - 1));
    }
    const auto count = static_cast<size_t>(std::lround(outlier_ratio * static_cast<double>(local.size())));
    const Indices outliers = random_subset(local.size(), count, random());
    for (size_t i = 0; i < local.size(); i++)
        if (!std::binary_search(outliers.begin(), outliers.end(), i)) s.inliers.push_back(i);
    for (const size_t i : outliers) make_outlier(s, i, kind == Outliers::InMovedBox ? moved : box, random);
    return s;
}
std::vector<Vector3d> cube(size_t n, uint64_t seed)
{
    auto points = random_points(n, SIDE / 2, seed);
    for (auto& p : points) p += Vector3d::Constant(SIDE / 2);
    return points;
}
Indices all_of(const Pairings& p)
{
    Indices all(p.paired_pt2pt.size());
    std::iota(all.begin(), all.end(), size_t(0));
    return all;
}

struct PoseError
{
    double angle, distance;
};
PoseError error_of(const Scene& s, const Indices& kept)
{
    if (kept.size() < 3) return {M_PI, SIDE};
    Eigen::Matrix3Xd a(3, kept.size()), b(3, kept.size());
    for (size_t k = 0; k < kept.size(); k++)
    {
        a.col(static_cast<Eigen::Index>(k)) = global_of(s.p, kept[k]);
        b.col(static_cast<Eigen::Index>(k)) = local_of(s.p, kept[k]);
    }
    const Eigen::Matrix4d T = Eigen::umeyama(b, a, false);
    return {angle_between(T.topLeftCorner<3, 3>(), s.R), (T.topRightCorner<3, 1>() - s.t).norm()};
}
double median(std::vector<double> v)
{
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}
Pairings shifted(const Pairings& p, const Vector3d& global, const Vector3d& local)
{
    Pairings out;
    for (size_t i = 0; i < p.paired_pt2pt.size(); i++)
        add_pair(out, global_of(p, i) + global, local_of(p, i) + local);
    return out;
}
}  // namespace

TEST(ScaleTest, exactly_the_inliers_where_outliers_contradict_every_inlier)
{
    for (const double ratio : {0.0, 0.05, 0.3, 0.5, 0.6, 0.75})
        for (const Outliers kind : {Outliers::InGlobalCube, Outliers::InMovedBox})
            for (uint64_t seed = 1; seed <= 20; seed++)
            {
                const Scene s = make_scene(cube(200, seed), ratio, 100 + seed, bounded, kind);
                EXPECT_EQ(noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE), s.inliers)
                    << ratio << " seed " << seed;
            }
}

TEST(ScaleTest, pose_errors_fall_by_orders_at_every_outlier_ratio)
{
    for (const double ratio : {0.05, 0.25, 0.5, 0.75})
        for (const Outliers kind : {Outliers::InGlobalCube, Outliers::InMovedBox})
        {
            std::vector<double> angle_all, angle_kept, distance_all, distance_kept;
            for (uint64_t seed = 1; seed <= 31; seed++)
            {
                const Scene s = make_scene(cube(200, seed), ratio, 200 + seed, gaussian, kind);
                const PoseError all = error_of(s, all_of(s.p)),
                                kept = error_of(s, noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE));
                angle_all.push_back(all.angle), distance_all.push_back(all.distance);
                angle_kept.push_back(kept.angle), distance_kept.push_back(kept.distance);
            }
            EXPECT_LT(median(angle_kept), 1e-3 * median(angle_all)) << ratio;
            EXPECT_LT(median(distance_kept), 1e-3 * median(distance_all)) << ratio;
            EXPECT_LT(*std::max_element(distance_kept.begin(), distance_kept.end()), 3e-3) << ratio;
        }
}

TEST(ScaleTest, chance_agreement_in_a_crowded_scene)
{
    // The noise is a 500th of the scene: a wrong pairing agrees with a centre once in thirty times.
    const double side = 0.5;
    for (const bool flat : {false, true})
        for (uint64_t seed = 1; seed <= 300; seed++)
        {
            SeededRandom random(seed);
            Scene s{{}, any_rotation(random), random_point(random, 30), {}};
            const Matrix3d tilt = any_rotation(random);
            for (int i = 0; i < 200; i++)
            {
                Vector3d b = random_point(random, side / 2);
                if (flat) b.z() = 0;
                b = tilt * b;
                const Vector3d a = i % 4 ? random_point(random, side / 2) : b;
                add_pair(s.p, s.R * a + s.t + gaussian(random), b);
            }
            const Indices kept = noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE);
            EXPECT_LT(error_of(s, kept).distance, SIGMA) << flat << " seed " << seed;
        }
}

TEST(ScaleTest, gaussian_noise_loses_as_many_inliers_as_three_sigma_say)
{
    const Scene s = make_scene(cube(20000, 1), 0, 2, gaussian);
    const size_t lost = 20000 - noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE).size();
    EXPECT_NEAR(static_cast<double>(lost), 20000 * 0.0027, 5 * std::sqrt(20000 * 0.0027));
}

TEST(ScaleTest, tilted_planes_and_lines)
{
    for (uint64_t seed = 1; seed <= 20; seed++)
    {
        SeededRandom random(seed);
        const Matrix3d tilt = any_rotation(random);
        auto plane = cube(200, seed), line = plane;
        for (auto& b : plane) b = tilt * Vector3d(b.x(), b.y(), 0);
        for (auto& b : line) b = tilt * Vector3d(b.x(), 0, 0);
        for (const auto& local : {plane, line})
        {
            const Scene s = make_scene(local, 0.5, seed);
            EXPECT_EQ(noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE), s.inliers) << "seed " << seed;
        }
    }
}

TEST(ScaleTest, a_pairing_at_the_centroid_is_no_outlier)
{
    // The ratio of eq. (3) is unbounded there.
    auto local = cube(100, 3);
    Vector3d mean = Vector3d::Zero();
    for (const auto& b : local) mean += b / 100;
    local.push_back(mean);
    const Scene s = make_scene(local, 0, 4);
    EXPECT_EQ(noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE), all_of(s.p));
}

TEST(ScaleTest, copies_of_a_wrong_pairing_do_not_support_each_other)
{
    Scene s = make_scene(cube(60, 5), 0.5, 6);
    size_t outlier = 0;
    while (std::binary_search(s.inliers.begin(), s.inliers.end(), outlier)) outlier++;
    for (int k = 0; k < 200; k++) add_pair(s.p, global_of(s.p, outlier), local_of(s.p, outlier));
    EXPECT_EQ(noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE), s.inliers);
}

TEST(ScaleTest, copies_of_right_pairings_stay)
{
    Scene s = make_scene(cube(60, 7), 0.5, 8);
    const Indices first = s.inliers;
    for (const size_t i : first)
    {
        s.inliers.push_back(s.p.paired_pt2pt.size());
        add_pair(s.p, global_of(s.p, i), local_of(s.p, i));
    }
    EXPECT_EQ(noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE), s.inliers);
}

TEST(ScaleTest, far_coordinates_change_nothing)
{
    const Scene s = make_scene(cube(200, 9), 0.5, 10);
    const Vector3d far(1e7, -1e7, 1e7), zero = Vector3d::Zero();
    EXPECT_EQ(noise_scale_inliers(shifted(s.p, far, zero).paired_pt2pt, TOLERANCE), s.inliers);
    EXPECT_EQ(noise_scale_inliers(shifted(s.p, zero, far).paired_pt2pt, TOLERANCE), s.inliers);
    EXPECT_EQ(noise_scale_inliers(shifted(s.p, far, -far).paired_pt2pt, TOLERANCE), s.inliers);
}

TEST(ScaleTest, permuted_pairings_give_the_permuted_result)
{
    const Scene s = make_scene(cube(200, 11), 0.6, 12);
    SeededRandom random(13);
    Indices order = all_of(s.p);
    for (size_t left = order.size(); left > 1; left--) std::swap(order[left - 1], order[random.index(left)]);
    Pairings permuted;
    for (const size_t i : order) add_pair(permuted, global_of(s.p, i), local_of(s.p, i));
    Indices kept;
    for (const size_t k : noise_scale_inliers(permuted.paired_pt2pt, TOLERANCE)) kept.push_back(order[k]);
    std::sort(kept.begin(), kept.end());
    EXPECT_EQ(kept, s.inliers);
}

TEST(ScaleTest, same_result_on_any_number_of_threads)
{
    const Scene s = make_scene(cube(5000, 14), 0.5, 15, gaussian);
    Indices one;
    with_threads(1, [&] { one = noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE); });
    EXPECT_GT(one.size(), 2400u);
    EXPECT_LE(one.size(), 2500u);
    for (const int threads : {2, 8})
        with_threads(threads, [&] { EXPECT_EQ(noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE), one); });
}

TEST(ScaleTest, numbers_that_are_not_finite_are_never_inliers)
{
    Scene s = make_scene(cube(50, 16), 0.2, 17);
    const size_t a = s.inliers[0], b = s.inliers[5], c = s.inliers[9];
    s.p.paired_pt2pt[a].global.x = NaN;
    s.p.paired_pt2pt[b].local.y = INF;
    s.p.paired_pt2pt[c].global.z = -INF;
    for (const size_t i : {a, b, c})
        s.inliers.erase(std::remove(s.inliers.begin(), s.inliers.end(), i), s.inliers.end());
    EXPECT_EQ(noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE), s.inliers);
    // squares of these overflow
    add_pair(s.p, Vector3d(1e200, 0, 0), Vector3d(-1e200, 1e200, 0));
    add_pair(s.p, Vector3d(1e308, 0, 0), Vector3d(-1e308, -1e308, 0));
    EXPECT_EQ(noise_scale_inliers(s.p.paired_pt2pt, TOLERANCE), s.inliers);
}

TEST(ScaleTest, few_pairings)
{
    Pairings p;
    EXPECT_EQ(noise_scale_inliers(p.paired_pt2pt, 0.1), Indices());
    add_pair(p, {1, 0, 0}, {5, 0, 0});
    EXPECT_EQ(noise_scale_inliers(p.paired_pt2pt, 0.1), Indices({0}));
    add_pair(p, {3, 0, 0}, {5, 2, 0});
    EXPECT_EQ(noise_scale_inliers(p.paired_pt2pt, 0.1), Indices({0, 1}));
    add_pair(p, {40, 0, 0}, {5, 1, 0});
    EXPECT_EQ(noise_scale_inliers(p.paired_pt2pt, 0.1), Indices({0, 1}));

    Pairings contradiction;
    add_pair(contradiction, {1, 0, 0}, {5, 0, 0});
    add_pair(contradiction, {3, 0, 0}, {5, 1, 0});
    EXPECT_EQ(noise_scale_inliers(contradiction.paired_pt2pt, 0.1), Indices());
    Pairings nothing_finite;
    add_pair(nothing_finite, {NaN, 0, 0}, {5, 0, 0});
    EXPECT_EQ(noise_scale_inliers(nothing_finite.paired_pt2pt, 0.1), Indices());
}

TEST(ScaleTest, equal_points)
{
    Pairings same, one_to_many;
    for (int k = 0; k < 100; k++)
    {
        add_pair(same, {1, 2, 3}, {4, 5, 6});
        add_pair(one_to_many, {1, 2, 3}, {double(k), double(k * k), 6});
    }
    EXPECT_EQ(noise_scale_inliers(same.paired_pt2pt, 1e-9), all_of(same));
    EXPECT_EQ(noise_scale_inliers(one_to_many.paired_pt2pt, 0.1), Indices());
}

TEST(ScaleTest, rejects_nothing_from_a_cloud_about_as_small_as_the_tolerance)
{
    for (const double size : {0.4, 0.8, 1.2, 2.0, 5.0})
        for (uint64_t seed = 1; seed <= 5; seed++)
        {
            SeededRandom random(seed);
            const Matrix3d R = any_rotation(random);
            const Pairings p =
                moved_points(random_points(200, size * TOLERANCE, seed), R, random_point(random, 30));
            EXPECT_EQ(noise_scale_inliers(p.paired_pt2pt, TOLERANCE), all_of(p)) << size << " seed " << seed;
        }
}

TEST(ScaleTest, refuses_a_tolerance_that_is_none)
{
    const Scene s = make_scene(cube(10, 18), 0, 19);
    for (const double tolerance : {0.0, -1.0, NaN, INF}) try
        {
            noise_scale_inliers(s.p.paired_pt2pt, tolerance);
            FAIL() << tolerance;
        }
        catch (const std::invalid_argument& e)
        {
            EXPECT_NE(std::string(e.what()).find("tolerance"), std::string::npos) << e.what();
        }
}
