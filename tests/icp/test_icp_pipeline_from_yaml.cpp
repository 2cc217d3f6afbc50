#include <gtest/gtest.h>
#include <mp2p_icp/QualityEvaluator_PairedRatio.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>

#include "icp_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
// With every key of release 0.2.2 that these classes had.
const std::string KEYS_OF_0_2_2 = R"(class_name: mp2p_icp::ICP
params:
  maxIterations: 100
  minAbsStep_trans: 1e-4
  minAbsStep_rot: 1e-4
  generateDebugFiles: false
  debugFileNameFormat: "icp-run-$UNIQUE_ID.icplog"
  debugPrintIterationProgress: false
solvers:
  - class: mp2p_icp::Solver_Horn
    params:
      runFromIteration: 0
      runUpToIteration: 0
      pairingsWeightParameters:
        use_scale_outlier_detector: false
        scale_outlier_threshold: 1.20
        use_robust_kernel: false
        robust_kernel_param: 0.1
        robust_kernel_scale: 400
        pair_weights: {pt2pt: 1, pt2pl: 1, pt2ln: 1, ln2ln: 1, pl2pl: 1}
matchers:
  - class: mp2p_icp::Matcher_Points_DistanceThreshold
    params:
      threshold: 0.25
      pairingsPerPoint: 1
      maxLocalPointsPerLayer: 2000
      localPointsSampleSeed: 5
      allowMatchAlreadyMatchedPoints: false
      pointLayerMatches:
        - {global: "raw", local: "decimated", weight: 1.0}
quality:
  - class: mp2p_icp::QualityEvaluator_PairedRatio
    params:
      threshold: 0.10
      pointLayerMatches:
        - {global: "raw", local: "decimated"}
filters:
  - class_name: mp2p_icp_filters::FilterDecimateVoxels
    params:
      input_pointcloud_layer: raw
      output_pointcloud_layer: decimated
      voxel_filter_resolution: 0.01
      use_voxel_average: true
      bounding_box_min: [-10, -10, -10]
      bounding_box_max: [10, 10, 10]
)";

// With every key of the later releases.
const std::string LATER_KEYS = R"(class_name: mp2p_icp::ICP
params:
  maxIterations: 100
  minAbsStep_trans: 1e-4
  minAbsStep_rot: 1e-4
  decimationDebugFiles: 1
  saveIterationDetails: false
  decimationIterationDetails: 10
  quality_checkpoints:
    - {iteration: 50, minimum_quality: 0.05}
solvers:
  - class: mp2p_icp::Solver_Horn
    params:
      runUntilTranslationCorrectionSmallerThan: 0
      enabled: true
      pairingsWeightParameters:
        use_scale_outlier_detector: false
        robust_kernel: RobustKernel::None
        robust_kernel_param: 1.0
matchers:
  - class: mp2p_icp::Matcher_Points_DistanceThreshold
    params:
      enabled: true
      threshold: 0.05 + 0.20*exp(-0.1*ICP_ITERATION)
      thresholdAngularDeg: 0.5
      pairingsPerPoint: 1
      bounding_box_intersection_check_epsilon: 0.20
      pointLayerMatches:
        - {global: "raw", local: "decimated", weight: 1.0}
quality:
  - class: mp2p_icp::QualityEvaluator_PairedRatio
    weight: 2.0
    params:
      reuse_icp_pairings: true
      absolute_minimum_pairing_ratio: 0.20
filters:
  - class_name: mp2p_icp_filters::FilterDecimateVoxels
    params:
      input_pointcloud_layer: raw
      output_pointcloud_layer: decimated
      voxel_filter_resolution: 0.01
      decimate_method: DecimateMethod::VoxelAverage
)";

std::string error_of(const std::string& text)
{
    try
    {
        pipeline_from_yaml(yaml_from_text(text, "my.yaml"), {"my.yaml", ""});
    }
    catch (const ConfigError& e)
    {
        return e.what();
    }
    return "no error";
}

