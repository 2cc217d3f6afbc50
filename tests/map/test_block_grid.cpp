// The block grid against slow, obvious answers: all distances compared, voxels in a std::map, sums in double.
#include <gtest/gtest.h>
#include <mp2p_icp/block_grid.h>
#include <mp2p_icp/random.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <thread>

#include "expect_problem.h"
#include "test_repetitions.h"
#include "with_threads.h"

using namespace mp2p_icp;
using mp2p_icp_test::repetitions;

namespace
{
constexpr float INF = std::numeric_limits<float>::infinity();
constexpr float NOT_A_NUMBER = std::numeric_limits<float>::quiet_NaN();

struct Point
{
    float x = 0, y = 0, z = 0;
};

void append(PointArrays& a, const Point& p)
{
    a.x.push_back(p.x), a.y.push_back(p.y), a.z.push_back(p.z);
}

Point point(const PointArrays& a, size_t i)
{
    return {a.x[i], a.y[i], a.z[i]};
}

bool is_finite(const Point& p)
{
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

/// In the order in which an index sums, so that results are equal to the bit.
float dist_sq(const Point& a, const Point& b)
{
    const float dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z;
    return dx * dx + dy * dy + dz * dz;
}

Point random_point(SeededRandom& random, double half, const Point& centre = {})
{
    Point p;
    p.x = static_cast<float>(double(centre.x) + random.uniform(-half, half));
    p.y = static_cast<float>(double(centre.y) + random.uniform(-half, half));
    p.z = static_cast<float>(double(centre.z) + random.uniform(-half, half));
    return p;
}

PointArrays random_cloud(size_t n, uint64_t seed, double half, const Point& centre = {})
{
    SeededRandom random(seed);
    PointArrays out;
    for (size_t i = 0; i < n; i++) append(out, random_point(random, half, centre));
    return out;
}

/// Whole numbers from 0 to `side` - 1 on each axis, times `step`, in random order, some of them twice.
PointArrays shuffled_lattice(int side, float step, uint64_t seed)
{
    SeededRandom random(seed);
    std::vector<Point> points;
    for (int x = 0; x < side; x++)
        for (int y = 0; y < side; y++)
            for (int z = 0; z < side; z++)
                for (size_t copy = 0; copy < 1 + random.index(2); copy++)
                    points.push_back({step * float(x), step * float(y), step * float(z)});
    for (size_t i = points.size() - 1; i > 0; i--) std::swap(points[i], points[random.index(i + 1)]);
    PointArrays out;
    for (const Point& p : points) append(out, p);
    return out;
}

BlockGridOptions options(double voxel_size, GridElements elements, bool moments = false)
{
    BlockGridOptions o;
    o.voxel_size = voxel_size, o.elements = elements, o.moments = moments;
    return o;
}

using Found = std::vector<std::pair<float, uint32_t>>;

Found brute_force(const PointArrays& elements, const Point& q, float max_dist_sq, size_t k)
{
    Found all;
    for (uint32_t i = 0; i < elements.size(); i++)
        if (const float d = dist_sq(q, point(elements, i)); d < max_dist_sq) all.emplace_back(d, i);
    k = std::min(k, all.size());
    std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(k), all.end());
    all.resize(k);
    return all;
}

Found ask(const BlockGrid& grid, const Point& q, float max_dist_sq, uint32_t k)
{
    std::vector<uint32_t> ids(k);
    std::vector<float> d(k);
    const uint32_t count = grid.nearest_k(q.x, q.y, q.z, max_dist_sq, k, ids.data(), d.data());
    Found out;
    for (uint32_t i = 0; i < count; i++) out.emplace_back(d[i], ids[i]);
    return out;
}

/// All three kinds of search, against comparing with all elements.
void expect_exact(const BlockGrid& grid, const PointArrays& elements, const Point& q, float max_dist_sq)
{
    SCOPED_TRACE(::testing::Message()
                 << "query " << q.x << " " << q.y << " " << q.z << ", max_dist_sq " << max_dist_sq);
    const Found truth = brute_force(elements, q, max_dist_sq, 5);
    EXPECT_EQ(ask(grid, q, max_dist_sq, 5), truth);
    const GridNeighbor one = grid.nearest(q.x, q.y, q.z, max_dist_sq);
    const BoundedNeighbor bounded = grid.nearest_and_bound(q.x, q.y, q.z, max_dist_sq);
    EXPECT_EQ(one.id, truth.empty() ? NO_NEIGHBOR : truth[0].second);
    EXPECT_EQ(one.dist_sq, truth.empty() ? INF : truth[0].first);
    EXPECT_EQ(bounded.id, one.id);
    EXPECT_EQ(bounded.dist_sq, one.dist_sq);
}

struct Voxel
{
    std::vector<uint32_t> points;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
};
using VoxelMap = std::map<std::array<double, 3>, Voxel>;

/// The definition: coordinates divided by the side, rounded down.
VoxelMap reference_voxels(const PointArrays& points, double side)
{
    VoxelMap voxels;
    for (uint32_t i = 0; i < points.size(); i++)
    {
        const Point p = point(points, i);
        if (!is_finite(p)) continue;
        Voxel& v = voxels[{std::floor(double(p.x) / side), std::floor(double(p.y) / side),
                           std::floor(double(p.z) / side)}];
        v.points.push_back(i);
        v.mean += Eigen::Vector3d(double(p.x), double(p.y), double(p.z));
    }
    for (auto& [cell, v] : voxels) v.mean /= static_cast<double>(v.points.size());
    return voxels;
}

/** Same voxels, same members, means to what float can hold and double sums can lose (coordinates of up to
 * 1e10 cells have a cell's 1e-6 left in double).
 */
void expect_voxels(const BlockGrid& grid, const PointArrays& points, double side)
{
    const VoxelMap truth = reference_voxels(points, side);
    ASSERT_EQ(grid.voxel_count(), truth.size());
    ASSERT_EQ(grid.voxel_of_point().size(), points.size());
    std::vector<bool> seen(truth.size(), false);
    for (const auto& [cell, voxel] : truth)
    {
        const uint32_t v = grid.voxel_of_point()[voxel.points[0]];
        ASSERT_LT(v, truth.size());
        EXPECT_FALSE(seen[v]) << "two voxels in one";
        seen[v] = true;
        EXPECT_EQ(grid.point_counts()[v], voxel.points.size());
        for (const uint32_t i : voxel.points) EXPECT_EQ(grid.voxel_of_point()[i], v) << "point " << i;
        if (grid.options().elements == GridElements::Points) continue;
        const Point mean = point(grid.means(), v);
        const float got[3] = {mean.x, mean.y, mean.z};
        for (int a = 0; a < 3; a++)
        {
            const double tolerance = std::abs(voxel.mean[a]) * 0x1p-24 * 1.01 + side * 1e-9;
            EXPECT_NEAR(double(got[a]), voxel.mean[a], tolerance) << "axis " << a << " of voxel " << v;
        }
    }
}

const float RADII_SQ[] = {1e-6f, 1e-2f, 0.3f, 4.0f, 1e3f, INF};
}  // namespace

