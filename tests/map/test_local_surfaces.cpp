#include <gtest/gtest.h>
#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/random.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <thread>

#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mrpt::maps::CSimplePointsMap;

namespace
{
const float NaN = std::numeric_limits<float>::quiet_NaN();
using Points = std::vector<Eigen::Vector3f>;

CSimplePointsMap::Ptr cloud_of(const Points& points)
{
    const auto cloud = CSimplePointsMap::Create();
    for (const auto& p : points) cloud->insertPoint(p.x(), p.y(), p.z());
    return cloud;
}

Points random_points(size_t n, double size, uint64_t seed)
{
    SeededRandom random(seed);
    Points points(n);
    for (auto& p : points)
        for (int a = 0; a < 3; a++) p[a] = static_cast<float>(random.uniform(-size, size));
    return points;
}

std::vector<LocalSurface> surfaces_of(const Points& points, const LocalSurfaceOptions& options)
{
    const auto cloud = cloud_of(points);
    return compute_local_surfaces(*cloud, make_nn_index(cloud).get(), options)->of_point;
}

/// The slow, obvious neighbourhood: all distances in float, sorted, ties by index.
std::vector<Eigen::Vector3d> neighborhood(const Points& points, size_t i, const LocalSurfaceOptions& options)
{
    std::vector<std::pair<float, size_t>> all;
    for (size_t j = 0; j < points.size(); j++)
    {
        float d = 0;
        for (int a = 0; a < 3; a++) d += (points[i][a] - points[j][a]) * (points[i][a] - points[j][a]);
        if (d < static_cast<float>(options.radius * options.radius)) all.emplace_back(d, j);
    }
    std::sort(all.begin(), all.end());
    all.resize(std::min<size_t>(all.size(), options.neighbors));
    std::vector<Eigen::Vector3d> out;
    for (const auto& [d, j] : all) out.push_back(points[j].cast<double>());
    return out;
}

struct Pca
{
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), values;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    explicit Pca(const std::vector<Eigen::Vector3d>& points)
    {
        const double n = static_cast<double>(points.size());
        for (const auto& p : points) mean += p / n;
        for (const auto& p : points) covariance += (p - mean) * (p - mean).transpose() / n;
        // Another way than the library's: singular values of a symmetric matrix.
        const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance);
        values = svd.singularValues().reverse();
    }
};

void expect_same_bits(const std::vector<LocalSurface>& a, const std::vector<LocalSurface>& b)
{
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); i++)
        ASSERT_EQ(std::memcmp(&a[i], &b[i], sizeof(LocalSurface)), 0) << "point " << i;
}

/// How far a vector is from an eigenvector of this value, over the size of the matrix.
double eigen_residual(const Eigen::Matrix3d& m, const Eigen::Vector3f& v, double value)
{
    const Eigen::Vector3d u = v.cast<double>();
    return (m * u - value * u).norm() / m.norm();
}
}  // namespace

// ---- Against brute force ----------------------------------------------------------------------------------

TEST(local_surfaces, agree_with_brute_force_on_random_clouds)
{
    size_t by_count = 0, by_radius = 0;
    for (const uint64_t seed : {1u, 2u, 3u})
        for (const LocalSurfaceOptions options :
             {LocalSurfaceOptions{5, 10.0}, LocalSurfaceOptions{20, 0.7}, LocalSurfaceOptions{1000, 0.4}})
        {
            SCOPED_TRACE(testing::Message() << "seed " << seed << ", k " << options.neighbors);
            const Points points = random_points(400, 2, seed);
            const auto surfaces = surfaces_of(points, options);
            ASSERT_EQ(surfaces.size(), points.size());
            for (size_t i = 0; i < points.size(); i++)
            {
                const auto expected_points = neighborhood(points, i, options);
                const LocalSurface& s = surfaces[i];
                ASSERT_EQ(s.count, expected_points.size());
                (s.count == options.neighbors ? by_count : by_radius)++;
                const Pca pca(expected_points);
                // Results are stored in float: 2^-24 of each, times a few for the norms.
                EXPECT_LT((points[i].cast<double>() + s.to_mean.cast<double>() - pca.mean).norm(), 2e-7);
                const double size = std::max(pca.covariance.norm(), 1e-30);
                EXPECT_LT((s.eigenvalues.cast<double>() - pca.values).norm(), 2e-7 * size);
                if (s.count < 2) continue;
                EXPECT_NEAR(s.normal.norm(), 1, 3e-7);
                EXPECT_NEAR(s.direction.norm(), 1, 3e-7);
                EXPECT_LT(eigen_residual(pca.covariance, s.normal, pca.values[0]), 5e-7);
                EXPECT_LT(eigen_residual(pca.covariance, s.direction, pca.values[2]), 5e-7);
            }
        }
    EXPECT_GT(by_count, 500u);
    EXPECT_GT(by_radius, 500u);
}

