#include <gtest/gtest.h>
#include <mp2p_icp/nn_index.h>
#include <mp2p_icp/random.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <algorithm>
#include <cmath>
#include <thread>

using namespace mp2p_icp;
using mrpt::maps::CSimplePointsMap;

namespace
{
const float INF = std::numeric_limits<float>::infinity();

struct Found
{
    std::vector<uint32_t> ids;
    std::vector<float> dist_sq;
    bool operator==(const Found& o) const { return ids == o.ids && dist_sq == o.dist_sq; }
};

Found ask(const NearestNeighborIndex& index, const PointArrays& queries, uint32_t k,
          const std::vector<float>& max_dist_sq)
{
    Found f;
    f.ids.assign(queries.size() * k, 12345);
    f.dist_sq.assign(queries.size() * k, -1.0f);
    index.nearest(queries, 0, queries.size(), k, max_dist_sq.data(), f.ids.data(), f.dist_sq.data());
    return f;
}

/// The slow, obvious answer: all distances, sorted, ties by index.
Found brute_force(const CSimplePointsMap& points, const PointArrays& queries, uint32_t k,
                  const std::vector<float>& max_dist_sq)
{
    Found f;
    for (size_t q = 0; q < queries.size(); q++)
    {
        std::vector<std::pair<float, uint32_t>> all;
        for (uint32_t i = 0; i < points.size(); i++)
        {
            float x = 0, y = 0, z = 0;
            points.getPointFast(i, x, y, z);
            float d = 0;  // in the order in which the index sums, so that results are equal to the bit
            for (const float e : {queries.x[q] - x, queries.y[q] - y, queries.z[q] - z}) d += e * e;
            if (d < max_dist_sq[q]) all.emplace_back(d, i);
        }
        std::sort(all.begin(), all.end());
        for (uint32_t j = 0; j < k; j++)
        {
            f.ids.push_back(j < all.size() ? all[j].second : NO_NEIGHBOR);
            f.dist_sq.push_back(j < all.size() ? all[j].first : INF);
        }
    }
    return f;
}

CSimplePointsMap::Ptr random_cloud(size_t n, uint64_t seed, double size)
{
    SeededRandom random(seed);
    const auto cloud = CSimplePointsMap::Create();
    for (size_t i = 0; i < n; i++)
    {
        const double x = random.uniform(-size, size), y = random.uniform(-size, size),
                     z = random.uniform(-size, size);
        cloud->insertPoint(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    }
    return cloud;
}

PointArrays random_queries(size_t n, uint64_t seed, double size)
{
    PointArrays q;
    q.resize(n);
    SeededRandom random(seed);
    for (size_t i = 0; i < n; i++)
        for (auto* coordinate : {&q.x, &q.y, &q.z})
            (*coordinate)[i] = static_cast<float>(random.uniform(-size, size));
    return q;
}
enum class IndexKind
{
    KdTree,
    Faster  ///< of tree and block grid
};

class NnIndex : public ::testing::TestWithParam<IndexKind>
{
 protected:
    static NearestNeighborIndex::ConstPtr make(const CSimplePointsMap::ConstPtr& points, uint32_t leaf = 0)
    {
        return GetParam() == IndexKind::KdTree ? make_kdtree_index(points, leaf)
                                               : make_nn_index(points, leaf);
    }
};
}  // namespace

INSTANTIATE_TEST_SUITE_P(Kinds, NnIndex, ::testing::Values(IndexKind::KdTree, IndexKind::Faster),
                         [](const auto& kind) {
                             return kind.param == IndexKind::KdTree ? std::string("KdTree")
                                                                    : std::string("Faster");
                         });

TEST_P(NnIndex, AgreesWithBruteForceForAnyKRadiusAndLeafSize)
{
    const auto cloud = random_cloud(1500, 1, 10);
    const auto queries = random_queries(150, 2, 12);
    for (const uint32_t leaf : {0u, 1u, 7u, 2000u})
    {
        const auto index = make(cloud, leaf);
        EXPECT_EQ(index->size(), 1500u);
        for (const uint32_t k : {1u, 2u, 5u, 40u})
            for (const float limit : {0.01f, 1.0f, 9.0f, INF})
            {
                const std::vector<float> limits(queries.size(), limit);
                EXPECT_EQ(ask(*index, queries, k, limits), brute_force(*cloud, queries, k, limits))
                    << leaf << " " << k << " " << limit;
            }
    }
}

TEST_P(NnIndex, BoundsOfTheOthersHoldAndTheNearestIsThatOfNearest)
{
    for (const uint64_t seed : {5u, 6u})
    {
        const auto cloud = random_cloud(300, seed, 1.0);
        const auto index = make(cloud);
        const PointArrays queries = random_queries(200, seed + 100, 1.3);
        for (const float max_dist_sq : {0.01f, 0.2f, INF})
        {
            const std::vector<float> limits(queries.size(), max_dist_sq);
            Found one;
            std::vector<float> others(queries.size(), -1);
            one.ids.resize(queries.size()), one.dist_sq.resize(queries.size());
            index->nearest_and_bound(queries, 0, queries.size(), limits.data(), one.ids.data(),
                                     one.dist_sq.data(), others.data());
            EXPECT_TRUE(one == brute_force(*cloud, queries, 1, limits));
            const Found two = brute_force(*cloud, queries, 2, std::vector<float>(queries.size(), INF));
            size_t useful = 0;
            for (size_t i = 0; i < queries.size(); i++)
            {
                // Where nothing is near enough, the nearest is one of the others.
                const float other_sq = two.dist_sq[2 * i + (one.ids[i] == NO_NEIGHBOR ? 0 : 1)];
                ASSERT_LE(others[i], std::sqrt(other_sq)) << i;
                useful += others[i] > 0.9f * std::sqrt(std::min(other_sq, max_dist_sq));
            }
            EXPECT_GT(useful, queries.size() / 2) << "a bound of 0 would pass, and be of no use";
        }
    }
}

TEST_P(NnIndex, TiesGoToTheLowerIndex)
{
    // A grid with every point twice, asked at points, edge midpoints and cell centres: 2 to 16 equal
    // distances each.
    const auto cloud = CSimplePointsMap::Create();
    for (int copy = 0; copy < 2; copy++)
        for (int i = 0; i < 343; i++)
            cloud->insertPoint(static_cast<float>(i % 7), static_cast<float>(i / 7 % 7),
                               static_cast<float>(i / 49));
    PointArrays queries;
    for (int i = 0; i < 13 * 13 * 13; i++)
    {
        queries.x.push_back(0.5f * static_cast<float>(i % 13));
        queries.y.push_back(0.5f * static_cast<float>(i / 13 % 13));
        queries.z.push_back(0.5f * static_cast<float>(i / 169));
    }
    const std::vector<float> limits(queries.size(), INF);
    for (const uint32_t leaf : {1u, 10u})
        for (const uint32_t k : {1u, 3u, 9u})
            EXPECT_EQ(ask(*make(cloud, leaf), queries, k, limits), brute_force(*cloud, queries, k, limits))
                << leaf << k;
}

TEST_P(NnIndex, TheRadiusIsExclusiveAndPerQuery)
{
    const auto cloud = CSimplePointsMap::Create();
    cloud->insertPoint(3, 0, 0);
    PointArrays queries;
    queries.x = {0, 0, 0}, queries.y = queries.z = {0, 0, 0};
    const auto f = ask(*make(cloud), queries, 1, {9.0f, std::nextafter(9.0f, 10.0f), 0.0f});
    EXPECT_EQ(f.ids, (std::vector<uint32_t>{NO_NEIGHBOR, 0, NO_NEIGHBOR}));
    EXPECT_EQ(f.dist_sq, (std::vector<float>{INF, 9.0f, INF}));
}

TEST_P(NnIndex, OnlyTheAskedRangeIsWritten)
{
    const auto cloud = random_cloud(100, 3, 1);
    const auto queries = random_queries(10, 4, 1);
    const std::vector<float> limits(10, INF);
    std::vector<uint32_t> ids(20, 777);
    std::vector<float> dist_sq(20, -1);
    make(cloud)->nearest(queries, 3, 6, 2, limits.data(), ids.data(), dist_sq.data());
    const auto truth = brute_force(*cloud, queries, 2, limits);
    for (size_t i = 0; i < 20; i++)
    {
        const bool asked = i >= 6 && i < 12;
        EXPECT_EQ(ids[i], asked ? truth.ids[i] : 777u) << i;
        EXPECT_EQ(dist_sq[i], asked ? truth.dist_sq[i] : -1.0f) << i;
    }
}

TEST_P(NnIndex, AnEmptyCloudHasNoNeighbours)
{
    const auto index = make(CSimplePointsMap::Create());
    EXPECT_EQ(index->size(), 0u);
    const auto queries = random_queries(3, 5, 1);
    const auto f = ask(*index, queries, 2, std::vector<float>(3, INF));
    EXPECT_EQ(f.ids, std::vector<uint32_t>(6, NO_NEIGHBOR));
    EXPECT_EQ(f.dist_sq, std::vector<float>(6, INF));
}

TEST_P(NnIndex, AskingForNoNeighbourWritesNothing)
{
    const auto index = make(random_cloud(50, 6, 1));
    const auto queries = random_queries(3, 7, 1);
    EXPECT_TRUE(ask(*index, queries, 0, std::vector<float>(3, INF)).ids.empty());
}

TEST_P(NnIndex, ACloudOfEqualPointsIsIndexed)
{
    const auto cloud = CSimplePointsMap::Create();
    for (int i = 0; i < 1000; i++) cloud->insertPoint(1, 2, 3);
    PointArrays queries;
    queries.x = {1}, queries.y = {2}, queries.z = {4};
    const auto f = ask(*make(cloud), queries, 3, {INF});
    EXPECT_EQ(f.ids, (std::vector<uint32_t>{0, 1, 2}));
    EXPECT_EQ(f.dist_sq, (std::vector<float>{1, 1, 1}));
}

TEST_P(NnIndex, PointsThatAreNotFiniteAreNeverFoundAndDoNotDisturb)
{
    const auto cloud = random_cloud(500, 8, 10);
    const float bad[] = {std::numeric_limits<float>::quiet_NaN(), INF, -INF};
    for (size_t i = 0; i < 500; i += 3)  // the very first one too
    {
        float p[3] = {0, 0, 0};
        cloud->getPointFast(i, p[0], p[1], p[2]);
        p[i % 2] = bad[i / 3 % 3];
        cloud->setPoint(i, p[0], p[1], p[2]);
    }
    const auto index = make(cloud);
    EXPECT_EQ(index->size(), 500u);
    const auto queries = random_queries(100, 9, 12);
    for (const uint32_t k : {1u, 4u})
    {
        const std::vector<float> limits(100, 50.0f);
        EXPECT_EQ(ask(*index, queries, k, limits), brute_force(*cloud, queries, k, limits));
    }
    const auto none = CSimplePointsMap::Create();
    none->insertPoint(bad[0], 0, 0);
    EXPECT_EQ(ask(*make(none), queries, 1, std::vector<float>(100, INF)).ids,
              std::vector<uint32_t>(100, NO_NEIGHBOR));
}

TEST_P(NnIndex, AQueryThatIsNotFiniteHasNoNeighbour)
{
    PointArrays queries;
    queries.x = {std::numeric_limits<float>::quiet_NaN(), INF}, queries.y = queries.z = {0, 0};
    const auto f = ask(*make(random_cloud(50, 10, 1)), queries, 1, {INF, INF});
    EXPECT_EQ(f.ids, (std::vector<uint32_t>{NO_NEIGHBOR, NO_NEIGHBOR}));
}

TEST_P(NnIndex, SeveralThreadsGetTheAnswersOfOne)
{
    const auto cloud = random_cloud(3000, 11, 10);
    const auto index = make(cloud);
    const auto queries = random_queries(2000, 12, 10);
    const std::vector<float> limits(2000, INF);
    const auto alone = ask(*index, queries, 3, limits);
    std::vector<Found> found(4);
    std::vector<std::thread> threads;
    for (auto& f : found) threads.emplace_back([&]() { f = ask(*index, queries, 3, limits); });
    for (auto& t : threads) t.join();
    for (const auto& f : found) EXPECT_EQ(f, alone);
}

// ---- The choice -------------------------------------------------------------------------------------------

TEST(BlockGridIndex, IsMadeForCloudsOfEvenDensityAndNotForOthers)
{
    const auto flat = CSimplePointsMap::Create(), line = CSimplePointsMap::Create();
    for (int i = 0; i < 4000; i++)
    {
        flat->insertPoint(0.1f * static_cast<float>(i % 80), 0.1f * static_cast<float>(i / 80), 0);
        line->insertPoint(0.1f * static_cast<float>(i), 0, 0);
    }
    EXPECT_NE(make_block_grid_index(flat), nullptr);
    EXPECT_NE(make_block_grid_index(line), nullptr);
    EXPECT_NE(make_block_grid_index(random_cloud(4000, 1, 10)), nullptr);
    EXPECT_NE(make_block_grid_index(CSimplePointsMap::Create()), nullptr);
    // Nearly all points at one place.
    const auto crowd = random_cloud(20, 2, 1000);
    for (int i = 0; i < 4000; i++) crowd->insertPoint(0, 0, 0);
    EXPECT_EQ(make_block_grid_index(crowd), nullptr);
    const auto queries = random_queries(50, 3, 1000);
    const std::vector<float> limits(queries.size(), INF);
    EXPECT_EQ(ask(*make_nn_index(crowd), queries, 2, limits), brute_force(*crowd, queries, 2, limits));
}

TEST(BlockGridIndex, FindsWhatTheTreeFindsInScansOfUnevenDensity)
{
    // Rings of a LiDAR: the density falls with the square of the range.
    SeededRandom random(4);
    const auto cloud = CSimplePointsMap::Create();
    for (int i = 0; i < 20000; i++)
    {
        const double range = 2 * std::exp(random.uniform(0, 3)), angle = random.uniform(-M_PI, M_PI);
        cloud->insertPoint(static_cast<float>(range * std::cos(angle)),
                           static_cast<float>(range * std::sin(angle)),
                           static_cast<float>(random.gaussian(0.05)));
    }
    const auto index = make_nn_index(cloud), tree = make_kdtree_index(cloud);
    const auto queries = random_queries(2000, 5, 40);
    for (const float limit : {0.04f, 1.0f, INF})
    {
        const std::vector<float> limits(queries.size(), limit);
        for (const uint32_t k : {1u, 4u})
            EXPECT_EQ(ask(*index, queries, k, limits), ask(*tree, queries, k, limits));
    }
}