TEST(BlockGrid, FindsTheNearestInCloudsOfAnySizeForAnyVoxelAndRadius)
{
    for (const size_t n : {0u, 1u, 2u, 10u, 1000u, 100000u})
        for (const double voxel : {2e-3, 2e-2, 0.1, 0.7, 3.0, 2000.0})
        {
            if (n == 100000 && voxel != 0.1 && voxel != 2e-3 && !repetitions(0, 1)) continue;
            SCOPED_TRACE(::testing::Message() << n << " points, voxels of " << voxel);
            const PointArrays cloud = random_cloud(n, 10 + n, 1);
            const BlockGrid points(cloud, options(voxel, GridElements::Points));
            const BlockGrid means(cloud, options(voxel, GridElements::VoxelMeans));
            EXPECT_EQ(points.size(), n);
            SeededRandom random(n + 1);
            for (size_t k = 0; k < repetitions(n > 1000 ? 2 : 6, 30); k++)
                for (const float radius_sq : RADII_SQ)
                {
                    const Point q = random_point(random, k % 2 ? 1.1 : 5);
                    expect_exact(points, cloud, q, radius_sq);
                    expect_exact(means, means.means(), q, radius_sq);
                }
        }
}

TEST(BlockGrid, FindsTheNearestInUnevenCloudsThatAreFarFromTheOrigin)
{
    // Dense and sparse parts, and holes of many blocks: rings of neighbours do not do.
    for (const Point& centre :
         {Point{0, 0, 0}, Point{-3e3f, 5e2f, 70}, Point{1e6f, -1e6f, 1e5f}, Point{-1e7f, 1e7f, -1e7f}})
        for (const double voxel : {0.01, 0.25, 1.3})
        {
            SCOPED_TRACE(::testing::Message() << "centre " << centre.x << ", voxels of " << voxel);
            PointArrays cloud = random_cloud(600, 3, 1, centre);
            const PointArrays wide = random_cloud(200, 4, 60, centre);
            for (size_t i = 0; i < wide.size(); i++) append(cloud, point(wide, i));
            const BlockGrid points(cloud, options(voxel, GridElements::Points));
            const BlockGrid means(cloud, options(voxel, GridElements::VoxelMeans));
            SeededRandom random(5);
            for (size_t k = 0; k < repetitions(20, 200); k++)
                for (const float radius_sq : {0.01f, 2.0f, 500.0f, INF})
                {
                    const Point q = random_point(random, k % 3 ? 3 : 100, centre);
                    expect_exact(points, cloud, q, radius_sq);
                    expect_exact(means, means.means(), q, radius_sq);
                }
        }
}