TEST(local_surfaces, of_voxels_agree_with_brute_force)
{
    const double side = 0.37;
    const auto voxel_of = [&](const Eigen::Vector3f& p)
    { return Eigen::Vector3i((p.cast<double>() / side).array().floor().cast<int>().matrix()); };
    const Points points = random_points(700, 1.5, 8);
    const auto surfaces = surfaces_of(points, LocalSurfaceOptions::of_voxels(side));
    size_t compared = 0;
    for (size_t i = 0; i < points.size(); i++)
    {
        std::vector<Eigen::Vector3d> around;
        std::set<std::array<int, 3>> voxels;
        for (const auto& q : points)
        {
            const Eigen::Vector3i v = voxel_of(q);
            if ((v - voxel_of(points[i])).cwiseAbs().maxCoeff() > 1) continue;
            around.push_back(q.cast<double>());
            voxels.insert({v.x(), v.y(), v.z()});
        }
        const LocalSurface& s = surfaces[i];
        ASSERT_EQ(s.count, around.size());
        ASSERT_EQ(s.voxels, voxels.size());
        const Pca pca(around);
        EXPECT_LT((points[i].cast<double>() + s.to_mean.cast<double>() - pca.mean).norm(), 5e-7);
        // Directions are as sure as their eigenvalues are apart; and of a nearly double one each of the six
        // steps of the root finder leaves a third of the error.
        const double gap = std::min(pca.values[1] - pca.values[0], pca.values[2] - pca.values[1]);
        const double tolerance = gap > 0.05 * pca.values[2] ? 1e-6 : 1e-4;
        EXPECT_LT((s.eigenvalues.cast<double>() - pca.values).norm(), tolerance * pca.covariance.norm());
        if (s.count < 4 || gap < 0.02 * pca.values[2]) continue;
        compared++;
        EXPECT_NEAR(s.normal.norm(), 1, 3e-7);
        EXPECT_NEAR(s.direction.norm(), 1, 3e-7);
        EXPECT_LT(eigen_residual(pca.covariance, s.normal, pca.values[0]), 1e-6);
        EXPECT_LT(eigen_residual(pca.covariance, s.direction, pca.values[2]), 1e-6);
    }
    EXPECT_GT(compared, 400u);
}

TEST(local_surfaces, of_voxels_know_lines_planes_and_points_that_are_not_finite)
{
    Points line, plane;
    for (int i = 0; i < 40; i++)
        line.push_back({0.1f * static_cast<float>(i), 0.2f * static_cast<float>(i), 1});
    for (int i = 0; i < 400; i++)
        plane.push_back({0.1f * static_cast<float>(i % 20), 0.1f * static_cast<float>(i / 20), 3});
    plane.push_back({NaN, 0, 0});
    const auto of_line = surfaces_of(line, LocalSurfaceOptions::of_voxels(0.5));
    EXPECT_EQ(of_line[20].shape({}), SurfaceShape::Linear);
    EXPECT_LT(of_line[20].direction.cross(Eigen::Vector3f(1, 2, 0).normalized()).norm(), 1e-6f);
    const auto of_plane = surfaces_of(plane, LocalSurfaceOptions::of_voxels(0.3));
    EXPECT_EQ(of_plane[210].shape({}), SurfaceShape::Planar);
    EXPECT_LT((of_plane[210].normal - Eigen::Vector3f::UnitZ()).norm(), 1e-6f);
    EXPECT_EQ(of_plane[210].voxels, 9u);
    EXPECT_EQ(of_plane[400].count, 0u);
    for (const double bad : {-1.0, double(NaN), std::numeric_limits<double>::infinity()})
        EXPECT_THROW(surfaces_of(line, LocalSurfaceOptions::of_voxels(bad)), std::invalid_argument) << bad;
}

TEST(local_surfaces, among_equally_near_points_the_lower_indices_count)
{
    // Four neighbours at the same distance, room for two.
    const Points points = {{0, 0, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}};
    const LocalSurface s = surfaces_of(points, {3, 5.0})[1];
    EXPECT_EQ(s.count, 3u);
    EXPECT_LT((s.to_mean - Eigen::Vector3f(1, 0, 1) / 3).norm(), 1e-7);
}

