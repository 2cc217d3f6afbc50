#include <gtest/gtest.h>
#include <mp2p_icp/diagnosis.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/synthetic/sample_by_area.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <limits>

#include "icp_test_tools.h"

/** \file test_diagnosis.cpp
 * Runs that fail for a reason that is known, because the test made it. Each has one thing wrong, and all else
 * as in the healthy run.
 */
using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Cause = DiagnosisCause;
using Points = mrpt::maps::CSimplePointsMap;

namespace
{
const CPose3D TRUTH = pose_deg(0.6, -0.4, 0.1, 4, 1, -1);
const char* const SHRINKING = "'max(0.6, 2.0*0.9^ICP_ITERATION)'";

/// The points within [from, to] along x.
Points::Ptr part(const Points& points, double from, double to)
{
    auto out = Points::Create();
    for (size_t i = 0; i < points.size(); i++)
    {
        float x, y, z;
        points.getPoint(i, x, y, z);
        if (x >= from && x <= to) out->insertPoint(x, y, z);
    }
    return out;
}

Points::Ptr street_points(uint64_t world, uint64_t sample)
{
    return synthetic::sample_by_area(synthetic::street(60, world), 12000, sample);
}

/// Two independent samples of a street, the local one of its middle, and what a run needs.
struct Case
{
    Points::Ptr global = street_points(7, 1), local = part(*street_points(7, 2), -12, 12);
    CPose3D truth = TRUTH, guess;
    std::string matcher = "Matcher_Points_DistanceThreshold", threshold = SHRINKING;
    int iterations = 100;
    std::function<void(Points&)> spoil;  ///< what is done to the local cloud, in its own frame

    std::string pipeline() const
    {
        return "class_name: mp2p_icp::ICP\nparams: {maxIterations: " + std::to_string(iterations) +
               "}\nmatchers: [{class: mp2p_icp::" + matcher + ", params: {" +
               (matcher == "Matcher_Point2Plane" ? "distanceThreshold" : "threshold") + ": " + threshold +
               (matcher == "Matcher_Point2Plane" ? "" : ", allowMatchAlreadyMatchedGlobalPoints: true") +
               "}}]\nsolvers: [{class: mp2p_icp::Solver_GaussNewton, params: {maxIterations: 10}}]\n"
               "quality: [{class: mp2p_icp::QualityEvaluator_PairedRatio, params: "
               "{absolute_minimum_pairing_ratio: 0.3}}]\n";
    }
    LogRecord run() const
    {
        const auto seen = seen_from(truth, *local);
        if (spoil) spoil(*seen);
        const Pipeline p = pipeline_from_yaml(yaml_from_text(pipeline()));
        LogRecord log;
        Results results;
        p.icp->align(map_of(seen), map_of(global), guess.asTPose(), p.parameters, results, std::nullopt, log);
        return log;
    }
};

std::string text_of(const Diagnosis& d)
{
    std::string out = to_string(d.cause) + "; overlap " + std::to_string(d.overlap) + "\n";
    for (const auto& s : d.sentences) out += "  " + s + "\n";
    return out;
}

/// The cause, in at most ten whole sentences, of which one holds `word`.
Diagnosis expect_cause(const Case& c, Cause cause, const std::string& word)
{
    const LogRecord log = c.run();
    const Diagnosis d = diagnose(log);
    EXPECT_EQ(to_string(d.cause), to_string(cause)) << text_of(d);
    EXPECT_LE(d.sentences.size(), 10u);
    EXPECT_NE(text_of(d).find(word), std::string::npos) << "'" << word << "' is not in:\n" << text_of(d);
    for (const auto& s : d.sentences) EXPECT_TRUE(!s.empty() && s.back() == '.') << s;
    return d;
}

void scale_by(Points& points, float factor)
{
    for (size_t i = 0; i < points.size(); i++)
    {
        float x, y, z;
        points.getPoint(i, x, y, z);
        points.setPoint(i, x * factor, y * factor, z * factor);
    }
}
}  // namespace

TEST(diagnosis, all_is_well)
{
    const auto d = expect_cause({}, Cause::AllIsWell, "like noise");
    EXPECT_GT(d.overlap, 0.9);
    EXPECT_FALSE(d.better_pose);
}

TEST(diagnosis, empty_map)
{
    Case c;
    c.spoil = [](Points& p) { p.clear(); };
    expect_cause(c, Cause::EmptyMap, "local map is empty");
}

TEST(diagnosis, too_few_points)
{
    Case c;
    c.spoil = [](Points& p) { p.resize(8); };
    expect_cause(c, Cause::TooFewPoints, "only 8 points");
}