TEST(BlockGrid, FindsTheNearestOfPointsThatNoVoxelCanNumber)
{
    PointArrays cloud = random_cloud(300, 6, 10);
    for (const float far : {1e5f, -3e7f, 2e12f, -1e18f, 3e38f})
        append(cloud, {far, far / 3, 1}), append(cloud, {1, far, 0});
    for (const double voxel : {1e-6, 1.0, 1e20})
    {
        const BlockGrid grid(cloud, options(voxel, GridElements::Points));
        for (const float at : {0.0f, 3.0f, 9e4f, -1e7f, 1e12f, 3e37f})
            for (const float radius_sq : {0.1f, 1e10f, 1e30f, INF})
            {
                expect_exact(grid, cloud, {at, at / 2, 1}, radius_sq);
                expect_exact(grid, cloud, {1, -at, -at}, radius_sq);
            }
    }
    mp2p_icp_test::expect_problem_with<std::invalid_argument>(
        {"point 304", "too far"}, [&]() { BlockGrid(cloud, options(1.0, GridElements::VoxelMeans)); });
    mp2p_icp_test::expect_problem_with<std::invalid_argument>(
        {"too far"}, [&]() { BlockGrid(cloud, options(1.0, GridElements::Points, true)); });
}

TEST(BlockGrid, MeansOfCoarseCoordinatesAreFound)
{
    // x comes in multiples of 1/8 m here, and voxels are a little larger: half of the means are rounded by
    // much.
    for (const double voxel : {0.13, 0.16, 0.2})
    {
        const Point centre{1.5e6f, 0, 0};
        const PointArrays cloud = random_cloud(3000, 37, 0.8, centre);
        const BlockGrid grid(cloud, options(voxel, GridElements::VoxelMeans));
        SeededRandom random(38);
        for (size_t k = 0; k < repetitions(2000, 20000); k++)
            expect_exact(grid, grid.means(), random_point(random, 1, centre), k % 2 ? INF : 0.01f);
    }
}

TEST(BlockGrid, AFewPointsFarAwayDoNotPutAllOthersIntoOneBlock)
{
    PointArrays cloud;
    append(cloud, {3e38f, -1e30f, 1e20f});
    const PointArrays others = random_cloud(1000, 36, 10);
    for (size_t i = 0; i < others.size(); i++) append(cloud, point(others, i));
    const BlockGrid grid(cloud, options(0.5, GridElements::Points));
    EXPECT_GT(grid.block_count(), 500u);
    expect_exact(grid, cloud, {1, 2, 3}, INF);
}

TEST(BlockGrid, FindsTheNearestWhereSquaresUnderflow)
{
    const PointArrays cloud = random_cloud(400, 7, 1e-20);
    for (const double voxel : {1e-22, 3e-21, 1e-19})
    {
        const BlockGrid grid(cloud, options(voxel, GridElements::Points));
        SeededRandom random(8);
        for (int k = 0; k < 40; k++) expect_exact(grid, cloud, random_point(random, 2e-20), INF);
    }
}

TEST(BlockGrid, TiesGoToTheLowestIndex)
{
    for (const double voxel : {0.4, 0.5, 1.0, 4.0})
    {
        SCOPED_TRACE(::testing::Message() << "voxels of " << voxel);
        const PointArrays cloud = shuffled_lattice(9, 1, 9);
        const BlockGrid points(cloud, options(voxel, GridElements::Points));
        const BlockGrid means(cloud, options(voxel, GridElements::VoxelMeans));
        for (float x = -1; x < 10; x += 1.5f)
            for (float y = 0; y < 9; y += 1.5f)
                for (const float radius_sq : {0.75f, 0.75001f, 1.0f, INF})  // 0.75: exactly out of reach
                {
                    expect_exact(points, cloud, {x, y, 3.5f}, radius_sq);
                    expect_exact(means, means.means(), {x, y, 3.5f}, radius_sq);
                }
    }
}

TEST(BlockGrid, EqualPointsAreFoundByIndex)
{
    PointArrays cloud;
    for (int i = 0; i < 1000; i++) append(cloud, {1, 2, 3});
    const BlockGrid grid(cloud, options(0.1, GridElements::Points));
    EXPECT_EQ(ask(grid, {1, 2, 4}, INF, 3), (Found{{1.0f, 0}, {1.0f, 1}, {1.0f, 2}}));
    const auto bounded = grid.nearest_and_bound(1, 2, 4, INF);
    EXPECT_EQ(bounded.id, 0u);
    EXPECT_LE(bounded.others, 1.0f);
    EXPECT_FALSE(bounded.is_still_nearest(0, 1));
}

TEST(BlockGrid, SpaceThatHoldsNothingIsCrossedSoon)
{
    // 10^5 searches over 10^4 blocks each: if they visited all blocks, these would be 10^9 visits.
    const PointArrays cloud = random_cloud(100000, 12, 1);
    const BlockGrid grid(cloud, options(0.02, GridElements::Points));
    ASSERT_GT(grid.block_count(), 10000u);
    SeededRandom random(13);
    size_t found = 0;
    for (size_t k = 0; k < repetitions(20000, 100000); k++)
    {
        const Point q = random_point(random, 1, {1e3f, -1e3f, 500});
        found += grid.nearest(q.x, q.y, q.z, INF).id != NO_NEIGHBOR;
    }
    EXPECT_EQ(found, repetitions(20000, 100000));
    expect_exact(grid, cloud, {1e3f, -1e3f, 500}, INF);
}

