#include <mp2p_icp_filters/Generator.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationPointCloud.h>
#include <mrpt/obs/CRawlog.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "filter_test_tools.h"
#include "test_data.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::ConfigError;
using mp2p_icp::metric_map_t;
using mrpt::obs::CObservation2DRangeScan;
using mrpt::poses::CPose3D;

namespace
{
/// Three rays of 2 m to the right, forward and to the left, from a sensor 1 m ahead of the robot's centre.
CObservation2DRangeScan::Ptr scan(const std::string& label)
{
    const auto o = CObservation2DRangeScan::Create();
    o->aperture = static_cast<float>(M_PI);
    o->resizeScanAndAssign(3, 2.0f, true);
    o->sensorPose = CPose3D(1, 0, 0, 0, 0, 0);
    o->sensorLabel = label;
    return o;
}

mrpt::obs::CObservationPointCloud::Ptr point_cloud(const std::string& label)
{
    const auto o = mrpt::obs::CObservationPointCloud::Create();
    const auto cloud = mrpt::maps::CPointsMapXYZI::Create();
    cloud->insertPoint(1, 2, 3);
    cloud->setPointIntensity(0, 0.5f);
    o->pointcloud = cloud;
    o->sensorLabel = label;
    return o;
}

Generator generator_of(const std::string& params)
{
    return make_filter<Generator>(params);
}

void expect_generator_refused(const std::string& params, const std::vector<std::string>& parts)
{
    expect_refused<Generator>(params, parts);
}

void expect_point(const metric_map_t& m, const std::string& layer, size_t index,
                  const mrpt::math::TPoint3D& expected)
{
    mrpt::math::TPoint3D p;
    m.point_layer(layer)->getPoint(index, p);
    EXPECT_LT((p - expected).norm(), 1e-6) << p.asString() << " is not " << expected.asString();
}
}  // namespace

TEST(Generator, MakesThePointsOfAnObservationWithSensorAndRobotPose)
{
    metric_map_t m;
    const Generator g;
    EXPECT_TRUE(g.process(*scan("laser"), m));
    ASSERT_EQ(m.point_layer("raw")->size(), 3u);
    expect_point(m, "raw", 1, {3, 0, 0});
    EXPECT_TRUE(g.process(*scan("laser"), m, CPose3D(10, 0, 0, M_PI / 2, 0, 0)));
    ASSERT_EQ(m.point_layer("raw")->size(), 6u);
    expect_point(m, "raw", 1, {3, 0, 0});  // earlier points stay
    expect_point(m, "raw", 3, {12, 1, 0});
    expect_point(m, "raw", 4, {10, 3, 0});
    expect_point(m, "raw", 5, {8, 1, 0});
}

TEST(Generator, TakesOnlyTheClassesAndLabelsItIsMeantFor)
{
    const auto takes = [](const std::string& params, const mrpt::obs::CObservation& o)
    {
        metric_map_t m;
        const bool taken = generator_of(params).process(o, m);
        EXPECT_EQ(m.layers.size(), taken ? 1u : 0u) << "no layer for observations of others";
        return taken;
    };
    EXPECT_TRUE(takes("{}", *scan("laser")));
    EXPECT_TRUE(takes("process_class_names_regex: mrpt::obs::CObservation2DRangeScan\n", *scan("laser")));
    EXPECT_TRUE(takes("process_class_names_regex: CObservation2D.*\n", *scan("laser")));
    EXPECT_FALSE(takes("process_class_names_regex: CObservation2D\n", *scan("laser")))
        << "the whole name must match";
    EXPECT_FALSE(takes("process_class_names_regex: CObservation2D.*\n", *point_cloud("laser")));
    EXPECT_TRUE(
        takes("process_class_names_regex: 'CObservation2D.*|CObservationPoint.*'\n", *point_cloud("laser")));
    EXPECT_TRUE(takes("process_sensor_labels_regex: 'laser[12]'\n", *scan("laser2")));
    EXPECT_FALSE(takes("process_sensor_labels_regex: 'laser[12]'\n", *scan("laser3")));
    EXPECT_TRUE(takes("process_sensor_labels_regex: '.*'\n", *scan("")));
}

TEST(Generator, AnEmptyExpressionMakesTheLayerAndInsertsNothing)
{
    for (const char* key : {"process_class_names_regex", "process_sensor_labels_regex"})
    {
        metric_map_t m;
        const auto g = generator_of(
            std::string(key) +
            ": ''\ntarget_layer: later\nmetric_map_definition: {class: 'mrpt::maps::CPointsMapXYZI'}\n");
        EXPECT_FALSE(g.process(*scan(""), m)) << "not even for an empty label";
        ASSERT_EQ(m.layers.size(), 1u);
        EXPECT_TRUE(m.point_layer("later")->empty());
        EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::maps::CPointsMapXYZI>(m.layers["later"]));
    }
}

