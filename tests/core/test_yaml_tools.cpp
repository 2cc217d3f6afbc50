#include <mp2p_icp/errors.h>
#include <mp2p_icp/yaml_tools.h>

#include <fstream>

#include "expect_problem.h"
#include "test_data.h"

using namespace mp2p_icp;
using mp2p_icp_test::expect_problem_with;

namespace
{
std::string text_at(const yaml& y, const std::string& key)
{
    return scalar_text(y.asMap().at(key), {});
}

std::string write_file(const std::string& content)
{
    const std::string path = mp2p_icp_test::temp_path(".yaml");
    std::ofstream(path, std::ios::binary) << content;
    return path;
}
}  // namespace

// ---- Reading ----------------------------------------------------------------------------------------------

TEST(YamlTools, NestedAndFlowCollectionsAreRead)
{
    const yaml y = yaml_from_text("a: 1\nb: {c: [2, {d: 3}], e: {f: 4}}\ng:\n  - h: 5\n    i: 6\n  - h: 7\n");
    EXPECT_EQ(text_at(y, "a"), "1");
    EXPECT_EQ(y["b"]["c"](1)["d"].as<int>(), 3);
    EXPECT_EQ(y["b"]["e"]["f"].as<int>(), 4);
    EXPECT_EQ(y["g"](1)["h"].as<int>(), 7);
}

TEST(YamlTools, NumbersKeepTheirDigits)
{
    EXPECT_EQ(text_at(yaml_from_text("x: 0.12345678901234567"), "x"), "0.12345678901234567");
    EXPECT_EQ(text_at(yaml_from_text("x: 1.50"), "x"), "1.50");
}

TEST(YamlTools, ADuplicateKeyIsRefusedWithBothLines)
{
    expect_problem_with<ConfigError>({"f.yaml:3", "'a'", "line 1"},
                                     []() { yaml_from_text("a: 1\nb: 2\na: 3\n", "f.yaml"); });
    expect_problem_with<ConfigError>(
        {"line 5", "'x'", "line 3"},
        []() { yaml_from_text("top:\n  list:\n    - x: 1\n      y: 2\n      x: 3\n"); });
    expect_problem_with<ConfigError>({"'k'"}, []() { yaml_from_text("m: {k: 1, j: {k: 5}, k: 2}\n"); });
    // however it is quoted, and whatever its values are
    expect_problem_with<ConfigError>({"line 2", "'a'", "line 1"},
                                     []() { yaml_from_text("a: [1, 2]\n\"a\": {b: 1}\n"); });
    expect_problem_with<ConfigError>({"line 4", "'a'", "line 1"},
                                     []() { yaml_from_text("a:\n  b: 1\n  c: 2\na: ~\n"); });
}

TEST(YamlTools, TheSameKeyInDifferentMapsIsFine)
{
    const yaml y =
        yaml_from_text("a: {x: 1, y: {x: 2}}\nb:\n  x: 3\n  l: [{x: 4}, {x: 5}, [{x: 6}, {x: 7}]]\nx: a\n");
    EXPECT_EQ(y["a"]["x"].as<int>(), 1);
    EXPECT_EQ(y["a"]["y"]["x"].as<int>(), 2);
    EXPECT_EQ(y["b"]["l"](1)["x"].as<int>(), 5);
}

TEST(YamlTools, AValueEqualToAKeyIsNoDuplicate)
{
    EXPECT_NO_THROW(yaml_from_text("a: b\nb: a\nc: c\n"));
    EXPECT_NO_THROW(yaml_from_text("[a, a, a]"));
    EXPECT_NO_THROW(yaml_from_text("a: [a, a]\nb: [a, b]\n"));
}

TEST(YamlTools, AliasesAreRefusedWithTheirLine)
{
    // MRPT's reader does not know them and would say so without a place.
    expect_problem_with<ConfigError>({"f.yaml:2", "alias"},
                                     []() { yaml_from_text("a: &n 1\nb: *n\n", "f.yaml"); });
    expect_problem_with<ConfigError>({"line 3", "alias"},
                                     []() { yaml_from_text("a: &n {x: 1}\nb:\n  <<: *n\n  z: 2\n"); });
}