TEST(local_surfaces, a_point_at_the_radius_itself_does_not_count)
{
    const Points points = {{0, 0, 0}, {0.5f, 0, 0}, {0, std::nextafter(0.5f, 0.0f), 0}};
    EXPECT_EQ(surfaces_of(points, {10, 0.5})[0].count, 2u);
}

TEST(local_surfaces, points_at_one_place_have_no_shape)
{
    const auto surfaces = surfaces_of(Points(7, {1, 2, 3}), {5, 0.5});
    for (const auto& s : surfaces)
    {
        EXPECT_EQ(s.count, 5u);
        EXPECT_EQ(s.eigenvalues, Eigen::Vector3f(0, 0, 0));
        EXPECT_EQ(s.shape({}), SurfaceShape::Unknown);
    }
}

// ---- Exact shapes -----------------------------------------------------------------------------------------

TEST(local_surfaces, find_the_normals_of_planes_anywhere)
{
    SeededRandom random(4);
    for (int round = 0; round < 20; round++)
    {
        SCOPED_TRACE(round);
        const Eigen::Vector3d n =
            Eigen::Vector3d(random.gaussian(), random.gaussian(), random.gaussian()).normalized();
        const Eigen::Vector3d u = n.unitOrthogonal(), v = n.cross(u);
        const Eigen::Vector3d at(random.uniform(-50, 50), random.uniform(-50, 50), random.uniform(-50, 50));
        Points points;
        for (int i = 0; i < 300; i++)
            points.push_back((at + random.uniform(-2, 2) * u + random.uniform(-2, 2) * v).cast<float>());
        size_t planar = 0;
        for (const auto& s : surfaces_of(points, {12, 2.0}))
        {
            if (s.shape({}) != SurfaceShape::Planar) continue;
            planar++;
            // Coordinates up to 50 m are rounded by 2e-6 m, over neighbourhoods of some 0.3 m.
            EXPECT_LT(s.normal.cast<double>().cross(n).norm(), 5e-5);
        }
        EXPECT_GT(planar, 250u);
    }
}

TEST(local_surfaces, are_exact_on_planes_that_floats_can_hold)
{
    Points points;
    for (int i = 0; i < 12; i++)
        for (int j = 0; j < 12; j++)
            points.emplace_back(0.25f * static_cast<float>(i), 7.0f, 0.25f * static_cast<float>(j));
    for (const auto& s : surfaces_of(points, {9, 1.0}))
    {
        EXPECT_EQ(s.normal, Eigen::Vector3f(0, 1, 0));
        EXPECT_EQ(s.eigenvalues[0], 0);
        EXPECT_EQ(s.to_mean.y(), 0);
        EXPECT_EQ(s.shape({}), SurfaceShape::Planar);
    }
}

TEST(local_surfaces, find_the_directions_of_lines)
{
    Points points;
    const Eigen::Vector3d u = Eigen::Vector3d(-1, 2, 3).normalized();
    for (int i = 0; i < 50; i++) points.push_back((0.1 * i * u).cast<float>());
    for (const auto& s : surfaces_of(points, {5, 1.0}))
    {
        EXPECT_EQ(s.shape({}), SurfaceShape::Linear);
        EXPECT_LT((s.direction.cast<double>() - u).norm(), 3e-6);  // the largest component is positive
    }
}

TEST(local_surfaces, eigenvectors_have_the_sign_of_their_largest_component)
{
    for (const auto& s : surfaces_of(random_points(500, 1, 5), {8, 5.0}))
        for (const auto& v : {s.normal, s.direction}) EXPECT_EQ(v.maxCoeff(), v.cwiseAbs().maxCoeff());
}

// ---- Shapes -----------------------------------------------------------------------------------------------