TEST(BlockGrid, ManyNeighboursAreFoundInOrder)
{
    const PointArrays cloud = random_cloud(500, 14, 1);
    SeededRandom random(15);
    for (const double voxel : {0.03, 0.3})
        for (const uint32_t k : {1u, 2u, 20u, 600u})
        {
            const BlockGrid grid(cloud, options(voxel, GridElements::Points));
            for (int i = 0; i < 20; i++)
            {
                const Point q = random_point(random, 1.5);
                for (const float radius_sq : {0.1f, INF})
                    EXPECT_EQ(ask(grid, q, radius_sq, k), brute_force(cloud, q, radius_sq, k));
            }
        }
    const BlockGrid grid(cloud, options(0.1, GridElements::Points));
    EXPECT_EQ(grid.nearest_k(0, 0, 0, INF, 0, nullptr, nullptr), 0u);
}

TEST(BlockGrid, ABoundHoldsForAllOthers)
{
    const PointArrays cloud = random_cloud(800, 16, 1);
    SeededRandom random(17);
    for (const double voxel : {0.02, 0.1, 0.5})
    {
        const BlockGrid grid(cloud, options(voxel, GridElements::Points));
        size_t tight = 0;
        for (size_t i = 0; i < repetitions(500, 20000); i++)
        {
            const Point q = random_point(random, 1.3);
            const float radius_sq = i % 2 ? INF : 0.01f;
            const auto n = grid.nearest_and_bound(q.x, q.y, q.z, radius_sq);
            double others = INF;
            for (uint32_t k = 0; k < cloud.size(); k++)
                if (k != n.id)
                    others = std::min(others, std::sqrt(std::pow(double(q.x) - double(cloud.x[k]), 2) +
                                                        std::pow(double(q.y) - double(cloud.y[k]), 2) +
                                                        std::pow(double(q.z) - double(cloud.z[k]), 2)));
            EXPECT_LE(double(n.others), others);
            // What is pruned is not nearer than the best one, or than the largest distance allowed.
            const double pruned_from = std::sqrt(double(std::min(n.dist_sq, radius_sq)));
            EXPECT_GE(double(n.others), std::min(others, pruned_from) * (1 - 1e-5) - 1e-5 * voxel);
            tight += double(n.others) > others * (1 - 1e-5);
        }
        EXPECT_GT(tight, 20u) << "often it is the second";
    }
}

TEST(BlockGrid, AMovedQueryKeepsItsNeighbourWhileTheBoundSaysSo)
{
    const PointArrays cloud = random_cloud(2000, 18, 1);
    SeededRandom random(19);
    const float radius = 0.12f;
    for (const double voxel : {0.02, 0.05, 0.3})
    {
        const BlockGrid grid(cloud, options(voxel, GridElements::Points));
        size_t kept = 0, alone = 0;
        for (size_t i = 0; i < repetitions(3000, 100000); i++)
        {
            const Point q = random_point(random, 1.1);
            const auto n = grid.nearest_and_bound(q.x, q.y, q.z, radius * radius);
            const Point moved = random_point(random, random.uniform() * random.uniform() * 0.05, q);
            const float distance = std::sqrt(dist_sq(q, moved));
            const auto now =
                grid.nearest(moved.x, moved.y, moved.z, n.id == NO_NEIGHBOR ? radius * radius : INF);
            if (n.is_still_alone(distance, radius))
            {
                EXPECT_EQ(now.id, NO_NEIGHBOR);
                alone++;
            }
            if (n.id == NO_NEIGHBOR) continue;
            if (const float d = dist_sq(moved, point(cloud, n.id)); n.is_still_nearest(distance, d))
            {
                EXPECT_EQ(now.id, n.id);
                EXPECT_EQ(now.dist_sq, d);
                kept++;
            }
        }
        EXPECT_GT(kept, repetitions(3000, 100000) / 10);
        EXPECT_GT(alone, 20u);
    }
}

TEST(BlockGrid, VoxelsAndMeansAreThoseOfTheDefinition)
{
    for (const Point& centre :
         {Point{0, 0, 0}, Point{-31, 800, -5}, Point{1e6f, -3e5f, 77}, Point{-1e7f, 1e7f, 1e7f}})
        for (const double side : {0.017, 0.25, 0.3, 5.0, 1e3})
            for (const bool moments : {false, true})
            {
                SCOPED_TRACE(::testing::Message() << "centre " << centre.x << ", voxels of " << side);
                const PointArrays cloud = random_cloud(1500, 20, 3, centre);
                const BlockGrid grid(cloud, options(side, GridElements::VoxelMeans, moments));
                expect_voxels(grid, cloud, side);
                EXPECT_EQ(grid.size(), grid.means().size());
            }
}

