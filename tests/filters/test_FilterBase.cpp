#include <mp2p_icp_filters/FilterBoundingBox.h>
#include <mp2p_icp_filters/FilterDecimateVoxels.h>
#include <mp2p_icp_filters/FilterDeleteLayer.h>
#include <mrpt/maps/COccupancyGridMap2D.h>

#include <fstream>

#include "filter_test_tools.h"
#include "test_data.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::ConfigError;
using mp2p_icp::metric_map_t;

namespace
{
const std::string DECIMATE_THEN_DELETE = R"(
- class_name: mp2p_icp_filters::FilterDecimateVoxels
  params:
    input_pointcloud_layer: raw
    output_pointcloud_layer: decimated
    voxel_filter_resolution: 1.0
    decimate_method: DecimateMethod::FirstPoint
- class_name: mp2p_icp_filters::FilterDeleteLayer
  params:
    pointcloud_layer_to_remove: raw
)";

FilterPipeline pipeline_of(const std::string& text)
{
    return filter_pipeline_from_yaml(mp2p_icp::yaml_from_text(text, "test.yaml"), {"test.yaml", "filters"},
                                     mrpt::system::LVL_WARN);
}

void expect_pipeline_refused(const std::string& text, const std::vector<std::string>& parts)
{
    expect_problem<ConfigError>([&]() { pipeline_of(text); }, parts);
}

std::string file_with(const std::string& text)
{
    const auto path = temp_path(".yaml");
    std::ofstream(path) << text;
    return path;
}
}  // namespace

TEST(FilterPipeline, RunsItsFiltersInOrder)
{
    const auto pipeline = pipeline_of(DECIMATE_THEN_DELETE);
    ASSERT_EQ(pipeline.size(), 2u);
    metric_map_t m;
    m.layers["raw"] = cloud_of({{0.1f, 0, 0}, {0.2f, 0, 0}, {7, 0, 0}});
    mrpt::system::CTimeLogger profiler(true, "", false);
    apply_filter_pipeline(pipeline, m, &profiler);
    EXPECT_EQ(m.layers.size(), 1u);
    EXPECT_EQ(m.point_layer("decimated")->size(), 2u);
    for (const char* name : {"mp2p_icp_filters::FilterDecimateVoxels", "mp2p_icp_filters::FilterDeleteLayer"})
        EXPECT_GT(profiler.getMeanTime(name), 0.0) << name;
    EXPECT_EQ(pipeline[0]->getMinLoggingLevel(), mrpt::system::LVL_WARN);
    profiler.clear(true);
}

TEST(FilterPipeline, AnEmptyOrNullListIsAnEmptyPipeline)
{
    EXPECT_TRUE(pipeline_of("[]").empty());
    EXPECT_TRUE(pipeline_of("~").empty());
    metric_map_t m;
    apply_filter_pipeline({}, m);
    EXPECT_TRUE(m.empty());
}

TEST(FilterPipeline, AClassUnderAnotherNameIsRefusedWithTheNearestOne)
{
    expect_pipeline_refused(
        "- class_name: mp2p_icp_filters::FilterDecimateVoxel\n",
        {"test.yaml:1", "filters[0].class_name", "did you mean 'mp2p_icp_filters::FilterDecimateVoxels'"});
    expect_pipeline_refused("- class_name: FilterByRange\n",
                            {"did you mean 'mp2p_icp_filters::FilterByRange'"});
    expect_pipeline_refused("- class_name: mp2p_icp::FilterByRange\n",
                            {"did you mean 'mp2p_icp_filters::FilterByRange'"});
    expect_pipeline_refused("- class_name: xyz\n", {"known classes", "mp2p_icp_filters::FilterBoundingBox"});
}

TEST(FilterPipeline, AClassThatIsNoFilterIsRefused)
{
    expect_pipeline_refused("- class_name: mp2p_icp_filters::Generator\n", {"test.yaml:1", "not a filter"});
    expect_pipeline_refused("- class_name: mp2p_icp_filters::FilterBase\n", {"test.yaml:1", "abstract"});
}