TEST(local_surfaces, eigenvalues_and_counts_decide_the_shape)
{
    const auto shape = [](float e0, float e1, float e2, uint32_t count = 10, uint32_t plane_points = 3)
    {
        LocalSurface s;
        s.eigenvalues = {e0, e1, e2}, s.count = count;
        ShapeLimits limits;
        limits.plane = 0.02, limits.plane_width = 0.25, limits.line = 0.05;
        limits.plane_points = plane_points, limits.line_points = 4;
        return s.shape(limits);
    };
    EXPECT_EQ(shape(0.01f, 0.5f, 1), SurfaceShape::Planar);
    EXPECT_EQ(shape(0.03f, 0.5f, 1), SurfaceShape::Other) << "too thick";
    EXPECT_EQ(shape(0.01f, 0.2f, 1), SurfaceShape::Other) << "too narrow, too wide for a line";
    EXPECT_EQ(shape(0.01f, 0.04f, 1), SurfaceShape::Linear);
    EXPECT_EQ(shape(1, 1, 1), SurfaceShape::Other);
    EXPECT_EQ(shape(0, 0, 0), SurfaceShape::Unknown);
    EXPECT_EQ(shape(0, 0.5f, 1, 9, 10), SurfaceShape::Unknown) << "too few for a plane";
    EXPECT_EQ(shape(0, 0, 1, 3), SurfaceShape::Unknown) << "too few for a line";
    EXPECT_EQ(shape(NaN, NaN, NaN), SurfaceShape::Unknown);
    const float inf = std::numeric_limits<float>::infinity();
    EXPECT_EQ(shape(0, inf, inf), SurfaceShape::Unknown);
}

// ---- Little and bad data ----------------------------------------------------------------------------------

TEST(local_surfaces, points_that_are_not_finite_have_none_and_are_in_nobodys_way)
{
    const float inf = std::numeric_limits<float>::infinity();
    const Points good = random_points(200, 1, 6);
    const auto expected = surfaces_of(good, {8, 0.8});
    for (const float bad : {NaN, inf, -inf})
    {
        Points dirty;
        std::vector<size_t> place;
        for (size_t i = 0; i < good.size(); i++)
        {
            if (i % 3 == 0) dirty.emplace_back(bad, 0.0f, 0.0f), dirty.emplace_back(0.0f, 0.0f, bad);
            place.push_back(dirty.size());
            dirty.push_back(good[i]);
        }
        const auto found = surfaces_of(dirty, {8, 0.8});
        std::vector<LocalSurface> of_good;
        for (const size_t p : place) of_good.push_back(found[p]);
        expect_same_bits(of_good, expected);
        for (size_t i = 0; i < dirty.size(); i++)
            if (!dirty[i].allFinite())
            {
                EXPECT_EQ(found[i].count, 0u);
                EXPECT_EQ(found[i].normal, Eigen::Vector3f(0, 0, 0));
                EXPECT_EQ(found[i].shape({}), SurfaceShape::Unknown);
            }
    }
}

TEST(local_surfaces, layers_of_no_or_one_or_two_points_have_no_planes)
{
    EXPECT_TRUE(surfaces_of({}, {}).empty());
    const auto one = surfaces_of({{1, 2, 3}}, {});
    ASSERT_EQ(one.size(), 1u);
    EXPECT_EQ(one[0].count, 1u);
    EXPECT_EQ(one[0].shape({}), SurfaceShape::Unknown);
    const auto two = surfaces_of({{1, 2, 3}, {1, 2, 3.1f}}, {});
    EXPECT_EQ(two[0].count, 2u);
    EXPECT_EQ(two[0].shape({}), SurfaceShape::Unknown);
    EXPECT_EQ(surfaces_of({{NaN, 2, 3}}, {})[0].count, 0u);
}

TEST(local_surfaces, options_out_of_range_are_refused)
{
    for (const LocalSurfaceOptions bad :
         {LocalSurfaceOptions{0, 1.0}, LocalSurfaceOptions{5, 0.0}, LocalSurfaceOptions{5, -1.0},
          LocalSurfaceOptions{5, std::numeric_limits<double>::infinity()},
          LocalSurfaceOptions{5, double(NaN)}})
        EXPECT_THROW(surfaces_of({{0, 0, 0}}, bad), std::invalid_argument);
    const auto a = cloud_of({{0, 0, 0}}), b = cloud_of({{0, 0, 0}, {1, 0, 0}});
    EXPECT_THROW(compute_local_surfaces(*a, make_nn_index(b).get(), {}), std::invalid_argument);
}

// ---- Same bits --------------------------------------------------------------------------------------------

TEST(local_surfaces, have_the_same_bits_on_any_number_of_threads_and_by_either_index)
{
    const auto cloud = cloud_of(random_points(6000, 5, 7));
    const LocalSurfaceOptions options = {10, 1.0};
    const auto tree = make_kdtree_index(cloud, 0), grid = make_block_grid_index(cloud);
    ASSERT_TRUE(grid);
    LocalSurfaces::ConstPtr one;
    with_threads(1, [&]() { one = compute_local_surfaces(*cloud, tree.get(), options); });
    for (const int threads : {2, 8})
        with_threads(threads,
                     [&]()
                     {
                         expect_same_bits(compute_local_surfaces(*cloud, tree.get(), options)->of_point,
                                          one->of_point);
                         expect_same_bits(compute_local_surfaces(*cloud, grid.get(), options)->of_point,
                                          one->of_point);
                     });
}