TEST(BlockGrid, PointsOnVoxelFacesBelongToTheVoxelAbove)
{
    for (const double side : {0.1, 0.25, 0.3, 0.7, 1.0 / 3, 1e-3, 7.0})
    {
        PointArrays cloud;
        for (int k = -300; k <= 300; k++)
        {
            const auto face = static_cast<float>(k * side);
            for (const float x :
                 {face, std::nextafter(face, -INF), std::nextafter(face, INF), float(k), 0.1f * float(k)})
                append(cloud, {x, -x, static_cast<float>(k % 5)});
        }
        for (const float x : {0.0f, -0.0f, 1e-38f, -1e-38f, 1e-45f, -1e-45f, -1e-20f})
            append(cloud, {x, x, x});
        SCOPED_TRACE(::testing::Message() << "voxels of " << side);
        expect_voxels(BlockGrid(cloud, options(side, GridElements::VoxelMeans)), cloud, side);
        expect_voxels(BlockGrid(cloud, options(side, GridElements::Points, true)), cloud, side);
    }
}

TEST(BlockGrid, NumbersJustBelowZeroBelongToTheVoxelBelowZero)
{
    PointArrays cloud;
    for (int i = 0; i < 1024; i++) append(cloud, {-1e-45f * float(i % 7), 1e-45f * float(i % 5), -1e-30f});
    for (const double side : {0.125, 0.3, 8.0, 70.0, 1e30})
        expect_voxels(BlockGrid(cloud, options(side, GridElements::VoxelMeans)), cloud, side);
}

TEST(BlockGrid, AMillionPointsInOneVoxelHaveAnExactMean)
{
    // Sums in float would be off by 1e-4 and more.
    PointArrays cloud;
    SeededRandom random(21);
    double sum = 0;
    for (size_t i = 0; i < 1000000; i++)
    {
        const auto x = static_cast<float>(random.uniform(8, 9.99));
        sum += double(x);
        append(cloud, {x, 1, 1});
    }
    const BlockGrid grid(cloud, options(10, GridElements::VoxelMeans, true));
    ASSERT_EQ(grid.voxel_count(), 1u);
    EXPECT_EQ(grid.point_counts()[0], 1000000u);
    EXPECT_NEAR(double(grid.means().x[0]), sum / 1e6, 1e-6);
}

TEST(BlockGrid, NearVoxelsAreNearInMemory)
{
    const PointArrays cloud = random_cloud(20000, 22, 1);
    const BlockGrid grid(cloud, options(0.05, GridElements::VoxelMeans));
    double steps = 0;
    for (size_t v = 1; v < grid.size(); v++)
        steps += double(std::sqrt(dist_sq(point(grid.means(), v - 1), point(grid.means(), v))));
    EXPECT_LT(steps / double(grid.size()), 0.12) << "about a block's side; random order: 1.3";
}

namespace
{
struct Surface
{
    size_t count = 0;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// Of the points in the 3x3x3 voxels around one, in two passes.
Surface reference_surface(const VoxelMap& voxels, const std::array<double, 3>& cell,
                          const PointArrays& points)
{
    std::vector<Eigen::Vector3d> members;
    for (double dx = -1; dx <= 1; dx++)
        for (double dy = -1; dy <= 1; dy++)
            for (double dz = -1; dz <= 1; dz++)
                if (const auto v = voxels.find({cell[0] + dx, cell[1] + dy, cell[2] + dz}); v != voxels.end())
                    for (const uint32_t i : v->second.points)
                        members.emplace_back(double(points.x[i]), double(points.y[i]), double(points.z[i]));
    Surface s;
    s.count = members.size();
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const auto& m : members) mean += m;
    mean /= double(s.count);
    for (const auto& m : members) s.covariance += (m - mean) * (m - mean).transpose();
    s.covariance /= double(s.count);
    return s;
}

/// \return whether it has a normal
bool expect_surface(const VoxelSurface& got, const Surface& truth, double side, double min_spread)
{
    EXPECT_EQ(got.count, truth.count);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(truth.covariance);
    const Eigen::Vector3d values = solver.eigenvalues();
    const double trace = std::max(values.sum(), 0.0);
    // Double roots leave half of the digits; squared coordinates of up to 6 cells cancel to rounding.
    const double tolerance = 1e-6 * trace + 1e-12 * side * side;
    for (int k = 0; k < 3; k++)
        EXPECT_NEAR(double(got.eigenvalues[k]), values[k],
                    tolerance + (k < 2 ? 0.01 * (values[1] - values[0]) : 0.0));
    const double spread = min_spread * side * side;
    if (truth.count < 3 || values[1] < 0.99 * spread)
    {
        EXPECT_FALSE(got.has_normal());
    }
    if (truth.count >= 3 && values[1] > 1.01 * spread && values[1] - values[0] > 0.05 * trace)
    {
        const Eigen::Vector3d n(double(got.nx), double(got.ny), double(got.nz));
        EXPECT_NEAR(n.norm(), 1, 1e-6);
        EXPECT_GT(n[0] + n[1] + n[2] + 3 * n.cwiseAbs().maxCoeff(), 0);
        EXPECT_EQ(n.maxCoeff(), n.cwiseAbs().maxCoeff()) << "the largest component is positive";
        EXPECT_LT(n.cross(solver.eigenvectors().col(0)).norm(), 1e-5);
    }
    if (trace > 0)
    {
        EXPECT_NEAR(double(got.curvature()), values[0] / trace,
                    1e-5 + 0.01 * (values[1] - values[0]) / trace);
    }
    return got.has_normal();
}

/// Thin, tilted and bent: planes, edges and corners.
PointArrays wavy_cloud(size_t n, uint64_t seed, const Point& centre)
{
    SeededRandom random(seed);
    PointArrays out;
    for (size_t i = 0; i < n; i++)
    {
        const double x = random.uniform(-5, 5), y = random.uniform(-5, 5);
        const double z = i % 3 == 0 ? 0.3 * x : i % 3 == 1 ? std::sin(x) * y : std::round(y);
        append(out, {float(double(centre.x) + x), float(double(centre.y) + y),
                     float(double(centre.z) + z + random.gaussian(0.01))});
    }
    return out;
}
}  // namespace