std::string with(std::string text, const std::string& from, const std::string& to)
{
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

bool has(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

void expect_aligns(const std::string& text)
{
    Pipeline pipeline = pipeline_from_yaml(yaml_from_text(text));
    const CPose3D truth = pose_deg(0.03, -0.02, 0.01, 3, -2, 2);
    metric_map_t global = map_of(wavy_surface(20000, 1)),
                 local = map_of(seen_from(truth, *wavy_surface(20000, 2)));
    for (auto* map : {&global, &local})
        mp2p_icp_filters::apply_filter_pipeline(pipeline.filters.at("filters"), *map);
    Results r;
    pipeline.icp->align(local, global, {}, pipeline.parameters, r);
    EXPECT_EQ(r.verdict, Verdict::aligned) << r.verdict_reason;
    // Spacing of the global samples: 7 mm, and the run stops at steps of 0.1 mm; the identity is 37 mm and 4
    // degrees off.
    EXPECT_LT(translation_error(r.optimal_tf.mean, truth), 3e-3);
    EXPECT_LT(rotation_error(r.optimal_tf.mean, truth), mrpt::DEG2RAD(0.4));
    EXPECT_GT(r.quality, 0.5);
}
}  // namespace

TEST(pipeline_from_yaml, a_file_with_the_keys_of_release_0_2_2_loads_and_runs)
{
    expect_aligns(KEYS_OF_0_2_2);
}
TEST(pipeline_from_yaml, a_file_with_the_later_keys_loads_and_runs)
{
    expect_aligns(LATER_KEYS);
}

TEST(pipeline_from_yaml, values_arrive_where_they_belong)
{
    const Pipeline p = pipeline_from_yaml(yaml_from_text(KEYS_OF_0_2_2));
    EXPECT_EQ(p.parameters.maxIterations, 100u);
    EXPECT_EQ(p.parameters.debugFileNameFormat, "icp-run-$UNIQUE_ID.icplog");
    const auto& matcher = dynamic_cast<const Matcher_Points_DistanceThreshold&>(*p.icp->matchers().at(0));
    EXPECT_EQ(matcher.threshold.value(), 0.25);
    EXPECT_EQ(matcher.thresholdAngularDeg.value(), 0.0) << "optional, default 0";
    EXPECT_EQ(matcher.maxLocalPointsPerLayer_, 2000u);
    EXPECT_EQ(matcher.localPointsSampleSeed_, 5u);
    EXPECT_EQ(matcher.weight_pt2pt_layers.at("raw").at("decimated"), 1.0);
    const auto& quality =
        dynamic_cast<const QualityEvaluator_PairedRatio&>(*p.icp->quality_evaluators().at(0).obj);
    EXPECT_FALSE(quality.reuse_icp_pairings) << "release 0.2.2 always matched anew";
    EXPECT_EQ(quality.matcher.threshold.value(), 0.10);
    const Pipeline later = pipeline_from_yaml(yaml_from_text(LATER_KEYS));
    EXPECT_EQ(later.icp->quality_evaluators().at(0).relativeWeight, 2.0);
    EXPECT_EQ(later.parameters.quality_checkpoints, (std::map<uint32_t, double>{{50, 0.05}}));
    EXPECT_TRUE(dynamic_cast<const QualityEvaluator_PairedRatio&>(*later.icp->quality_evaluators().at(0).obj)
                    .reuse_icp_pairings);
}

TEST(pipeline_from_yaml, icp_pipeline_from_yaml_gives_the_icp_part)
{
    const auto [icp, parameters] = icp_pipeline_from_yaml(yaml_from_text(LATER_KEYS));
    EXPECT_EQ(icp->matchers().size(), 1u);
    EXPECT_EQ(parameters.maxIterations, 100u);
}

TEST(pipeline_from_yaml, a_misspelt_key_names_its_path_its_line_and_the_nearest_key)
{
    const std::string matcher = error_of(with(LATER_KEYS, "thresholdAngularDeg", "thresholdAngularDg"));
    EXPECT_TRUE(has(matcher, "my.yaml:25: matchers[0].params.thresholdAngularDg")) << matcher;
    EXPECT_TRUE(has(matcher, "did you mean 'thresholdAngularDeg'")) << matcher;
    const std::string nested = error_of(with(LATER_KEYS, "robust_kernel:", "robust_kernl:"));
    EXPECT_TRUE(has(nested, "my.yaml:18: solvers[0].params.pairingsWeightParameters.robust_kernl")) << nested;
    EXPECT_TRUE(
        has(error_of(with(LATER_KEYS, "maxIterations", "maxIteration")), "did you mean 'maxIterations'"));
    EXPECT_TRUE(has(error_of(with(LATER_KEYS, "matchers:", "matcher:")),
                    "my.yaml:20: matcher: unknown key 'matcher'; did you mean 'matchers'?"));
    const std::string filter = error_of(with(LATER_KEYS, "voxel_filter_resolution", "voxel_resolution"));
    EXPECT_TRUE(has(filter, "my.yaml:41: filters[0].params.voxel_resolution")) << filter;
    EXPECT_TRUE(has(error_of(with(LATER_KEYS, "weight: 2.0", "wieght: 2.0")), "did you mean 'weight'"));
    EXPECT_TRUE(
        has(error_of(with(LATER_KEYS, "iteration: 50", "iteraton: 50")), "quality_checkpoints[0].iteraton"));
}

TEST(pipeline_from_yaml, a_duplicate_key_is_an_error_with_both_lines)
{
    const std::string message = error_of(with(LATER_KEYS, "  minAbsStep_rot: 1e-4", "  maxIterations: 7"));
    EXPECT_TRUE(has(message, "my.yaml:5")) << message;
    EXPECT_TRUE(has(message, "'maxIterations' stands twice")) << message;
    EXPECT_TRUE(has(message, "line 3")) << message;
}

TEST(pipeline_from_yaml, wrong_classes_name_the_nearest_one)
{
    EXPECT_TRUE(has(error_of(with(LATER_KEYS, "mp2p_icp::Solver_Horn", "mp2p_icp::Solver_Horne")),
                    "did you mean 'mp2p_icp::Solver_Horn'"));
    EXPECT_TRUE(has(error_of(with(LATER_KEYS, "Matcher_Points_DistanceThreshold", "Matcher_Points_Distance")),
                    "did you mean 'mp2p_icp::Matcher_Points_DistanceThreshold'"));
    EXPECT_TRUE(
        has(error_of(with(LATER_KEYS, "mp2p_icp::Solver_Horn", "mp2p_icp::Matcher_Points_InlierRatio")),
            "is not a solver"));
    EXPECT_TRUE(has(error_of(with(LATER_KEYS, "class_name: mp2p_icp::ICP\n",
                                  "class_name: mp2p_icp::ICP_LibPointmatcher\n")),
                    "unknown class 'mp2p_icp::ICP_LibPointmatcher'"));
}

TEST(pipeline_from_yaml, required_keys_and_wrong_values_are_named)
{
    EXPECT_TRUE(has(error_of(with(LATER_KEYS, "  maxIterations: 100\n", "")), "'maxIterations' is missing"));
    EXPECT_TRUE(
        has(error_of(with(LATER_KEYS, "class_name: mp2p_icp::ICP\n", "")), "'class_name' is missing"));
    EXPECT_TRUE(has(error_of(with(KEYS_OF_0_2_2, "threshold: 0.25", "threshold: -0.25")),
                    "expected a value in (0, inf) m, found '-0.25'"));
    EXPECT_TRUE(has(error_of(with(KEYS_OF_0_2_2, "threshold: 0.25", "threshold: 0.25 +")),
                    "neither a number nor a valid formula"));
    EXPECT_TRUE(has(error_of(with(KEYS_OF_0_2_2, "use_robust_kernel: false", "use_robust_kernel: true")),
                    "not offered"));
    EXPECT_TRUE(has(error_of(with(LATER_KEYS, "RobustKernel::None", "RobustKernel::Cauchi")),
                    "did you mean 'RobustKernel::Cauchy'"));
    EXPECT_TRUE(has(error_of(with(LATER_KEYS, "reuse_icp_pairings: true",
                                  "reuse_icp_pairings: true\n      threshold: 0.1")),
                    "no effect"));
}

TEST(pipeline_from_yaml, a_formula_with_an_unknown_variable_says_so_when_it_runs)
{
    Pipeline p =
        pipeline_from_yaml(yaml_from_text(with(KEYS_OF_0_2_2, "threshold: 0.25", "threshold: 2*MY_SIGMA")));
    const metric_map_t map = []
    {
        auto m = map_of(wavy_surface(1000, 1));
        m.layers["decimated"] = m.layers["raw"];
        return m;
    }();
    Results r;
    try
    {
        p.icp->align(map, map, {}, p.parameters, r);
        FAIL() << "no exception";
    }
    catch (const std::runtime_error& e)
    {
        EXPECT_TRUE(has(e.what(), "MY_SIGMA") && has(e.what(), "ICP_ITERATION")) << e.what();
    }
    ParameterSource source;
    source.updateVariable("MY_SIGMA", 0.1);
    p.attachToParameterSource(source);
    p.icp->align(map, map, {}, p.parameters, r);
    EXPECT_EQ(r.verdict, Verdict::aligned);
}

TEST(pipeline_from_yaml, named_lists_of_filters_are_kept_and_other_unknown_keys_refused)
{
    const std::string list = R"(filters_local:
  - class_name: mp2p_icp_filters::FilterDeleteLayer
    params: {pointcloud_layer_to_remove: raw}
)";
    const Pipeline p = pipeline_from_yaml(yaml_from_text(LATER_KEYS + list));
    EXPECT_EQ(p.filters.size(), 2u);
    EXPECT_EQ(p.filters.at("filters_local").size(), 1u);
    EXPECT_TRUE(has(error_of(LATER_KEYS + "filterz: 3\n"), "did you mean 'filters'"));
}

