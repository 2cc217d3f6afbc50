#include <mp2p_icp/WeightParameters.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>

#include "robust_kernel_names.h"

namespace mp2p_icp
{
namespace
{
/// A number that need not be there.
void declare_optional(ParameterDeclaration& declare, const std::string& name, std::optional<double>& value,
                      const std::string& unit, const Range& range, const std::string& help,
                      const std::string& default_text)
{
    const auto load = [&value, unit, range, name](const yaml::node_t& node, const YamlPlace& place)
    {
        double number = 0;
        ParameterDeclaration one;
        one.number(name, number, unit, range, "");
        one.entries().front().load(node, place);
        value = number;
    };
    const auto save = [&value]() { return value ? yaml::node_t(to_text(*value)) : yaml::node_t(); };
    declare.custom({name, "number", unit, range.text(), help, default_text, false, load, save});
}

void declare_sign(ParameterDeclaration& declare, const std::string& name, DirectionSign& sign,
                  const std::string& of)
{
    declare.choice<DirectionSign>(name, sign, "DirectionSign",
                                  {{DirectionSign::Free, "Free"}, {DirectionSign::Oriented, "Oriented"}},
                                  "whether " + of + " have a side; Free: u and -u are the same");
}
}  // namespace

void PairWeights::declare_parameters(ParameterDeclaration& declare)
{
    declare.number("pt2pt", pt2pt, "", Range::not_negative(), "weight of point-point pairings");
    declare.number("pt2ln", pt2ln, "", Range::not_negative(), "weight of point-line pairings");
    declare.number("pt2pl", pt2pl, "", Range::not_negative(), "weight of point-plane pairings");
    declare.number("ln2ln", ln2ln, "", Range::not_negative(),
                   "weight of the positions of line-line pairings");
    declare.number("pl2pl", pl2pl, "", Range::not_negative(),
                   "weight of the positions of plane-plane pairings");
    declare_optional(declare, "ln2ln_direction", ln2ln_direction, "1/rad^2", Range::not_negative(),
                     "weight of the directions of line-line pairings",
                     "ln2ln times the mean squared radius of the points");
    declare_optional(declare, "pl2pl_direction", pl2pl_direction, "1/rad^2", Range::not_negative(),
                     "weight of the normals of plane-plane pairings",
                     "pl2pl times the mean squared radius of the points");
    declare_sign(declare, "ln2ln_sign", ln2ln_sign, "directions of lines");
    declare_sign(declare, "pl2pl_sign", pl2pl_sign, "normals of planes");
}

namespace
{
/// Release 0.2.2 had an angular kernel under these keys. `use_robust_kernel: false` was required there, so it
/// must load.
void declare_keys_of_0_2_2(ParameterDeclaration& declare)
{
    const auto must_be_false = [](const yaml::node_t& node, const YamlPlace& place)
    {
        bool value = false;
        ParameterDeclaration flag;
        flag.flag("use_robust_kernel", value, "");
        flag.entries().front().load(node, place);
        if (value)
            throw ConfigError(place.text(&node) +
                              ": the angular kernel of release 0.2.2 is not offered; use 'robust_kernel: "
                              "RobustKernel::Cauchy' with "
                              "'robust_kernel_param' in metres");
    };
    declare.custom({"use_robust_kernel",
                    "true/false",
                    "",
                    "false",
                    "key of release 0.2.2; see robust_kernel",
                    "",
                    false,
                    must_be_false,
                    {}});
    declare.custom({"robust_kernel_scale",
                    "number",
                    "",
                    "",
                    "key of release 0.2.2, without effect",
                    "",
                    false,
                    [](const auto& node, const auto& place) { scalar_text(node, place); },
                    {}});
}
}  // namespace

void WeightParameters::declare_parameters(ParameterDeclaration& declare)
{
    declare.flag("use_scale_outlier_detector", use_scale_outlier_detector,
                 "reject point pairings whose distances to the centroids differ by more than a ratio");
    declare.number("scale_outlier_threshold", scale_outlier_threshold, "", {1, 1e9, true, false},
                   "the ratio for use_scale_outlier_detector");
    declare.choice<OutlierRejection>("outlier_rejection", outlier_rejection, "OutlierRejection",
                                     {{OutlierRejection::None, "None"},
                                      {OutlierRejection::NoiseScale, "NoiseScale"},
                                      {OutlierRejection::ConsistencyGraph, "ConsistencyGraph"},
                                      {OutlierRejection::GncGemanMcClure, "GncGemanMcClure"},
                                      {OutlierRejection::GncTruncated, "GncTruncated"}},
                                     "how outliers are found, without an estimate of the pose");
    declare.number("outlier_threshold", outlier_threshold, "m", Range::positive(),
                   "largest residual of an inlier, for outlier_rejection");
    declare_optional(declare, "sigma", sigma, "m", Range::positive(),
                     "standard deviation of a residual of weight 1, for predicted deviations",
                     "from the residuals");
    declare.group("pair_weights", pair_weights, "weights per kind of pairing");
    declare.choice<RobustKernel>("robust_kernel", robust_kernel, "RobustKernel", robust_kernel_names(),
                                 "lets pairings with large residuals at the current estimate weigh less");
    declare.number("robust_kernel_param", robust_kernel_param, "m", Range::positive(), "scale of the kernel");
    declare_keys_of_0_2_2(declare);
}

}  // namespace mp2p_icp