TEST(YamlTools, AnchorsDoNotUpsetTheSearchForDuplicates)
{
    const yaml anchored = yaml_from_text("a: &n 12\nb: &m {x: 1}\n");
    EXPECT_EQ(text_at(anchored, "a"), "12");
    EXPECT_EQ(anchored["b"]["x"].as<int>(), 1);
    expect_problem_with<ConfigError>({"line 3", "'a'", "line 1"},
                                     []() { yaml_from_text("a: &n {x: 1}\nb: &m [a]\na: 2\n"); });
}

TEST(YamlTools, AKeyWithoutAValueIsRefusedWithItsLine)
{
    expect_problem_with<ConfigError>({"f.yaml:2", "'params'", "~"},
                                     []() { yaml_from_text("class: X\nparams:\n", "f.yaml"); });
    expect_problem_with<ConfigError>({"line 1", "'b'"}, []() { yaml_from_text("a: {b: }\nc: 1\n"); });
    EXPECT_THROW(yaml_from_text("- \n- 2\n"), ConfigError);
    EXPECT_THROW(yaml_from_text("---\n"), ConfigError);
    EXPECT_EQ(text_at(yaml_from_text("a: \"\"\n"), "a"), "");
}

TEST(YamlTools, AValueWithoutAKeyIsRefused)
{
    EXPECT_THROW(yaml_from_text(": 5\n"), ConfigError);
    EXPECT_THROW(yaml_from_text("{: 5}\n"), ConfigError);
    EXPECT_THROW(yaml_from_text("? \n: 5\n"), ConfigError);
}

TEST(YamlTools, ASyntaxErrorNamesFileAndLine)
{
    expect_problem_with<ConfigError>({"f.yaml:3"},
                                     []() { yaml_from_text("a: 1\nb: 2\nc: [1, 2}\n", "f.yaml"); });
    expect_problem_with<ConfigError>({"line 2"}, []() { yaml_from_text("a: 1\nb: c: d\n"); });
    expect_problem_with<ConfigError>({"line 3"}, []() { yaml_from_text("a:\n  b: 1\n\tc: 2\n"); });
    expect_problem_with<ConfigError>({"line 2"}, []() { yaml_from_text("a: 1\nb: \"open\n"); });
    EXPECT_THROW(yaml_from_text("{a: 1"), ConfigError);
    EXPECT_THROW(yaml_from_text("a: *unknown\n"), ConfigError);
}

TEST(YamlTools, AnEmptyTextIsAnEmptyNode)
{
    for (const char* text : {"", "\n\n", "# a comment\n", "~"})
        EXPECT_TRUE(yaml_from_text(text).isNullNode()) << "'" << text << "'";
}

TEST(YamlTools, ASecondDocumentIsRefusedAndNotSilentlyDropped)
{
    expect_problem_with<ConfigError>({"line 2", "second document"},
                                     []() { yaml_from_text("a: 1\n---\na: 2\n"); });
    EXPECT_EQ(text_at(yaml_from_text("---\na: 1\n...\n"), "a"), "1");
}

TEST(YamlTools, BytesThatAreNoTextAreRefused)
{
    EXPECT_THROW(yaml_from_text(std::string("a: \x01\x02\xff\xfe\x00z\n", 10)), ConfigError);
}

TEST(YamlTools, AFileIsRead)
{
    const std::string path = write_file("a: 5\r\nb: 6\r\n");
    const yaml y = yaml_from_file(path);
    EXPECT_EQ(text_at(y, "a"), "5");
    EXPECT_EQ(text_at(y, "b"), "6");
    write_file("a: 5\na: 6\n");
    expect_problem_with<ConfigError>({path + ":2", "line 1"}, [&]() { yaml_from_file(path); });
}

TEST(YamlTools, AFileThatCannotBeReadOrIsEmptyIsADataErrorWithItsName)
{
    expect_problem_with<DataError>({"/nowhere/at/all.yaml"},
                                   []() { yaml_from_file("/nowhere/at/all.yaml"); });
    expect_problem_with<DataError>({std::filesystem::temp_directory_path().string()},
                                   []() { yaml_from_file(std::filesystem::temp_directory_path().string()); });
    const std::string path = write_file("");
    expect_problem_with<DataError>({path}, [&]() { yaml_from_file(path); });
}