TEST(Generator, TheLayerClassKeepsIntensity)
{
    metric_map_t m;
    generator_of("metric_map_definition:\n  class: mrpt::maps::CPointsMapXYZI\n")
        .process(*point_cloud("x"), m);
    EXPECT_EQ(layer_fields(m, "raw"), (std::vector<std::vector<float>>{{1, 2, 3, 0.5f}}));
}

TEST(Generator, AnObservationWithoutPointsIsSkippedOrAnError)
{
    metric_map_t m;
    mrpt::obs::CObservationOdometry odometry;
    odometry.sensorLabel = "wheels";
    EXPECT_FALSE(Generator().process(odometry, m));
    EXPECT_TRUE(m.layers.empty());
    const auto strict = generator_of("throw_on_unhandled_observation_class: true\n");
    expect_problem<std::runtime_error>([&]() { strict.process(odometry, m); },
                                       {"wheels", "CObservationOdometry"});
    EXPECT_TRUE(strict.process(*scan("laser"), m));
}

TEST(Generator, ALayerThatIsNotACloudIsRefused)
{
    metric_map_t m;
    m.layers["raw"] = mrpt::maps::COccupancyGridMap2D::Create();
    expect_problem<std::invalid_argument>([&]() { Generator().process(*scan("laser"), m); },
                                          {"'raw'", "COccupancyGridMap2D"});
}

TEST(Generator, InterpolatesScansAsTold)
{
    metric_map_t m;
    generator_of("scan_2d_interpolate_up_to: 5\nscan_2d_interpolation_step: 0.1\n")
        .process(*scan("laser"), m);
    // Two segments of sqrt(8) = 2.83 m: 28 points in each.
    EXPECT_EQ(m.point_layer("raw")->size(), 3u + 2 * 28);
}

// ---- Several observations and generators ------------------------------------------------------------------

