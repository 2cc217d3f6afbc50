#include <limits>

#include "result_yaml.h"
#include "run_tools.h"

using namespace mp2p_icp_apps;
using namespace mp2p_icp_test;

namespace
{
constexpr double INF = std::numeric_limits<double>::infinity();

AlignmentRecord difficult_record()
{
    AlignmentRecord a;
    auto& r = a.results;
    r.verdict = mp2p_icp::Verdict::under_constrained;
    r.verdict_reason = "a \"quoted\" C:\\path: with # signs\nand a second line";
    r.optimal_tf.mean = pose_deg(4.6e6 + 1.0 / 3, -1.0 / 7, 1e-5, 10.1, -20.2, 30.3);
    for (int i = 0; i < 6; i++)
        for (int k = 0; k < 6; k++) r.optimal_tf.cov(i, k) = i == k ? 1.0 / (i + 3) : 1e-5 * (i + k);
    for (int k = 0; k < 6; k++) r.optimal_tf.cov(5, k) = r.optimal_tf.cov(k, 5) = k == 5 ? INF : 0.0;
    mp2p_icp::FreeTwist twist;
    twist.kind = mp2p_icp::FreeTwist::Kind::Rotation;
    twist.axis = {1, 0, 0}, twist.through = {0, 0.1, 0}, twist.sigma = INF, twist.name = "roll";
    r.unobservable = {twist};
    twist.kind = mp2p_icp::FreeTwist::Kind::Translation;
    twist.axis = {0, 1, 0}, twist.name = "y", twist.sigma = 0.3;
    r.unobservable.push_back(twist);
    r.quality = 0.1 + 0.2, r.nIterations = 12, r.residual_rms = 1.0 / 3;
    r.terminationReason = mp2p_icp::IterTermReason::Stalled;
    r.finalPairings.paired_pt2pl.resize(3);
    a.local.report.points_read = 10, a.local.report.points_dropped_nonfinite = 2, a.local.points_used = 5;
    a.global.report.points_read = 20, a.global.points_used = 7;
    a.time_s = {1, 2, 3, 6.5};
    return a;
}

yaml parsed(const AlignmentRecord& a)
{
    return mp2p_icp::yaml_from_text(result_yaml(a));
}

std::vector<std::string> keys_of(const yaml& map)
{
    std::vector<std::string> keys;
    for (const auto& [key, value] : map.asMap()) keys.emplace_back(key.internalAsStr());
    std::sort(keys.begin(), keys.end());
    return keys;
}
using Keys = std::vector<std::string>;
}  // namespace

TEST(result_yaml, has_exactly_the_promised_keys)
{
    const auto y = parsed(difficult_record());
    EXPECT_EQ(keys_of(y), (Keys{"T_global_local", "covariance", "iterations", "pairings", "points", "pose",
                                "quality", "residual_rms", "termination", "time_s", "unobservable", "verdict",
                                "verdict_reason", "versions"}));
    EXPECT_EQ(keys_of(part(y, "pose")), (Keys{"pitch_deg", "roll_deg", "x", "y", "yaw_deg", "z"}));
    EXPECT_EQ(keys_of(part(y, "pairings")), (Keys{"ln2ln", "pl2pl", "pt2ln", "pt2pl", "pt2pt"}));
    EXPECT_EQ(keys_of(part(y, "points")), (Keys{"global", "local"}));
    EXPECT_EQ(keys_of(part(part(y, "points"), "local")), (Keys{"dropped_nonfinite", "read", "used"}));
    EXPECT_EQ(keys_of(part(y, "time_s")), (Keys{"align", "filters", "load", "total"}));
}

TEST(result_yaml, has_error_and_rejected_pose_only_when_there_are_any)
{
    auto a = difficult_record();
    a.error = PoseError{0.25, 1.5};
    a.results.rejected_pose = pose_deg(1, 2, 3, 4, 5, 6);
    const auto y = parsed(a);
    EXPECT_EQ(number_at(part(y, "error"), "translation_m"), 0.25);
    EXPECT_EQ(number_at(part(y, "error"), "rotation_deg"), 1.5);
    EXPECT_EQ(number_at(part(y, "rejected_pose"), "yaw_deg"), 4);
}