TEST(FilterPipeline, WrongEntriesAreRefusedWithTheirPlace)
{
    expect_pipeline_refused("class_name: mp2p_icp_filters::FilterByRange\n",
                            {"test.yaml:1", "filters", "list"});
    expect_pipeline_refused("- 3\n", {"filters[0]", "map"});
    expect_pipeline_refused("- params: ~\n", {"filters[0]", "'class_name' is missing"});
    expect_pipeline_refused("- class_name: mp2p_icp_filters::FilterDeleteLayer\n  parms:\n    a: 1\n",
                            {"test.yaml:2", "filters[0].parms", "did you mean 'params'"});
    expect_pipeline_refused("- class_name: mp2p_icp_filters::FilterDeleteLayer\n  params: [1, 2]\n",
                            {"filters[0].params", "map"});
    expect_pipeline_refused("- class_name: [a, b]\n", {"test.yaml:1", "class_name"});
    expect_pipeline_refused(DECIMATE_THEN_DELETE + "    no_such_key: 1\n",
                            {"test.yaml:11", "filters[1].params.no_such_key"});
    expect_pipeline_refused(DECIMATE_THEN_DELETE + "    pointcloud_layer_to_remove: 1\n",
                            {"test.yaml:11", "twice", "10"});
}

TEST(FilterPipeline, ParamsMayBeAbsentOrNull)
{
    // These filters need some, and say which: so params were read as "none given".
    for (const char* params : {"", "  params: ~\n", "  params: {}\n"})
        expect_pipeline_refused(std::string("- class_name: mp2p_icp_filters::FilterDeleteLayer\n") + params,
                                {"pointcloud_layer_to_remove", "missing"});
}

TEST(FilterPipeline, PluginsAreKnownAndRefused)
{
    expect_pipeline_refused("- class_name: mine::FilterX\n  plugin: libmine.so\n",
                            {"test.yaml:2", "plugins are not supported", "register"});
}

TEST(FilterPipeline, FromAFileWithNamedListsBeside)
{
    const auto path = file_with(
        "filters:\n"
        "  - class_name: mp2p_icp_filters::FilterDeleteLayer\n"
        "    params: {pointcloud_layer_to_remove: raw}\n"
        "generators: []\n"
        "final_filters:\n"
        "  - class_name: whatever::Class\n"
        "    params: ~\n");
    EXPECT_EQ(filter_pipeline_from_yaml_file(path).size(), 1u);
}

TEST(FilterPipeline, MistakesInAFileNameTheFileAndTheLine)
{
    const auto refused = [](const std::string& text, const std::vector<std::string>& parts)
    {
        const auto path = file_with(text);
        std::vector<std::string> all = {path};
        all.insert(all.end(), parts.begin(), parts.end());
        expect_problem<ConfigError>([&]() { filter_pipeline_from_yaml_file(path); }, all);
    };
    refused("filter:\n  - class_name: mp2p_icp_filters::FilterDeleteLayer\n", {"'filters' is missing"});
    refused("filters: []\nverbose: 3\n", {":2", "unknown key 'verbose'"});
    refused("filters: []\nnames: [a, b]\n", {":2", "unknown key 'names'"});
    refused("- a\n", {"expected a map"});
    refused("filters:\n  - class_name: mp2p_icp_filters::FilterDeleteLayer\n    params: {a: 1}\n",
            {":3", "filters[0].params.a"});
    refused("filters: [\n", {});
    expect_problem<mp2p_icp::DataError>([]() { filter_pipeline_from_yaml_file("/no/such/file.yaml"); },
                                        {"/no/such/file.yaml"});
}

TEST(GetOrCreatePointLayer, MakesALayerOnceAndFindsItAgain)
{
    metric_map_t m;
    const auto made = GetOrCreatePointLayer(m, "a", "mrpt::maps::CPointsMapXYZI");
    EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::maps::CPointsMapXYZI>(made));
    EXPECT_EQ(GetOrCreatePointLayer(m, "a"), made) << "one that is there keeps its class";
    EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::maps::CSimplePointsMap>(GetOrCreatePointLayer(m, "b")));
    EXPECT_EQ(m.layers.size(), 2u);
}

TEST(GetOrCreatePointLayer, RefusesWhatIsNotACloud)
{
    metric_map_t m;
    m.layers["grid"] = mrpt::maps::COccupancyGridMap2D::Create();
    expect_problem<std::invalid_argument>([&]() { GetOrCreatePointLayer(m, "grid"); },
                                          {"'grid'", "COccupancyGridMap2D"});
    expect_problem<std::invalid_argument>([&]()
                                          { GetOrCreatePointLayer(m, "c", "mrpt::maps::CSimplePointMap"); },
                                          {"did you mean 'mrpt::maps::CSimplePointsMap'"});
    EXPECT_EQ(m.layers.size(), 1u);
}