TEST(ApplyGenerators, EveryObservationOfAFrameIsOfferedToEveryGenerator)
{
    mrpt::obs::CSensoryFrame frame;
    frame.insert(scan("front"));
    frame.insert(scan("back"));
    frame.insert(mrpt::obs::CObservationOdometry::Create());
    const auto cloud = point_cloud("lidar");
    cloud->pointcloud->insertPoint(std::numeric_limits<float>::quiet_NaN(), 0, 0);
    frame.insert(cloud);
    const auto generators = generators_from_yaml(mp2p_icp::yaml_from_text(R"(
- class_name: mp2p_icp_filters::Generator
  params: {target_layer: scans, process_class_names_regex: CObservation2DRangeScan}
- class_name: mp2p_icp_filters::Generator
  params: {target_layer: all}
)"));
    metric_map_t m;
    const auto report = apply_generators(generators, frame, m, CPose3D(0, 0, 5, 0, 0, 0));
    EXPECT_EQ(m.point_layer("scans")->size(), 6u);
    EXPECT_EQ(m.point_layer("all")->size(), 7u);
    EXPECT_EQ(report.points_made, 13u);
    EXPECT_EQ(report.points_dropped_nonfinite, 1u);
    EXPECT_EQ(report.observations_used, 3u);
    expect_point(m, "all", 6, {1, 2, 8});
    expect_point(m, "scans", 4, {3, 0, 5});
}

TEST(ApplyGenerators, AFrameOfARealRawlog)
{
    const auto path = mrpt_dataset("2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog");
    MP2P_ICP_SKIP_WITHOUT(path);
    mrpt::obs::CRawlog log;
    ASSERT_TRUE(log.loadFromRawLogFile(path));
    for (size_t i = 0; i < log.size(); i++)
    {
        const auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(log.getAsGeneric(i));
        if (!frame) continue;
        metric_map_t m;
        const auto report = apply_generators(generators_from_yaml({}), *frame, m);
        EXPECT_EQ(report.observations_used, 1u);
        EXPECT_EQ(report.points_made, m.size());
        EXPECT_GT(m.size(), 100u);
        const auto box = m.bounding_box();
        EXPECT_NEAR(box->min.z, 0.3, 1e-6) << "the laser's height on this robot";
        return;
    }
    FAIL() << "no frame";
}

// ---- YAML -------------------------------------------------------------------------------------------------

TEST(Generator, OlderNameOfTheLayerIsTheSame)
{
    EXPECT_EQ(generator_of("target_pointcloud_layer: x\n").target_layer, "x");
    EXPECT_EQ(generator_of("target_layer: x\n").target_layer, "x");
    expect_generator_refused("target_layer: x\ntarget_pointcloud_layer: y\n",
                             {"test.yaml:2", "older name", "target_layer"});
    EXPECT_TRUE(generator_of("target_pointcloud_layer: x\n").save_parameters().has("target_layer"));
    EXPECT_FALSE(
        generator_of("target_pointcloud_layer: x\n").save_parameters().has("target_pointcloud_layer"));
}

TEST(Generator, MistakesAreRefusedWithTheirPlace)
{
    expect_generator_refused("process_class_names_regex: '(['\n",
                             {"process_class_names_regex", "([", "regular expression"});
    expect_generator_refused("process_sensor_labels_regex: '*'\n",
                             {"process_sensor_labels_regex", "regular expression"});
    expect_generator_refused("target_layer: ''\n", {"target_layer"});
    expect_generator_refused("target_layr: a\n", {"test.yaml:1", "did you mean 'target_layer'"});
    expect_generator_refused(
        "metric_map_definition:\n  class: mrpt::maps::CSimplePointMap\n",
        {"test.yaml:2", "metric_map_definition.class", "did you mean 'mrpt::maps::CSimplePointsMap'"});
    expect_generator_refused("metric_map_definition:\n  class: mrpt::maps::COccupancyGridMap2D\n",
                             {"test.yaml:2", "point cloud"});
    expect_generator_refused(
        "metric_map_definition:\n  class: mrpt::maps::CSimplePointsMap\n  insertOpts: {a: 1}\n",
        {"test.yaml:3", "insertOpts", "not supported"});
    expect_generator_refused(
        "metric_map_definition:\n  class: mrpt::maps::CSimplePointsMap\n  plugin: x.so\n",
        {"test.yaml:3", "plugin"});
    expect_generator_refused("metric_map_definition:\n  clas: mrpt::maps::CSimplePointsMap\n",
                             {"test.yaml:2", "did you mean 'class'"});
    expect_generator_refused("metric_map_definition: {}\n", {"test.yaml:1", "'class' is missing"});
    expect_generator_refused("metric_map_definition: 3\n", {"test.yaml:1", "expected a map"});
    expect_generator_refused("metric_map_definition_ini_file: a.ini\n",
                             {"test.yaml:1", "INI files are not supported"});
    expect_generator_refused("plugin: a.so\n", {"test.yaml:1", "plugins are not supported"});
    expect_generator_refused("scan_2d_interpolate_up_to: -1\n", {"test.yaml:1", "scan_2d_interpolate_up_to"});
    expect_generator_refused("scan_2d_interpolation_step: 0\n",
                             {"test.yaml:1", "scan_2d_interpolation_step"});
}

TEST(Generator, SavedParametersLoadAgain)
{
    const auto g = generator_of(
        "target_layer: a\nprocess_sensor_labels_regex: ''\nscan_2d_interpolate_up_to: 0.25\n"
        "metric_map_definition: {class: 'mrpt::maps::CPointsMapXYZI'}\n");
    Generator h;
    h.initialize(g.save_parameters());
    EXPECT_EQ(h.target_layer, "a");
    EXPECT_EQ(h.process_sensor_labels_regex, "");
    EXPECT_EQ(h.points_options.scan_2d_interpolate_up_to, 0.25);
    EXPECT_EQ(h.layer_class, "mrpt::maps::CPointsMapXYZI");
}

TEST(Generator, DescribesEveryKey)
{
    const auto text = Generator().describe_parameters();
    for (const char* key :
         {"target_layer", "process_class_names_regex", "process_sensor_labels_regex",
          "throw_on_unhandled_observation_class", "scan_2d_interpolate_up_to", "scan_2d_interpolation_step",
          "metric_map_definition", "metric_map_definition_ini_file", "plugin"})
        EXPECT_NE(text.find(std::string("  ") + key + ":"), std::string::npos) << key;
    EXPECT_NE(text.find("target_pointcloud_layer"), std::string::npos);
}

TEST(GeneratorsFromYaml, ANullOrEmptyListIsOneDefaultGenerator)
{
    for (const char* text : {"~", "[]"})
    {
        const auto set = generators_from_yaml(mp2p_icp::yaml_from_text(text));
        ASSERT_EQ(set.size(), 1u);
        EXPECT_EQ(set[0]->target_layer, "raw");
        EXPECT_EQ(set[0]->process_class_names_regex, ".*");
    }
}

TEST(GeneratorsFromYaml, FromAFile)
{
    const auto path = temp_path(".yaml");
    std::ofstream(path)
        << "generators:\n  - class_name: mp2p_icp_filters::Generator\n    params: {target_layer: b}\n"
        << "filters:\n  - class_name: mp2p_icp_filters::FilterDeleteLayer\n";
    const auto set = generators_from_yaml_file(path);
    ASSERT_EQ(set.size(), 1u);
    EXPECT_EQ(set[0]->target_layer, "b");
    std::ofstream(path) << "generator:\n  - class_name: mp2p_icp_filters::Generator\n";
    expect_problem<ConfigError>([&]() { generators_from_yaml_file(path); },
                                {path, "'generators' is missing"});
    std::ofstream(path) << "generators:\n  - class_name: mp2p_icp_filters::Generatr\n";
    expect_problem<ConfigError>([&]() { generators_from_yaml_file(path); },
                                {path + ":2", "did you mean 'mp2p_icp_filters::Generator'"});
    std::ofstream(path) << "generators:\n  - class_name: mp2p_icp_filters::FilterDeleteLayer\n";
    expect_problem<ConfigError>([&]() { generators_from_yaml_file(path); }, {path + ":2", "not a generator"});
}
