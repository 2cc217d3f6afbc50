#include "describe.h"
#include "run_tools.h"

using namespace mp2p_icp_apps;
using namespace mp2p_icp_test;

TEST(describe, knows_parts_of_every_kind)
{
    const auto names = describable_classes();
    for (const char* name :
         {"mp2p_icp::Parameters", "mp2p_icp::Solver_Horn", "mp2p_icp::Matcher_Points_DistanceThreshold",
          "mp2p_icp::Matcher_Points_InlierRatio", "mp2p_icp::QualityEvaluator_PairedRatio",
          "mp2p_icp_filters::FilterDecimateVoxels", "mp2p_icp_filters::FilterBoundingBox",
          "mp2p_icp_filters::Generator"})
        EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
}

TEST(describe, describes_every_class_it_knows)
{
    for (const auto& name : describable_classes())
        EXPECT_TRUE(contains(describe_class(name), name + " (")) << name;
}

TEST(describe, works_with_and_without_namespace)
{
    const auto text = describe_class("Matcher_Points_DistanceThreshold");
    EXPECT_EQ(text, describe_class("mp2p_icp::Matcher_Points_DistanceThreshold"));
    for (const char* part : {"threshold", "thresholdAngularDeg", "pairingsPerPoint", "default"})
        EXPECT_TRUE(contains(text, part)) << text;
    EXPECT_TRUE(contains(describe_class("Parameters"), "maxIterations"));
    EXPECT_TRUE(contains(describe_class("FilterDecimateVoxels"), "voxel_filter_resolution"));
}

TEST(describe, needs_no_inputs)
{
    const auto o = run({"--describe", "Solver_Horn"});
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.out, describe_class("Solver_Horn"));
    EXPECT_EQ(o.err, "");
    const std::string all = run({"--describe", "all"}).out;
    EXPECT_TRUE(contains(all, "matcher:\n  mp2p_icp::Matcher_")) << all;
    for (const std::string name :
         {"Matcher_Points_DistanceThreshold", "Matcher_Planes", "Matcher_Point2Line"})
        EXPECT_TRUE(contains(all, "  mp2p_icp::" + name + "\n")) << all;
}

TEST(describe, unknown_classes_are_named_with_the_nearest_and_the_list)
{
    expect_complaint(run({"--describe", "Solver_Hron"}),
                     {"'Solver_Hron'", "did you mean 'Solver_Horn'", "FilterByRange"});
    expect_complaint(run({"--describe", "other::Solver_Horn"}), {"other::Solver_Horn"});
    // Registered classes, but no parts of a pipeline.
    expect_complaint(run({"--describe", "CSimplePointsMap"}), {"CSimplePointsMap"});
    expect_complaint(run({"--describe", "mrpt::maps::CSimplePointsMap"}), {"CSimplePointsMap"});
}