TEST(result_yaml, numbers_read_back_with_the_same_bits)
{
    const auto a = difficult_record();
    const auto y = parsed(a);
    const auto& p = a.results.optimal_tf.mean;
    EXPECT_EQ(number_at(part(y, "pose"), "x"), p.x());
    EXPECT_EQ(number_at(part(y, "pose"), "y"), p.y());
    EXPECT_EQ(number_at(part(y, "pose"), "z"), p.z());
    EXPECT_EQ(pose_at(y, "pose").yaw(), p.yaw());
    EXPECT_EQ(pose_at(y, "pose").pitch(), p.pitch());
    EXPECT_EQ(pose_at(y, "pose").roll(), p.roll());
    EXPECT_EQ(matrix_at(y, "T_global_local"),
              p.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>().asEigen());
    EXPECT_EQ(matrix_at(y, "covariance"), a.results.optimal_tf.cov.asEigen());  // with its infinity
    EXPECT_EQ(number_at(y, "quality"), 0.1 + 0.2);
    EXPECT_EQ(number_at(y, "residual_rms"), 1.0 / 3);
    EXPECT_EQ(number_at(part(part(y, "points"), "local"), "dropped_nonfinite"), 2);
    EXPECT_EQ(number_at(part(part(y, "points"), "global"), "used"), 7);
    EXPECT_EQ(number_at(part(y, "pairings"), "pt2pl"), 3);
}

TEST(result_yaml, infinity_is_written_as_yaml_has_it)
{
    const auto text = result_yaml(difficult_record());
    EXPECT_TRUE(contains(text, "sigma: .inf"));
    EXPECT_TRUE(contains(text, "[0, 0, 0, 0, 0, .inf]"));
}

TEST(result_yaml, small_numbers_are_numbers_also_to_yaml_1_1)
{
    EXPECT_TRUE(contains(result_yaml(difficult_record()), "z: 1.0000000000000001e-05"))
        << result_yaml(difficult_record());
    auto a = difficult_record();
    a.results.residual_rms = 1e22;
    EXPECT_TRUE(contains(result_yaml(a), "residual_rms: 1.0e+22"));
}

TEST(result_yaml, texts_survive)
{
    const auto y = parsed(difficult_record());
    EXPECT_EQ(text_at(y, "verdict_reason"), "a \"quoted\" C:\\path: with # signs and a second line");
    EXPECT_EQ(text_at(y, "verdict"), "under_constrained");
    EXPECT_EQ(text_at(y, "termination"), "Stalled");
}

TEST(result_yaml, free_motions_are_listed)
{
    const auto y = parsed(difficult_record());
    const auto& twists = y.asMap().at("unobservable").asSequence();
    ASSERT_EQ(twists.size(), 2u);
    EXPECT_EQ(text_at(yaml(twists[0]), "kind"), "rotation");
    EXPECT_EQ(text_at(yaml(twists[0]), "name"), "roll");
    EXPECT_EQ(number_at(yaml(twists[0]), "sigma"), INF);
    EXPECT_EQ(number_at(part(yaml(twists[0]), "through").asSequence().at(1)), 0.1);
    EXPECT_EQ(text_at(yaml(twists[1]), "name"), "y");
    auto none = difficult_record();
    none.results.unobservable.clear();
    EXPECT_TRUE(contains(result_yaml(none), "unobservable: []\n"));
}

TEST(pose_error, is_that_of_translations_and_rotations)
{
    const auto e = pose_error(pose_deg(1.03, 2.04, 3, 11, 0, 0), pose_deg(1, 2, 3, 10, 0, 0), {0, 0, 0});
    EXPECT_NEAR(e.translation_m, 0.05, 1e-12);
    EXPECT_NEAR(e.rotation_deg, 1, 1e-9);
}

TEST(pose_error, is_measured_where_the_cloud_is_and_not_at_a_far_origin)
{
    const mrpt::math::TPoint3D far(5e5, 4.6e6, 0);
    const auto around_cloud = [&](const CPose3D& p)
    { return CPose3D(far) + p + CPose3D(-far.x, -far.y, 0, 0, 0, 0); };
    const auto e = pose_error(around_cloud(pose_deg(0.3, 0.4, 0, 0.1, 0, 0)),
                              around_cloud(pose_deg(0, 0, 0, 0, 0, 0)), far);
    EXPECT_NEAR(e.translation_m, 0.5, 1e-7);  // coordinates of 4.6e6 m have steps of 1e-9
    EXPECT_NEAR(e.rotation_deg, 0.1, 1e-9);
}
