#include <mp2p_icp/pairings_from.h>

#include "expect_problem.h"
#include "matcher_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

TEST(PairingsFrom, TakesThePointsOfTheIndicesInTheirOrder)
{
    const Cloud g = random_cloud(5, 10, 1), l = random_cloud(7, 10, 2);
    const std::vector<std::pair<size_t, size_t>> indices = {{4, 0}, {0, 6}, {4, 0}};
    const Pairings p = pairings_from(*points_map(g), *points_map(l), indices);
    ASSERT_EQ(p.paired_pt2pt.size(), 3u);
    EXPECT_EQ(p.potential_pairings, 3u);
    EXPECT_TRUE(p.point_weights.empty());
    for (size_t i = 0; i < 3; i++)
    {
        const auto& pair = p.paired_pt2pt[i];
        const uint32_t global_id = pair.globalIdx, local_id = pair.localIdx;
        EXPECT_EQ(global_id, indices[i].first);
        EXPECT_EQ(local_id, indices[i].second);
        EXPECT_EQ(mrpt::math::TPoint3D(pair.global), mrpt::math::TPoint3D(g[indices[i].first]));
        EXPECT_EQ(mrpt::math::TPoint3D(pair.local), mrpt::math::TPoint3D(l[indices[i].second]));
    }
    EXPECT_TRUE(pairings_from(*points_map(g), *points_map({}), {}).empty());
}

TEST(PairingsFrom, AnIndexOutOfRangeIsNamed)
{
    const auto g = points_map(random_cloud(5, 10, 1)), l = points_map(random_cloud(7, 10, 2));
    expect_problem_with<std::invalid_argument>({"pair 1", "global point 5", "5"},
                                               [&]() {
                                                   pairings_from(*g, *l, {{0, 6}, {5, 9}});
                                               });
    expect_problem_with<std::invalid_argument>({"pair 0", "local point 7"},
                                               [&]() {
                                                   pairings_from(*g, *l, {{0, 7}});
                                               });
    EXPECT_THROW(pairings_from(*g, *l, {{size_t(1) << 32, 0}}), std::invalid_argument);
}