namespace
{
void expect_same_surface(const VoxelSurface& a, const VoxelSurface& b)
{
    const auto numbers = [](const VoxelSurface& s)
    {
        return std::vector<float>{s.nx,
                                  s.ny,
                                  s.nz,
                                  s.dx,
                                  s.dy,
                                  s.dz,
                                  s.mean_x,
                                  s.mean_y,
                                  s.mean_z,
                                  s.eigenvalues[0],
                                  s.eigenvalues[1],
                                  s.eigenvalues[2]};
    };
    EXPECT_EQ(numbers(a), numbers(b));
    EXPECT_EQ(a.count, b.count);
    EXPECT_EQ(a.voxels, b.voxels);
}
}  // namespace

TEST(BlockGrid, SurfacesAreThoseOfAllPointsInThe27Voxels)
{
    for (const Point& centre : {Point{0, 0, 0}, Point{-2e3f, 1e3f, -50}})
        for (const double side : {0.05, 0.4, 3.0, 100.0})
            for (const auto elements : {GridElements::VoxelMeans, GridElements::Points, GridElements::None})
            {
                SCOPED_TRACE(::testing::Message() << "centre " << centre.x << ", voxels of " << side);
                const PointArrays cloud = wavy_cloud(1500, 23, centre);
                const BlockGrid grid(cloud, options(side, elements, true));
                const VoxelMap voxels = reference_voxels(cloud, side);
                std::vector<VoxelSurface> surfaces;
                grid.surfaces(surfaces, 1e-3);
                ASSERT_EQ(surfaces.size(), voxels.size());
                size_t with_normal = 0;
                for (const auto& [cell, voxel] : voxels)
                    with_normal += expect_surface(surfaces[grid.voxel_of_point()[voxel.points[0]]],
                                                  reference_surface(voxels, cell, cloud), side, 1e-3);
                if (side < 0.1)
                {
                    EXPECT_LT(with_normal, voxels.size() / 2);
                }
                else if (side < 1)
                {
                    EXPECT_GT(with_normal, voxels.size() / 2);
                }
            }
}

TEST(BlockGrid, VoxelSurfacesAreItsSurfacesOfTheVoxelOfEachPoint)
{
    PointArrays cloud = wavy_cloud(1500, 29, {5, -3, 1});
    append(cloud, {std::numeric_limits<float>::quiet_NaN(), 0, 0});
    const BlockGrid grid(cloud, options(0.4, GridElements::VoxelMeans, true));
    std::vector<VoxelSurface> surfaces;
    grid.surfaces(surfaces);
    const SurfacesOfVoxels both = voxel_surfaces(cloud, 0.4);
    EXPECT_EQ(both.voxel_of_point, grid.voxel_of_point());
    EXPECT_EQ(both.voxel_of_point.back(), NO_NEIGHBOR);
    ASSERT_EQ(both.of_voxel.size(), surfaces.size());
    for (size_t v = 0; v < surfaces.size(); v++) expect_same_surface(both.of_voxel[v], surfaces[v]);
    EXPECT_THROW(voxel_surfaces(cloud, 0), std::invalid_argument);
}