TEST(local_surfaces, do_not_depend_on_where_on_the_lattice_of_floats_the_cloud_lies)
{
    // Coordinates that stay exact when they are moved by 1024 m.
    Points here, there;
    SeededRandom random(8);
    for (int i = 0; i < 300; i++)
    {
        Eigen::Vector3f p;
        for (int a = 0; a < 3; a++) p[a] = static_cast<float>(random.index(4096)) / 1024.0f;
        here.push_back(p);
        there.push_back(p + Eigen::Vector3f(1024, -1024, 1024));
    }
    expect_same_bits(surfaces_of(here, {10, 2.0}), surfaces_of(there, {10, 2.0}));
}

// ---- Beside the layer -------------------------------------------------------------------------------------

TEST(local_surfaces, are_computed_once_per_layer_and_options)
{
    metric_map_t map;
    map.layers["a"] = cloud_of(random_points(100, 1, 9));
    map.layers["b"] = cloud_of(random_points(50, 1, 10));
    const LocalSurfaceOptions ten = {10, 1.0}, five = {5, 1.0}, narrow = {10, 0.5};
    const auto a = map.local_surfaces("a", ten);
    EXPECT_EQ(a->of_point.size(), 100u);
    EXPECT_TRUE(a->options == ten);
    EXPECT_EQ(map.local_surfaces("b", ten)->of_point.size(), 50u);
    const auto of_five = map.local_surfaces("a", five), of_narrow = map.local_surfaces("a", narrow);
    EXPECT_NE(of_five, a);
    EXPECT_NE(of_narrow, a);
    EXPECT_EQ(map.local_surfaces("a", ten), a);
    EXPECT_EQ(map.local_surfaces("a", five), of_five);
    EXPECT_EQ(map.local_surfaces("a", narrow), of_narrow);
    EXPECT_THROW(map.local_surfaces("c", ten), std::invalid_argument);
    EXPECT_THROW(map.local_surfaces("a", {0, 1.0}), std::invalid_argument);
}

TEST(local_surfaces, are_made_again_when_the_layer_has_changed)
{
    metric_map_t map;
    const auto cloud = cloud_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0.5f}});
    map.layers["raw"] = cloud;
    const LocalSurfaceOptions options = {4, 5.0};
    const auto before = map.local_surfaces("raw", options);
    cloud->setPoint(3, 1, 1, 0);
    const auto after = map.local_surfaces("raw", options);
    EXPECT_NE(after, before);
    EXPECT_EQ(after->of_point[0].normal, Eigen::Vector3f(0, 0, 1));
    EXPECT_NE(before->of_point[0].normal, Eigen::Vector3f(0, 0, 1));
    cloud->insertPoint(0, 0, 1);
    EXPECT_EQ(map.local_surfaces("raw", options)->of_point.size(), 5u);
    map.layers["raw"] = cloud_of({{0, 0, 0}});
    EXPECT_EQ(map.local_surfaces("raw", options)->of_point.size(), 1u);
}

TEST(local_surfaces, only_the_latest_options_are_kept)
{
    metric_map_t map;
    map.layers["raw"] = cloud_of(random_points(20, 1, 11));
    const std::weak_ptr<const LocalSurfaces> first = map.local_surfaces("raw", {3, 1.0});
    for (uint32_t k = 4; k < 14; k++) map.local_surfaces("raw", {k, 1.0});
    EXPECT_TRUE(first.expired());
}

TEST(local_surfaces, may_be_asked_for_by_several_threads_at_once)
{
    for (uint64_t round = 0; round < 20; round++)
    {
        metric_map_t map;
        map.layers["raw"] = cloud_of(random_points(1500, 2, 100 + round));
        std::vector<LocalSurfaces::ConstPtr> found(4);
        std::vector<std::thread> threads;
        for (auto& f : found) threads.emplace_back([&]() { f = map.local_surfaces("raw", {8, 1.0}); });
        for (auto& t : threads) t.join();
        for (const auto& f : found)
        {
            EXPECT_EQ(f, found[0]) << "the first result stays";
            EXPECT_EQ(f->of_point.size(), 1500u);
        }
    }
}