TEST(pipeline_from_yaml, plugin_and_derived_are_known_and_refused)
{
    EXPECT_TRUE(has(error_of(LATER_KEYS + "plugin: libx.so\n"), "not supported"));
    EXPECT_TRUE(
        has(error_of(with(LATER_KEYS, "    weight: 2.0", "    plugin: libx.so")), "quality[0].plugin"));
    EXPECT_TRUE(has(error_of(LATER_KEYS + "derived: {matcher: x}\n"), "ICP_LibPointmatcher"));
}

TEST(pipeline_from_yaml, a_part_that_is_not_enabled_does_nothing)
{
    const Pipeline p =
        pipeline_from_yaml(yaml_from_text(with(LATER_KEYS, "  - class: mp2p_icp::Solver_Horn",
                                               "  - class: mp2p_icp::Solver_Horn\n    enabled: false")));
    EXPECT_FALSE(p.icp->solvers().at(0)->enabled);
}

TEST(shipped_pipelines, every_one_loads_and_an_unknown_name_lists_them)
{
    EXPECT_GE(shipped_pipeline_names().size(), 3u);
    for (const auto& name : shipped_pipeline_names())
    {
        const Pipeline p = pipeline_from_yaml(yaml_from_text(shipped_pipeline(name), name), {name, ""});
        EXPECT_FALSE(p.icp->matchers().empty()) << name;
        EXPECT_FALSE(p.icp->solvers().empty()) << name;
    }
    try
    {
        shipped_pipeline("nothing");
        FAIL();
    }
    catch (const std::invalid_argument& e)
    {
        EXPECT_TRUE(has(e.what(), "icp-3d-lidar"));
    }
}

TEST(shipped_pipelines, the_default_follows_the_shape_of_the_clouds)
{
    auto flat = mrpt::maps::CSimplePointsMap::Create(), room = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 10; i++)
        flat->insertPoint(static_cast<float>(i), static_cast<float>(i * i), 0.3f),
            room->insertPoint(static_cast<float>(3 * i), 0, static_cast<float>(i));
    const metric_map_t two_d = map_of(flat), large = map_of(room), small = map_of(wavy_surface(100, 1));
    EXPECT_EQ(default_pipeline_for(two_d, two_d), "icp-2d-points");
    EXPECT_EQ(default_pipeline_for(two_d, two_d, true), "icp-2d-laser");
    EXPECT_EQ(default_pipeline_for(large, large, true), "icp-3d-point-to-plane");
    EXPECT_EQ(default_pipeline_for(two_d, large), "icp-3d-point-to-plane");
    EXPECT_EQ(default_pipeline_for(small, small), "icp-object");
}
