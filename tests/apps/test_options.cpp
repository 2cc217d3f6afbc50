#include <mp2p_icp/version.h>

#include "options.h"
#include "run_tools.h"

using namespace mp2p_icp_apps;
using namespace mp2p_icp_test;

TEST(options, read_every_flag)
{
    std::ostringstream out;
    const auto o = parse_options({"--input-local",
                                  "a",
                                  "--input-global=b",
                                  "-c",
                                  "c",
                                  "--config-generators",
                                  "d",
                                  "--config-filters-local",
                                  "e",
                                  "--config-filters-global",
                                  "f",
                                  "--entry-name-filters-local",
                                  "g",
                                  "--entry-name-filters-global",
                                  "h",
                                  "--guess",
                                  "[1,2,3,4,5,6]",
                                  "--ground-truth",
                                  "-1 0 0 0 0 0",
                                  "--output-result",
                                  "i",
                                  "--output-aligned",
                                  "j",
                                  "--snapshot",
                                  "k",
                                  "--threads",
                                  "3",
                                  "-d",
                                  "--profiler"},
                                 out);
    ASSERT_TRUE(o.has_value());
    EXPECT_EQ(o->input_local + o->input_global + o->config + o->config_generators + o->config_filters_local +
                  o->config_filters_global + *o->entry_name_filters_local + *o->entry_name_filters_global +
                  o->output_result + o->output_aligned + o->snapshot,
              "abcdefghijk");
    EXPECT_EQ(o->guess, "[1,2,3,4,5,6]");
    EXPECT_EQ(o->ground_truth, "-1 0 0 0 0 0");
    EXPECT_EQ(o->threads, 3u);
    EXPECT_TRUE(o->generate_debug_log && o->profiler);
    EXPECT_EQ(out.str(), "");
}

TEST(options, have_defaults)
{
    std::ostringstream out;
    const auto o = parse_options({"--input-local", "a", "--input-global", "b"}, out);
    ASSERT_TRUE(o.has_value());
    EXPECT_TRUE(o->config.empty());
    EXPECT_FALSE(o->generate_debug_log || o->profiler || o->threads);
    EXPECT_FALSE(o->entry_name_filters_local);
}

TEST(options, help_shows_examples_for_each_kind_of_input)
{
    for (const char* flag : {"--help", "-h"})
    {
        const auto o = run({flag});
        EXPECT_EQ(o.code, 0);
        EXPECT_EQ(o.err, "");
        for (const char* part : {"--input-local scan.ply", "map.pcd", ".xyz", ".mm", ".bin", ".rawlog:12",
                                 ".simplemap:3", "--describe", "--ground-truth", "Exit code"})
            EXPECT_TRUE(contains(o.out, part)) << part;
    }
}

TEST(options, version_names_both_libraries)
{
    const auto o = run({"--version"});
    EXPECT_EQ(o.code, 0);
    EXPECT_TRUE(contains(o.out, std::string("icp-run ") + MP2P_ICP_VERSION)) << o.out;
    EXPECT_TRUE(contains(o.out, "MRPT 2.")) << o.out;
}

TEST(options, mistakes_are_one_line)
{
    expect_complaint(run({}), {"--input-local", "required"});
    expect_complaint(run({"--input-local", "a"}), {"--input-global", "required"});
    expect_complaint(run({"--input-lokal", "a"}), {"--input-lokal", "did you mean '--input-local'"});
    expect_complaint(run({"--input-local", "a", "--input-global", "b", "stray"}), {"stray"});
    expect_complaint(run({"--input-local"}), {"--input-local"});
    expect_complaint(run({"--input-local", "a", "--input-local", "b", "--input-global", "c"}),
                     {"--input-local"});
    for (const char* n : {"0", "-1", "two", "1.5", "100000"})
        expect_complaint(run({"--input-local", "a", "--input-global", "b", "--threads", n}), {"--threads"});
}
