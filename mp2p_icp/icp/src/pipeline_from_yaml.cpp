#include <mp2p_icp/errors.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/modules_from_yaml.h>

#include <algorithm>

namespace mp2p_icp
{
namespace
{
/// `enabled`, `weight`: a key beside `params` that sets one value.
template <class Declare>
void load_key(const ModuleEntry& entry, const std::string& key, const Declare& declare_into)
{
    if (!entry.entry.has(key)) return;
    ParameterDeclaration declare;
    declare_into(declare);
    declare.entries().front().load(entry.entry.asMap().at(key), entry.place.key(key));
}

/// The initialized modules of a list of `{class, params, enabled, ...}`, each given to `add`.
template <class Module, class Add>
void for_each_module(const yaml& list, const YamlPlace& place, ModuleFormat format, const Add& add)
{
    format.class_key = "class";
    format.more_keys.push_back("enabled");
    for (const ModuleEntry& entry : module_entries(list, place, CLASS_ID(Module), format))
    {
        auto module = std::dynamic_pointer_cast<Module>(entry.object);
        module->initialize(entry.params, entry.params_place);
        load_key(entry, "enabled", [&](ParameterDeclaration& d) { d.flag("enabled", module->enabled, ""); });
        add(module, entry);
    }
}

const std::vector<std::string> TOP_KEYS = {"class_name", "params",  "solvers", "matchers", "quality",
                                           "generators", "filters", "plugin",  "derived"};

bool is_top_key(const std::string& name)
{
    return std::find(TOP_KEYS.begin(), TOP_KEYS.end(), name) != TOP_KEYS.end();
}

void check_top(const yaml& config, const YamlPlace& place)
{
    if (!config.isMap())
        throw ConfigError(place.text(&config.node()) + ": a pipeline must be a map of keys and values");
    for (const auto& [key, value] : config.asMap())
        if (!is_top_key(std::string(key.internalAsStr())) &&
            (!is_list_of_modules(value) || value.size() == 0))
            throw_unknown_key(place, key, TOP_KEYS);
    refuse_plugin(config, place);
    if (config.has("derived"))
        throw ConfigError(place.key("derived").text(&config.asMap().at("derived")) +
                          ": 'derived' belongs to ICP_LibPointmatcher, which this library does not have; use "
                          "'params', 'matchers' and "
                          "'solvers'");
    for (const char* key : {"class_name", "params", "quality"}) required_key(config, place, key);
}
}  // namespace

void ICP::initialize_solvers(const yaml& list, const YamlPlace& place)
{
    solvers_.clear();
    for_each_module<Solver>(list, place, {"solver"},
                            [&](const auto& solver, const auto&) { solvers_.push_back(solver); });
}

void ICP::initialize_matchers(const yaml& list, const YamlPlace& place)
{
    matchers_.clear();
    for_each_module<Matcher>(list, place, {"matcher"},
                             [&](const auto& matcher, const auto&) { matchers_.push_back(matcher); });
}

void ICP::initialize_quality_evaluators(const yaml& list, const YamlPlace& place)
{
    quality_evaluators_.clear();
    for_each_module<QualityEvaluator>(list, place, {"quality evaluator", "class", {"weight"}},
                                      [&](const auto& evaluator, const auto& entry)
                                      {
                                          double weight = 1.0;
                                          load_key(
                                              entry, "weight",
                                              [&](ParameterDeclaration& d)
                                              { d.number("weight", weight, "", Range::not_negative(), ""); });
                                          quality_evaluators_.push_back({evaluator, weight});
                                      });
}

Pipeline pipeline_from_yaml(const yaml& config, const YamlPlace& place,
                            mrpt::system::VerbosityLevel verbosity)
{
    check_top(config, place);
    const auto part = [&](const char* key)
    { return config.has(key) ? yaml(config.asMap().at(key)) : yaml(); };
    Pipeline out;
    out.icp = std::dynamic_pointer_cast<ICP>(
        object_from_yaml(config.asMap().at("class_name"), place.key("class_name"), CLASS_ID(ICP), "ICP"));
    out.icp->setMinLoggingLevel(verbosity);
    out.parameters.load_parameters(part("params"), place.key("params"));
    out.icp->initialize_solvers(part("solvers"), place.key("solvers"));
    out.icp->initialize_matchers(part("matchers"), place.key("matchers"));
    out.icp->initialize_quality_evaluators(part("quality"), place.key("quality"));
    if (config.has("generators"))
        out.generators =
            mp2p_icp_filters::generators_from_yaml(part("generators"), place.key("generators"), verbosity);
    for (const auto& [key, value] : config.asMap())
    {
        const std::string name(key.internalAsStr());
        if (name == "filters" || !is_top_key(name))
            out.filters[name] =
                mp2p_icp_filters::filter_pipeline_from_yaml(yaml(value), place.key(name), verbosity);
    }
    return out;
}

Pipeline pipeline_from_yaml_file(const std::string& file_name, mrpt::system::VerbosityLevel verbosity)
{
    return pipeline_from_yaml(yaml_from_file(file_name), {file_name, ""}, verbosity);
}

std::tuple<ICP::Ptr, Parameters> icp_pipeline_from_yaml(const yaml& config,
                                                        mrpt::system::VerbosityLevel verbosity)
{
    Pipeline p = pipeline_from_yaml(config, {}, verbosity);
    return {p.icp, p.parameters};
}

void Pipeline::attachToParameterSource(const ParameterSource& source)
{
    icp->attachToParameterSource(source);
    for (auto& [name, list] : filters)
        for (auto& f : list) f->attachToParameterSource(source);
    if (generators)
        for (auto& g : *generators) g->attachToParameterSource(source);
}

}  // namespace mp2p_icp
