#include <mp2p_icp/WeightParameters.h>
#include <mp2p_icp/errors.h>

#include <sstream>

#include "expect_problem.h"

using namespace mp2p_icp;

namespace
{
WeightParameters loaded(const std::string& text)
{
    WeightParameters wp;
    wp.load_parameters(yaml_from_text(text, "f.yaml"), {"f.yaml", "w"});
    return wp;
}
void expect_refused(const std::string& text, const std::vector<std::string>& parts)
{
    mp2p_icp_test::expect_problem_with<ConfigError>(parts, [&]() { loaded(text); });
}
}  // namespace

TEST(WeightParameters, AllKeysAreLoaded)
{
    const WeightParameters wp = loaded(
        "use_scale_outlier_detector: true\nscale_outlier_threshold: 1.5\nrobust_kernel: "
        "RobustKernel::Cauchy\n"
        "robust_kernel_param: 0.25\npair_weights: {pt2pt: 2, pt2ln: 3, pt2pl: 4, ln2ln: 5, pl2pl: 0}\n");
    EXPECT_TRUE(wp.use_scale_outlier_detector);
    EXPECT_EQ(wp.scale_outlier_threshold, 1.5);
    EXPECT_EQ(wp.robust_kernel, RobustKernel::Cauchy);
    EXPECT_EQ(wp.robust_kernel_param, 0.25);
    EXPECT_EQ(wp.pair_weights.pt2pt, 2);
    EXPECT_EQ(wp.pair_weights.pt2ln, 3);
    EXPECT_EQ(wp.pair_weights.pt2pl, 4);
    EXPECT_EQ(wp.pair_weights.ln2ln, 5);
    EXPECT_EQ(wp.pair_weights.pl2pl, 0);
    EXPECT_EQ(loaded("robust_kernel: GemanMcClure").robust_kernel, RobustKernel::GemanMcClure);
    EXPECT_EQ(loaded("robust_kernel: RobustKernel::Huber").robust_kernel, RobustKernel::Huber);
    EXPECT_EQ(loaded("robust_kernel: Tukey").robust_kernel, RobustKernel::Tukey);
    EXPECT_EQ(loaded("robust_kernel: Truncated").robust_kernel, RobustKernel::Truncated);
}

TEST(WeightParameters, KeysOfRelease022Load)
{
    const WeightParameters wp = loaded(
        "use_scale_outlier_detector: true\nscale_outlier_threshold: 1.2\nuse_robust_kernel: false\n"
        "robust_kernel_param: 0.1\nrobust_kernel_scale: 400\n");
    EXPECT_EQ(wp.robust_kernel, RobustKernel::None);
    EXPECT_NO_THROW(loaded("use_robust_kernel: False"));
    expect_refused("use_scale_outlier_detector: true\nuse_robust_kernel: true",
                   {"f.yaml:2", "0.2.2", "robust_kernel"});
}

TEST(WeightParameters, ValuesThatMakeNoSenseAreRefused)
{
    expect_refused("scale_outlier_threshold: 1", {"w.scale_outlier_threshold"});
    expect_refused("robust_kernel_param: 0", {"w.robust_kernel_param"});
    expect_refused("pair_weights: {pt2pt: -1}", {"w.pair_weights.pt2pt"});
    expect_refused("pair_weights: {pt2pn: 1}", {"w.pair_weights.pt2pn", "did you mean"});
    expect_refused("robust_kernel: RobustKernel::GemanMcClur",
                   {"w.robust_kernel", "RobustKernel::GemanMcClure"});
}

TEST(WeightParameters, WhatIsSavedLoadsAgain)
{
    WeightParameters wp;
    wp.use_scale_outlier_detector = true, wp.scale_outlier_threshold = 1.0 + 1.0 / 3;
    wp.robust_kernel = RobustKernel::GemanMcClure, wp.robust_kernel_param = 0.1, wp.pair_weights.pl2pl = 0.7;
    WeightParameters back;
    back.load_parameters(wp.save_parameters());
    EXPECT_TRUE(back.use_scale_outlier_detector);
    EXPECT_EQ(back.scale_outlier_threshold, wp.scale_outlier_threshold);
    EXPECT_EQ(back.robust_kernel, wp.robust_kernel);
    EXPECT_EQ(back.robust_kernel_param, 0.1);
    EXPECT_EQ(back.pair_weights.pl2pl, 0.7);
    std::ostringstream text;
    wp.save_parameters().printAsYAML(text);
    EXPECT_NO_THROW(loaded(text.str())) << text.str();
}
