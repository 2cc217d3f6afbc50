#include <mp2p_icp/Matcher.h>
#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/errors.h>

#include "expect_problem.h"
#include "matcher_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
/// Returns the pairings it was made with. Not a point matcher: the base's own truncated_costs() serves it.
class FixedMatcher : public Matcher
{
 public:
    Pairings answer;

 protected:
    void impl_match(const metric_map_t&, const metric_map_t&, const CPose3D&, const MatchContext&,
                    MatchState&, Pairings& out) const override
    {
        out.push_back(answer);
    }

 private:
    mrpt::rtti::CObject* clone() const override { return new FixedMatcher(*this); }
};

Pairings with_errors(const std::vector<double>& squares, uint64_t potential)
{
    Pairings p;
    for (const double e : squares)
    {
        mrpt::tfest::TMatchingPair_d pair(0, 0, 0, 0, 0, 0, 0, 0);
        pair.errorSquareAfterTransformation = e;
        p.paired_pt2pt.push_back(pair);
    }
    p.potential_pairings = potential;
    return p;
}
}  // namespace

TEST(Matcher, RunsBetweenItsIterationsBothIncluded)
{
    const metric_map_t map = raw_map({{0, 0, 0}});
    Matcher_Points_DistanceThreshold m(1);
    m.runFromIteration = 2, m.runUpToIteration = 4;
    for (uint32_t i = 0; i < 7; i++)
    {
        MatchState state(map, map);
        Pairings out;
        const bool turn = i >= 2 && i <= 4;
        EXPECT_EQ(m.is_active({i, {}}), turn);
        EXPECT_EQ(m.match(map, map, {}, {i, {}}, state, out), turn);
        EXPECT_EQ(out.size(), turn ? 1u : 0u);
        EXPECT_EQ(out.potential_pairings, turn ? 1u : 0u);
    }
    m.runUpToIteration = 0;
    EXPECT_TRUE(m.is_active({UINT32_MAX, {}}));
    m.enabled = false;
    EXPECT_FALSE(m.is_active({3, {}}));
}

TEST(Matcher, AppendsToWhatIsThere)
{
    const metric_map_t map = raw_map({{0, 0, 0}});
    Matcher_Points_DistanceThreshold m(1);
    m.weight_pt2pt_layers["raw"]["raw"] = 3;
    MatchState state(map, map);
    Pairings out = with_errors({1, 2}, 5);
    m.match(map, map, {}, {}, state, out);
    EXPECT_EQ(out.size(), 3u);
    EXPECT_EQ(out.potential_pairings, 6u);
    EXPECT_EQ(out.expanded_point_weights(), (std::vector<double>{1, 1, 3}));
}

TEST(Matcher, ARoundRunsAllInTheirOrder)
{
    const metric_map_t map = raw_map({{0, 0, 0}});
    const auto a = std::make_shared<FixedMatcher>(), b = std::make_shared<FixedMatcher>(),
               off = std::make_shared<FixedMatcher>();
    a->answer = with_errors({1}, 10), b->answer = with_errors({2, 3}, 20), off->answer = with_errors({4}, 40);
    off->enabled = false;
    const Pairings p = run_matchers({b, off, a}, map, map, {}, {});
    ASSERT_EQ(p.size(), 3u);
    EXPECT_EQ(p.paired_pt2pt[0].errorSquareAfterTransformation, 2);
    EXPECT_EQ(p.paired_pt2pt[2].errorSquareAfterTransformation, 1);
    EXPECT_EQ(p.potential_pairings, 30u);
    EXPECT_TRUE(run_matchers({}, map, map, {}, {}).empty());
}

TEST(Matcher, TheTruncatedCostOfAnyMatcherCountsTheUnpairedWithTheGate)
{
    const metric_map_t map = raw_map({{0, 0, 0}});
    FixedMatcher m;
    m.answer = with_errors({0.5, 100}, 5);
    MatchState state(map, map);
    EXPECT_EQ(m.truncated_costs(map, map, {}, {}, state, 2.0), (std::vector<double>{0.5, 4, 4, 4, 4}));
    EXPECT_FALSE(m.gate({}).has_value());
}

TEST(MatchState, KnowsTheCloudsAndForgetsWhatIsPaired)
{
    metric_map_t g = map_of({{"a", random_cloud(5, 1, 1)}, {"b", {}}});
    const metric_map_t l = map_of({{"c", random_cloud(3, 1, 1)}});
    MatchState state(g, l);
    EXPECT_EQ(state.globalPairedBitField.point_layers,
              (decltype(pointcloud_bitfield_t::point_layers){{"a", std::vector<bool>(5)}, {"b", {}}}));
    EXPECT_EQ(state.localPairedBitField.point_layers.at("c"), std::vector<bool>(3));
    state.localPairedBitField.point_layers.at("c")[1] = true;
    state.initialize();
    EXPECT_EQ(state.localPairedBitField.point_layers.at("c"), std::vector<bool>(3));
}

TEST(MatchState, ScratchMemoryBelongsToOneMatcherAndItsLayers)
{
    const metric_map_t map = raw_map({{0, 0, 0}});
    const FixedMatcher a, b;
    MatchState state(map, map), other(map, map);
    state.scratch<int>(&a, "g", "l") = 5;
    EXPECT_EQ(state.scratch<int>(&a, "g", "l"), 5);
    EXPECT_EQ(state.scratch<int>(&b, "g", "l"), 0);
    EXPECT_EQ(state.scratch<int>(&a, "l", "g"), 0);
    EXPECT_EQ(other.scratch<int>(&a, "g", "l"), 0);
    state.initialize();
    EXPECT_EQ(state.scratch<int>(&a, "g", "l"), 5);  // kept for the whole run
}

TEST(Matcher, AreMadeByTheirClassNames)
{
    for (const char* name :
         {"mp2p_icp::Matcher_Points_DistanceThreshold", "mp2p_icp::Matcher_Points_InlierRatio"})
    {
        const auto made = mrpt::rtti::classFactory(name);
        ASSERT_TRUE(made) << name;
        EXPECT_TRUE(std::dynamic_pointer_cast<Matcher>(made)) << name;
    }
}