// ---- Places -----------------------------------------------------------------------------------------------

TEST(YamlTools, PlacesReadAsFileLineAndPath)
{
    const YamlPlace place = YamlPlace{"f.yaml", ""}.key("matchers").item(2).key("params");
    EXPECT_EQ(place.path, "matchers[2].params");
    EXPECT_EQ(place.file, "f.yaml");
    const yaml y = yaml_from_text("\n\na: 1\n");
    EXPECT_EQ(place.text(&y.asMap().at("a")), "f.yaml:3: matchers[2].params");
    EXPECT_EQ(place.text(), "f.yaml: matchers[2].params");
    EXPECT_EQ((YamlPlace{"", "a.b"}.text(&y.asMap().at("a"))), "a.b");
    EXPECT_FALSE(YamlPlace{}.text().empty());
}

// ---- Names ------------------------------------------------------------------------------------------------

TEST(YamlTools, TheNearestNameIsTheOneOfLeastEdits)
{
    const std::vector<std::string> known = {"threshold", "thresholdAngularDeg", "pairingsPerPoint"};
    EXPECT_EQ(nearest_name("treshold", known), "threshold");
    EXPECT_EQ(nearest_name("Threshold", known), "threshold");
    EXPECT_EQ(nearest_name("thresholdAngular", known), "thresholdAngularDeg");
    EXPECT_EQ(nearest_name("pairings_per_point", known), "pairingsPerPoint");
    EXPECT_EQ(
        nearest_name("Matcher_Points_Distance", {"Matcher_Point2Line", "Matcher_Points_DistanceThreshold"}),
        "Matcher_Points_DistanceThreshold");
    EXPECT_EQ(nearest_name("zzzzzzzzzzzz", known), "");
    EXPECT_EQ(nearest_name("threshold", {}), "");
    EXPECT_EQ(nearest_name("", known), "");
}

TEST(YamlTools, AnUnknownKeyIsNamedWithItsPlaceAndTheNearestOne)
{
    const yaml y = yaml_from_text("maxIterations: 5\nmaxIteratons: 6\n", "p.yaml");
    expect_problem_with<ConfigError>({"p.yaml:2", "params.maxIteratons", "did you mean 'maxIterations'"},
                                     [&]() {
                                         check_keys(y, {"p.yaml", "params"}, {"maxIterations", "other"});
                                     });
    EXPECT_NO_THROW(check_keys(y, {}, {"maxIterations", "maxIteratons"}));
    expect_problem_with<ConfigError>(
        {"known keys", "aaa", "bbb"},
        []() {
            check_keys(yaml_from_text("something_else_entirely: 1"), {}, {"aaa", "bbb"});
        });
}

TEST(YamlTools, OnlyMapsHaveKeys)
{
    EXPECT_THROW(check_keys(yaml_from_text("[1, 2]"), {}, {"a"}), ConfigError);
    EXPECT_THROW(check_keys(yaml_from_text("text"), {}, {"a"}), ConfigError);
}

TEST(YamlTools, ScalarsOfAnyTypeAreTextWithoutLossOfDigits)
{
    EXPECT_EQ(scalar_text(yaml::node_t(0.1), {}), "0.1");
    EXPECT_EQ(std::stod(scalar_text(yaml::node_t(1.0 / 3), {})), 1.0 / 3);
    EXPECT_EQ(std::stof(scalar_text(yaml::node_t(0.1f), {})), 0.1f);
    EXPECT_EQ(scalar_text(yaml::node_t(int(-7)), {}), "-7");
    EXPECT_EQ(scalar_text(yaml::node_t(uint64_t(UINT64_MAX)), {}), "18446744073709551615");
    EXPECT_EQ(scalar_text(yaml::node_t(true), {}), "true");
    EXPECT_EQ(scalar_text(yaml::node_t(std::string("a b")), {}), "a b");
    const yaml y = yaml_from_text("l: [1]\nm: {a: 1}\nn: ~\n");
    for (const char* key : {"l", "m", "n"})
        expect_problem_with<ConfigError>({"f: p", "single value"},
                                         [&]() {
                                             scalar_text(y.asMap().at(key), YamlPlace{"", "f: p"});
                                         });
}