TEST(diagnosis, points_that_are_not_finite)
{
    Case c;
    c.spoil = [](Points& p)
    {
        for (size_t i = 15; i < p.size(); i++) p.setPoint(i, 1, std::numeric_limits<float>::quiet_NaN(), 0);
    };
    expect_cause(c, Cause::NonFinitePoints, "are not finite");
}

TEST(diagnosis, too_few_iterations)
{
    Case c;
    c.iterations = 3;
    expect_cause(c, Cause::TooFewIterations, "its 3 iterations were over");
}

TEST(diagnosis, corridor)
{
    Case c;
    const auto corridor = synthetic::corridor(40, 3, 2.5);
    c.global = synthetic::sample_by_area(corridor, 8000, 1);
    c.local = part(*synthetic::sample_by_area(corridor, 8000, 2), -8, 8);
    c.matcher = "Matcher_Point2Plane", c.threshold = "0.8";
    c.truth = pose_deg(0.3, 0.2, 0.1, 3, 0, 0);
    const auto d = expect_cause(c, Cause::FreeMotion, "Free axes: ");
    ASSERT_EQ(d.free.size(), 1u) << text_of(d);
    EXPECT_GT(std::abs(d.free[0].axis.x), 0.9);
}

TEST(diagnosis, wrong_unit)
{
    Case c;
    c.spoil = [](Points& p) { scale_by(p, 1000); };
    EXPECT_NEAR(expect_cause(c, Cause::WrongScale, "multiplied by").better_scale, 1e-3, 5e-4);
}

TEST(diagnosis, wrong_scale)
{
    Case c;
    c.spoil = [](Points& p) { scale_by(p, 1.1f); };
    EXPECT_NEAR(expect_cause(c, Cause::WrongScale, "multiplied by").better_scale, 1 / 1.1, 0.01);
}

TEST(diagnosis, bad_guess)
{
    Case c;
    c.guess = pose_deg(3, 1, 0, 150, 0, 0);
    const auto d = expect_cause(c, Cause::BadGuess, "bad guess");
    ASSERT_TRUE(d.better_pose);
    EXPECT_LT(translation_error(*d.better_pose, TRUTH), 0.1);
}

TEST(diagnosis, threshold_too_small)
{
    Case c;
    c.threshold = "0.1";
    expect_cause(c, Cause::ThresholdTooSmall, "too small");
}

TEST(diagnosis, threshold_too_large)
{
    Case c;
    // What the local map shows beyond the global one is paired with the global one's border.
    c.global = part(*c.global, -12, 4), c.local = part(*street_points(7, 2), -12, 8);
    c.threshold = "6.0";
    expect_cause(c, Cause::ThresholdTooLarge, "too large");
}

TEST(diagnosis, upside_down)
{
    Case c;
    c.spoil = [](Points& p) { p.changeCoordinatesReference(pose_deg(0, 0, 0, 0, 0, 180)); };
    expect_cause(c, Cause::WrongFrame, "upside down");
}

TEST(diagnosis, maps_swapped)
{
    Case c;
    c.truth = pose_deg(4, -3, 0.1, 40, 1, -1);
    c.guess = -c.truth;
    expect_cause(c, Cause::InvertedGuess, "swap local and global");
}

TEST(diagnosis, no_overlap)
{
    Case c;
    c.global = part(*c.global, -30, -8), c.local = part(*street_points(7, 2), 14, 30);
    expect_cause(c, Cause::NoOverlap, "no overlap");
}

TEST(diagnosis, different_places)
{
    Case c;
    c.global = street_points(8, 1);
    expect_cause(c, Cause::DifferentPlaces, "different places");
}

TEST(diagnosis, maps_of_which_only_a_part_is_the_same)
{
    Case c;
    c.global = part(*c.global, -2.4, 30);  // 60 % of the local one
    Case near = c;
    near.threshold = "0.4", near.guess = pose_deg(0.5, -0.3, 0.1, 3, 1, -1);
    EXPECT_LT(expect_cause(near, Cause::AllIsWell, "like noise").overlap, 0.65);

    // Points are pulled towards the border of the global map.
    const auto d = expect_cause(c, Cause::BadGuess, "bad guess");
    ASSERT_TRUE(d.better_pose);
    EXPECT_LT(translation_error(*d.better_pose, TRUTH), 0.1);

    near.global = part(*street_points(8, 1), -2.4, 30);
    expect_cause(near, Cause::DifferentPlaces, "different places");
}

TEST(diagnosis, of_a_pipeline_that_is_not_known_says_so)
{
    LogRecord log = Case().run();
    log.pipeline.matchers[0].class_name = "my::Matcher";
    const auto d = diagnose(log);
    EXPECT_EQ(d.cause, Cause::Unknown);
    EXPECT_NE(text_of(d).find("my::Matcher"), std::string::npos);
    EXPECT_THROW((void)diagnose(LogRecord()), std::invalid_argument);
}
