// Neighbours that are kept from one iteration to the next are those of a new search, to the bit.
#include <gtest/gtest.h>
#include <mp2p_icp/random.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <numeric>

#include "../../mp2p_icp/matchers/src/tracked_nearest.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
mrpt::maps::CSimplePointsMap::Ptr random_cloud(size_t n, uint64_t seed)
{
    SeededRandom random(seed);
    auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (size_t i = 0; i < n; i++)
        cloud->insertPoint(static_cast<float>(random.uniform(-5, 5)),
                           static_cast<float>(random.uniform(-5, 5)),
                           static_cast<float>(random.uniform(-1, 1)));
    return cloud;
}

/// Counts the points that are searched for.
class CountingIndex : public NearestNeighborIndex
{
 public:
    explicit CountingIndex(ConstPtr index) : index_(std::move(index)) {}
    size_t size() const override { return index_->size(); }
    std::optional<mrpt::math::TBoundingBoxf> bounding_box() const override { return index_->bounding_box(); }
    void nearest(const PointArrays& q, size_t first, size_t last, uint32_t k, const float* max, uint32_t* ids,
                 float* dist_sq) const override
    {
        index_->nearest(q, first, last, k, max, ids, dist_sq);
    }
    void nearest_and_bound(const PointArrays& q, size_t first, size_t last, const float* max, uint32_t* ids,
                           float* dist_sq, float* others) const override
    {
        searched += last - first;
        index_->nearest_and_bound(q, first, last, max, ids, dist_sq, others);
    }
    mutable std::atomic<size_t> searched{0};

 private:
    ConstPtr index_;
};

LocalPoints moved(const mrpt::maps::CPointsMap& cloud, const mrpt::math::TPoint3D& by)
{
    LocalPoints out;
    out.ids.resize(cloud.size()), out.in_global.resize(cloud.size());
    std::iota(out.ids.begin(), out.ids.end(), 0u);
    for (size_t i = 0; i < cloud.size(); i++)
    {
        cloud.getPointFast(i, out.in_global.x[i], out.in_global.y[i], out.in_global.z[i]);
        out.in_global.x[i] += static_cast<float>(by.x), out.in_global.y[i] += static_cast<float>(by.y);
        out.in_global.z[i] += static_cast<float>(by.z);
    }
    return out;
}

void expect_as_new(const NearestNeighborIndex& index, const mrpt::maps::CPointsMap& global,
                   const LocalPoints& local, float max_dist_sq, TrackedNearest& tracked)
{
    const size_t n = local.ids.size();
    const std::vector<float> limits(n, max_dist_sq);
    std::vector<uint32_t> ids, expected_ids(n);
    std::vector<float> dist_sq, expected(n);
    tracked.find(index, global, local, limits.data(), ids, dist_sq);
    index.nearest(local.in_global, 0, n, 1, limits.data(), expected_ids.data(), expected.data());
    EXPECT_EQ(ids, expected_ids);
    EXPECT_EQ(dist_sq, expected);
}
}  // namespace

TEST(TrackedNearest, equals_a_new_search_at_every_step_with_every_index)
{
    const auto global = random_cloud(3000, 1), local = random_cloud(2500, 2);
    for (const auto& plain : {make_kdtree_index(global), make_block_grid_index(global)})
    {
        ASSERT_TRUE(plain);
        const CountingIndex index(plain);
        TrackedNearest tracked;
        SeededRandom random(3);
        double step = 0.5;
        mrpt::math::TPoint3D at(0, 0, 0);
        const int STEPS = 30;
        for (int i = 0; i < STEPS; i++, step *= 0.7)
        {
            SCOPED_TRACE(i);
            // The distance grows and shrinks, too, and at times does not allow anything.
            const float max = i % 7 == 3   ? 1e-6f
                              : i % 5 == 2 ? std::numeric_limits<float>::infinity()
                                           : 0.09f;
            expect_as_new(index, *global, moved(*local, at), max, tracked);
            at = at + mrpt::math::TPoint3D(random.uniform(-step, step), random.uniform(-step, step),
                                           random.uniform(-step, step));
        }
        EXPECT_LT(index.searched, 2500u * STEPS / 2) << "nothing was kept";
        EXPECT_GT(index.searched, 2500u);
    }
}

TEST(TrackedNearest, ties_and_points_exactly_on_others_are_those_of_a_new_search)
{
    auto grid = mrpt::maps::CSimplePointsMap::Create(), queries = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 400; i++)
        grid->insertPoint(static_cast<float>(i % 20), static_cast<float>(i / 20), 0);
    for (int i = 0; i < 1600; i++)
        queries->insertPoint(0.5f * static_cast<float>(i % 40), 0.5f * static_cast<float>(i / 40), 0);
    const auto index = make_nn_index(grid);
    TrackedNearest tracked;
    for (const double x : {0.0, 0.25, 0.5, 0.25, 0.0, -0.5, 1e-7})
        expect_as_new(*index, *grid, moved(*queries, {x, 0, 0}), 4.0f, tracked);
}

TEST(TrackedNearest, back_where_they_were_first_nothing_is_searched)
{
    const auto global = random_cloud(500, 9), local = random_cloud(400, 10);
    const CountingIndex index(make_nn_index(global));
    TrackedNearest tracked;
    const LocalPoints first = moved(*local, {0, 0, 0}), far = moved(*local, {1, 0.5, 0});
    expect_as_new(index, *global, first, 1.0f, tracked);
    expect_as_new(index, *global, far, 1.0f, tracked);
    const size_t searched = index.searched;
    EXPECT_GT(searched, 500u);  // far away, most had to be looked for
    expect_as_new(index, *global, first, 0.25f, tracked);
    EXPECT_EQ(index.searched, searched);
}

TEST(TrackedNearest, other_points_than_before_are_looked_for_anew)
{
    const auto global = random_cloud(500, 5), local = random_cloud(400, 6);
    const auto index = make_nn_index(global);
    TrackedNearest tracked;
    LocalPoints all = moved(*local, {0, 0, 0}), half = all;
    half.ids.resize(200), half.in_global.resize(200);
    std::reverse(half.ids.begin(), half.ids.end());
    std::reverse(half.in_global.x.begin(), half.in_global.x.end());
    std::reverse(half.in_global.y.begin(), half.in_global.y.end());
    std::reverse(half.in_global.z.begin(), half.in_global.z.end());
    for (const auto& points : {all, half, all}) expect_as_new(*index, *global, points, 1.0f, tracked);
    expect_as_new(*index, *global, LocalPoints(), 1.0f, tracked);
}

TEST(TrackedNearest, a_position_that_is_not_finite_has_no_neighbour_and_is_forgotten)
{
    const auto global = random_cloud(500, 7), local = random_cloud(100, 8);
    const auto index = make_nn_index(global);
    TrackedNearest tracked;
    LocalPoints points = moved(*local, {0, 0, 0});
    expect_as_new(*index, *global, points, 1.0f, tracked);
    const float was = points.in_global.x[5];
    points.in_global.x[5] = std::numeric_limits<float>::quiet_NaN();
    expect_as_new(*index, *global, points, 1.0f, tracked);
    points.in_global.x[5] = was;
    expect_as_new(*index, *global, points, 1.0f, tracked);
}