TEST(BlockGrid, APlaneHasItsNormalAndALineOrTwoPointsHaveNone)
{
    const auto surfaces_of = [](const PointArrays& cloud, double min_spread = 1e-4)
    {
        std::vector<VoxelSurface> surfaces;
        BlockGrid(cloud, options(1, GridElements::VoxelMeans, true)).surfaces(surfaces, min_spread);
        return surfaces;
    };
    SeededRandom random(24);
    PointArrays plane, line, two;
    const Eigen::Vector3d normal = Eigen::Vector3d(1, 2, -4).normalized();
    for (int i = 0; i < 3000; i++)
    {
        const double x = random.uniform(-5, 5), y = random.uniform(-5, 5);
        append(plane, {float(x), float(y), float((x + 2 * y) / 4)});
        append(line, {float(x), float(2 * x), float(-x)});
    }
    for (const VoxelSurface& s : surfaces_of(plane))
    {
        if (s.count < 20) continue;
        ASSERT_TRUE(s.has_normal());
        EXPECT_LT((Eigen::Vector3d(double(s.nx), double(s.ny), double(s.nz)) + normal).norm(), 1e-5);
        EXPECT_LT(s.curvature(), 1e-9f);
    }
    for (const VoxelSurface& s : surfaces_of(line)) EXPECT_FALSE(s.has_normal());
    append(two, {0.1f, 0.2f, 0.3f}), append(two, {0.9f, 0.4f, -0.3f});
    for (const double min_spread : {1e-4, 0.0})
        for (const VoxelSurface& s : surfaces_of(two, min_spread)) EXPECT_FALSE(s.has_normal());
    EXPECT_THROW(
        {
            std::vector<VoxelSurface> out;
            BlockGrid(two, options(1, GridElements::VoxelMeans)).surfaces(out);
        },
        std::invalid_argument);
}

TEST(BlockGrid, WithoutElementsItHasItsVoxelsAndFindsNothing)
{
    const PointArrays cloud = wavy_cloud(1500, 27, {1, 2, 3});
    const BlockGrid grid(cloud, options(0.4, GridElements::None));
    expect_voxels(grid, cloud, 0.4);
    EXPECT_EQ(grid.size(), 0u);
    EXPECT_FALSE(grid.bounding_box());
    EXPECT_EQ(grid.mean_companions(), 0);
    for (size_t i = 0; i < 1500; i += 100)
    {
        EXPECT_EQ(grid.nearest(cloud.x[i], cloud.y[i], cloud.z[i], INF).id, NO_NEIGHBOR);
        EXPECT_TRUE(ask(grid, {cloud.x[i], cloud.y[i], cloud.z[i]}, INF, 3).empty());
    }
}

TEST(BlockGrid, PointsThatAreNotFiniteAreCountedAndLeftOut)
{
    for (const auto elements : {GridElements::VoxelMeans, GridElements::Points})
    {
        PointArrays cloud = random_cloud(500, 25, 10);
        const float bad[] = {NOT_A_NUMBER, INF, -INF};
        for (size_t i = 0; i < 500; i += 3)  // the very first one too
            (i % 2 ? cloud.x : i % 5 ? cloud.y : cloud.z)[i] = bad[i / 3 % 3];
        const BlockGrid grid(cloud, options(2, elements, true));
        EXPECT_EQ(grid.skipped_points(), 167u);
        expect_voxels(grid, cloud, 2);
        EXPECT_EQ(grid.voxel_of_point()[0], NO_NEIGHBOR);
        const PointArrays& searched = elements == GridElements::Points ? cloud : grid.means();
        SeededRandom random(26);
        for (int k = 0; k < 50; k++)
            expect_exact(grid, searched, random_point(random, 12), k % 2 ? 5.0f : INF);
        for (const float v : bad)
        {
            EXPECT_EQ(grid.nearest(v, 0, 0, INF).id, NO_NEIGHBOR);
            EXPECT_EQ(grid.nearest_and_bound(0, v, 0, INF).id, NO_NEIGHBOR);
            EXPECT_TRUE(ask(grid, {0, 0, v}, INF, 3).empty());
        }
        for (const float radius_sq : {0.0f, -1.0f, NOT_A_NUMBER})
            EXPECT_EQ(grid.nearest(0, 0, 0, radius_sq).id, NO_NEIGHBOR);
    }
    PointArrays none;
    append(none, {NOT_A_NUMBER, 0, 0});
    const BlockGrid grid(none, options(1, GridElements::Points));
    EXPECT_EQ(grid.skipped_points(), 1u);
    EXPECT_FALSE(grid.bounding_box());
    EXPECT_EQ(grid.nearest(0, 0, 0, INF).id, NO_NEIGHBOR);
}

TEST(BlockGrid, AnEmptyGridAnswers)
{
    const BlockGrid grids[2] = {BlockGrid(),
                                BlockGrid(PointArrays(), options(1, GridElements::VoxelMeans, true))};
    for (const BlockGrid& grid : grids)
    {
        EXPECT_EQ(grid.size() + grid.voxel_count() + grid.block_count() + grid.skipped_points(), 0u);
        EXPECT_FALSE(grid.bounding_box());
        EXPECT_EQ(grid.nearest(0, 0, 0, INF).id, NO_NEIGHBOR);
        EXPECT_TRUE(ask(grid, {}, INF, 2).empty());
    }
    std::vector<VoxelSurface> surfaces(3);
    grids[1].surfaces(surfaces);
    EXPECT_TRUE(surfaces.empty());
}

