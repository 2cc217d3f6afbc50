#include <gtest/gtest.h>
#include <mp2p_icp/QualityEvaluator_PairedRatio.h>
#include <mp2p_icp/errors.h>

#include "icp_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
Pairings pairings_with(size_t paired, uint64_t potential)
{
    Pairings p;
    p.paired_pt2pt.resize(paired);
    p.potential_pairings = potential;
    return p;
}

/// Gives a fixed answer.
class FixedQuality : public QualityEvaluator_PairedRatio
{
 public:
    FixedQuality(double quality, bool discard) : answer{quality, discard} {}
    Result answer;
    Result evaluate(const metric_map_t&, const metric_map_t&, const CPose3D&, const Pairings&,
                    const MatchContext&) const override
    {
        return answer;
    }
};
}  // namespace

TEST(QualityEvaluator_PairedRatio, is_the_share_of_what_could_be_paired)
{
    const metric_map_t map = map_of(wavy_surface(10, 1));
    const QualityEvaluator_PairedRatio q;
    const auto evaluate = [&](size_t paired, uint64_t potential)
    { return q.evaluate(map, map, CPose3D(), pairings_with(paired, potential), {}); };
    EXPECT_DOUBLE_EQ(evaluate(30, 40).quality, 0.75);
    EXPECT_FALSE(evaluate(30, 40).hard_discard);
    EXPECT_DOUBLE_EQ(evaluate(40, 40).quality, 1.0);
    EXPECT_FALSE(evaluate(8, 40).hard_discard) << "exactly the minimum of 0.20 is enough";
    EXPECT_TRUE(evaluate(7, 40).hard_discard);
    EXPECT_TRUE(evaluate(0, 40).hard_discard);
    EXPECT_TRUE(evaluate(0, 0).hard_discard) << "zero pairings are never perfect";
    EXPECT_EQ(evaluate(0, 0).quality, 0.0);
}

TEST(QualityEvaluator_PairedRatio, matches_anew_when_given_the_keys_of_the_matcher)
{
    const auto points = wavy_surface(200, 1);
    const metric_map_t map = map_of(points);
    QualityEvaluator_PairedRatio q;
    q.initialize(yaml_from_text("threshold: 0.01\n"));
    EXPECT_FALSE(q.reuse_icp_pairings);
    EXPECT_DOUBLE_EQ(q.evaluate(map, map, CPose3D(), pairings_with(0, 0), {}).quality, 1.0);
    EXPECT_EQ(q.evaluate(map, map, CPose3D(0, 0, 5), pairings_with(40, 40), {}).quality, 0.0);
}

TEST(QualityEvaluator_PairedRatio, with_exchanged_maps_is_the_share_of_the_global_points)
{
    const CPose3D pose(1, 2, 3, 0.4, 0.1, 0.2);  // of local in global
    const auto all = wavy_surface(200, 1), some = wavy_surface(200, 1);
    some->resize(50);
    metric_map_t global = map_of(all), local;
    auto seen = mrpt::maps::CSimplePointsMap::Create(*some);
    seen->changeCoordinatesReference(-pose);
    local.layers["seen"] = seen;
    QualityEvaluator_PairedRatio there, back;
    there.initialize(yaml_from_text("threshold: 0.001\npointLayerMatches: [{global: raw, local: seen}]\n"));
    back.initialize(yaml_from_text(
        "exchange_maps: true\nthreshold: 0.001\npointLayerMatches: [{global: seen, local: raw}]\n"));
    EXPECT_DOUBLE_EQ(there.evaluate(global, local, pose, {}, {}).quality, 1.0);
    EXPECT_DOUBLE_EQ(back.evaluate(global, local, pose, {}, {}).quality, 0.25);
    EXPECT_EQ(back.evaluate(global, local, -pose, {}, {}).quality, 0.0);
    EXPECT_THROW(back.initialize(yaml_from_text("exchange_maps: true\nreuse_icp_pairings: true\n")),
                 ConfigError);
}

TEST(QualityEvaluator_PairedRatio, parameters_survive_saving_and_loading)
{
    for (const char* text :
         {"threshold: 0.01\nthresholdAngularDeg: 2\n", "absolute_minimum_pairing_ratio: 0.3\n"})
    {
        QualityEvaluator_PairedRatio a, b;
        a.initialize(yaml_from_text(text));
        b.initialize(a.save_parameters());
        EXPECT_EQ(b.reuse_icp_pairings, a.reuse_icp_pairings);
        EXPECT_EQ(b.absolute_minimum_pairing_ratio, a.absolute_minimum_pairing_ratio);
        EXPECT_EQ(b.matcher.threshold.text(), a.matcher.threshold.text());
        EXPECT_EQ(b.matcher.thresholdAngularDeg.text(), a.matcher.thresholdAngularDeg.text());
    }
}

TEST(evaluate_quality, is_the_weighted_mean_and_any_discard_makes_it_zero)
{
    const metric_map_t map = map_of(wavy_surface(10, 1));
    const auto evaluate = [&](const ICP::quality_eval_list_t& list)
    { return ICP::evaluate_quality(list, map, map, CPose3D(), {}); };
    const auto a = std::make_shared<FixedQuality>(0.5, false), b = std::make_shared<FixedQuality>(1.0, false),
               c = std::make_shared<FixedQuality>(0.9, true);
    EXPECT_DOUBLE_EQ(evaluate({{a, 1.0}, {b, 3.0}}).quality, 0.875);
    EXPECT_EQ(evaluate({{a, 1.0}, {b, 3.0}, {c, 1.0}}).quality, 0.0);
    EXPECT_TRUE(evaluate({{a, 1.0}, {c, 0.0}}).hard_discard);
    c->enabled = false;
    EXPECT_DOUBLE_EQ(evaluate({{a, 1.0}, {c, 1.0}}).quality, 0.5);
    EXPECT_EQ(evaluate({}).quality, 0.0);
}