TEST(BlockGrid, ASideThatIsNotPositiveAndFiniteIsRefused)
{
    for (const double side : {0.0, -1.0, double(INF), double(NOT_A_NUMBER), 1e-310})
        mp2p_icp_test::expect_problem_with<std::invalid_argument>(
            {"voxel_size"},
            [&]() { BlockGrid(random_cloud(3, 27, 1), options(side, GridElements::Points)); });
}

TEST(BlockGrid, TheBoxIsThatOfTheElements)
{
    const PointArrays cloud = random_cloud(300, 28, 5);
    const auto box = BlockGrid(cloud, options(0.2, GridElements::Points)).bounding_box();
    ASSERT_TRUE(box);
    EXPECT_EQ(box->min.x, *std::min_element(cloud.x.begin(), cloud.x.end()));
    EXPECT_EQ(box->max.z, *std::max_element(cloud.z.begin(), cloud.z.end()));
}

namespace
{
/// Everything a grid says, as numbers.
std::vector<float> contents(const BlockGrid& grid, const PointArrays& queries)
{
    std::vector<float> out = grid.means().x;
    for (const uint32_t v : grid.voxel_of_point()) out.push_back(float(v));
    std::vector<VoxelSurface> surfaces;
    grid.surfaces(surfaces);
    for (const auto& s : surfaces)
        for (const float v :
             {s.nx, s.ny, s.nz, s.eigenvalues[0], s.eigenvalues[1], s.eigenvalues[2], float(s.count)})
            out.push_back(v);
    for (size_t q = 0; q < queries.size(); q++)
    {
        const auto n = grid.nearest_and_bound(queries.x[q], queries.y[q], queries.z[q], 1);
        out.insert(out.end(), {float(n.id), n.dist_sq, n.others});
    }
    return out;
}
}  // namespace

TEST(BlockGrid, AnyNumberOfThreadsGivesTheSameBits)
{
    const PointArrays cloud = wavy_cloud(20000, 29, {}), queries = random_cloud(300, 30, 5);
    std::vector<std::vector<float>> all;
    for (const int threads : {1, 2, 8})
        mp2p_icp_test::with_threads(
            threads,
            [&]() {
                all.push_back(
                    contents(BlockGrid(cloud, options(0.1, GridElements::VoxelMeans, true)), queries));
            });
    EXPECT_GT(all[0].size(), 50000u);
    EXPECT_EQ(all[0], all[1]);
    EXPECT_EQ(all[0], all[2]);
}

TEST(BlockGrid, ThreadsMayAskAtOnce)
{
    const PointArrays cloud = wavy_cloud(3000, 31, {}), queries = random_cloud(500, 32, 8);
    const BlockGrid grid(cloud, options(0.1, GridElements::VoxelMeans, true));
    const auto alone = contents(grid, queries);
    std::vector<std::vector<float>> got(4);
    std::vector<std::thread> threads;
    for (auto& g : got) threads.emplace_back([&]() { g = contents(grid, queries); });
    for (auto& t : threads) t.join();
    for (const auto& g : got) EXPECT_EQ(g, alone);
}

TEST(BlockGrid, RebuiltIsAsBuilt)
{
    const PointArrays queries = random_cloud(100, 33, 5);
    BlockGrid reused;
    for (const size_t n : {5000u, 0u, 17u, 9000u, 300u})
        for (const double side : {0.05, 1.0})
        {
            const PointArrays cloud = wavy_cloud(n, n, {});
            const BlockGridOptions o = options(side, GridElements::VoxelMeans, true);
            reused.rebuild(cloud, options(2 * side, GridElements::Points));
            EXPECT_EQ(reused.means().size() + reused.voxel_count(), 0u);
            reused.rebuild(cloud, o);
            EXPECT_EQ(contents(reused, queries), contents(BlockGrid(cloud, o), queries));
        }
    EXPECT_THROW(reused.rebuild(queries, options(0, GridElements::Points)), std::invalid_argument);
    EXPECT_EQ(reused.size(), 0u);
    EXPECT_EQ(reused.nearest(0, 0, 0, INF).id, NO_NEIGHBOR);
}

TEST(BlockGrid, TenMillionPoints)
{
    const size_t n = repetitions(200000, 10000000);
    const PointArrays cloud = random_cloud(n, 34, 50);
    for (const double side : {0.02, 0.5, 2.0})  // the smallest: nearly every point in a block of its own
    {
        const BlockGrid points(cloud, options(side, GridElements::Points));
        const BlockGrid means(cloud, options(side, GridElements::VoxelMeans));
        uint64_t counted = 0;
        for (const uint32_t c : means.point_counts()) counted += c;
        EXPECT_EQ(counted, n);
        SeededRandom random(35);
        for (int k = 0; k < 3; k++)
        {
            const Point q = random_point(random, 55);
            expect_exact(points, cloud, q, INF);
            expect_exact(means, means.means(), q, INF);
        }
    }
}
