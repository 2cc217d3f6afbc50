#include <mp2p_icp/errors.h>
#include <mp2p_icp/modules_from_yaml.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp_filters/FilterBase.h>
#include <mp2p_icp_filters/Generator.h>

#include <algorithm>

#include "register.h"
#include "text_match.h"

IMPLEMENTS_MRPT_OBJECT(Generator, mrpt::rtti::CObject, mp2p_icp_filters)

namespace mp2p_icp_filters
{
using mp2p_icp::ConfigError;
using mp2p_icp::ParameterDeclaration;
using mp2p_icp::YamlPlace;

// ---- Parameters -------------------------------------------------------------------------------------------
namespace
{
std::string wrong_regex(const std::string& name, const std::string& text)
{
    const std::string problem = regex_problem(text);
    if (problem.empty()) return {};
    return "'" + name + "': \"" + text + "\" is not a valid regular expression (" + problem + ")";
}

/// `metric_map_definition: {class: NAME}`. Its other keys in the original set MRPT options, and none of them
/// has a use here.
void load_layer_class(const yaml::node_t& node, const YamlPlace& place, std::string& layer_class)
{
    const yaml definition(node);
    const std::vector<std::string> not_supported = {"plugin",        "creationOpts",   "insertOpts",
                                                    "insertionOpts", "likelihoodOpts", "renderOpts"};
    if (!definition.isMap())
        throw ConfigError(place.text(&node) + ": expected a map such as {class: mrpt::maps::CPointsMapXYZI}");
    for (const auto& [key, value] : definition.asMap())
    {
        const std::string name(key.internalAsStr());
        if (std::find(not_supported.begin(), not_supported.end(), name) != not_supported.end())
            throw ConfigError(place.key(name).text(&key) + ": '" + name +
                              "' is not supported: layers are plain point clouds without options; only "
                              "'class' can be chosen");
        if (name != "class") mp2p_icp::throw_unknown_key(place, key, {"class"});
    }
    if (!definition.has("class"))
        throw ConfigError(place.text(&node) + ": the required key 'class' is missing (a point cloud class)");
    const auto& class_node = definition.asMap().at("class");
    layer_class = mp2p_icp::scalar_text(class_node, place.key("class"));
    try
    {
        mp2p_icp::new_cloud(layer_class);
    }
    catch (const std::invalid_argument& e)
    {
        throw ConfigError(place.key("class").text(&class_node) + ": " + e.what());
    }
}

ParameterDeclaration::Entry layer_class_entry(std::string& layer_class)
{
    const auto save = [&layer_class]()
    {
        yaml definition = yaml::Map();
        definition.asMap()["class"] = layer_class;
        return definition.node();
    };
    return {"metric_map_definition",
            "map {class: name}",
            "",
            "",
            "Class of the layer when it is made: a point cloud class.",
            "{class: " + layer_class + "}",
            false,
            [&layer_class](const auto& node, const auto& place)
            { load_layer_class(node, place, layer_class); },
            save};
}

ParameterDeclaration::Entry refused_entry(const std::string& name, const std::string& sentence)
{
    const auto refuse = [sentence](const yaml::node_t& node, const YamlPlace& place)
    { throw ConfigError(place.text(&node) + ": " + sentence); };
    return {name, "not supported", "", "", "Known, and refused: " + sentence, "", false, refuse, nullptr};
}
}  // namespace

void Generator::declare_parameters(ParameterDeclaration& declare)
{
    declare.text("target_layer", target_layer, "The layer that gets the points.");
    declare.older_name("target_pointcloud_layer", "target_layer");
    declare.text(
        "process_class_names_regex", process_class_names_regex,
        "Observation classes to use, with or without namespace; empty: make the layer, insert nothing.");
    declare.text("process_sensor_labels_regex", process_sensor_labels_regex,
                 "Sensor labels to use; empty: make the layer, insert nothing.");
    declare.flag("throw_on_unhandled_observation_class", throw_on_unhandled_observation_class,
                 "Is a matching observation of a kind without points an error?");
    declare.number(
        "scan_2d_interpolate_up_to", points_options.scan_2d_interpolate_up_to, "m",
        {0, std::numeric_limits<double>::infinity(), false, true},
        "2-D scans: adds points between neighbouring rays whose ends are at most this far apart; 0: none.");
    declare.number("scan_2d_interpolation_step", points_options.scan_2d_interpolation_step, "m",
                   {1e-3, std::numeric_limits<double>::infinity(), false, true},
                   "Greatest distance between these points.");
    declare.custom(layer_class_entry(layer_class));
    declare.custom(
        refused_entry("metric_map_definition_ini_file",
                      "INI files are not supported; write metric_map_definition: {class: ...} instead"));
    declare.custom(
        refused_entry("plugin",
                      "plugins are not supported; link your program with the class and register it in MRPT's "
                      "class factory (mrpt::rtti::registerClass) instead"));
    declare.rule(
        [this]() -> std::string
        {
            if (target_layer.empty()) return "'target_layer' must not be empty";
            const std::string broken = wrong_regex("process_class_names_regex", process_class_names_regex);
            return broken.empty() ? wrong_regex("process_sensor_labels_regex", process_sensor_labels_regex)
                                  : broken;
        });
}

// ---- Processing -------------------------------------------------------------------------------------------
namespace
{
bool class_matches(const std::string& class_name, const std::string& expression)
{
    return regex_matches(class_name, expression) ||
           regex_matches(class_name.substr(class_name.rfind(':') + 1), expression);
}
}  // namespace

bool Generator::process(const mrpt::obs::CObservation& observation, mp2p_icp::metric_map_t& out,
                        const std::optional<mrpt::poses::CPose3D>& robotPose, GeneratorsReport* report) const
{
    if (process_class_names_regex.empty() || process_sensor_labels_regex.empty())
    {
        GetOrCreatePointLayer(out, target_layer, layer_class);
        return false;
    }
    const std::string class_name = observation.GetRuntimeClass()->className;
    if (!class_matches(class_name, process_class_names_regex)) return false;
    if (!regex_matches(observation.sensorLabel, process_sensor_labels_regex)) return false;

    const auto cloud =
        out.layers.count(target_layer) ? out.point_layer(target_layer) : mp2p_icp::new_cloud(layer_class);
    const size_t first = cloud->size();
    const auto dropped = mp2p_icp::insert_observation_points(observation, *cloud, points_options);
    if (!dropped)
    {
        if (!throw_on_unhandled_observation_class) return false;
        throw std::runtime_error("Generator: observation '" + observation.sensorLabel + "' of class " +
                                 class_name + " has no points (throw_on_unhandled_observation_class is set)");
    }
    if (robotPose) mp2p_icp::move_points(*cloud, first, *robotPose);
    out.layers[target_layer] = cloud;
    if (report)
    {
        report->points_made += cloud->size() - first;
        report->points_dropped_nonfinite += *dropped;
    }
    return true;
}

GeneratorsReport apply_generators(const GeneratorSet& generators, const mrpt::obs::CObservation& observation,
                                  mp2p_icp::metric_map_t& out,
                                  const std::optional<mrpt::poses::CPose3D>& robotPose)
{
    GeneratorsReport report;
    bool used = false;
    for (const auto& generator : generators)
        if (generator->process(observation, out, robotPose, &report)) used = true;
    report.observations_used = used ? 1 : 0;
    return report;
}

GeneratorsReport apply_generators(const GeneratorSet& generators, const mrpt::obs::CSensoryFrame& frame,
                                  mp2p_icp::metric_map_t& out,
                                  const std::optional<mrpt::poses::CPose3D>& robotPose)
{
    GeneratorsReport total;
    for (const auto& observation : frame)
    {
        if (!observation) continue;
        const auto report = apply_generators(generators, *observation, out, robotPose);
        total.points_made += report.points_made;
        total.points_dropped_nonfinite += report.points_dropped_nonfinite;
        total.observations_used += report.observations_used;
    }
    return total;
}

// ---- YAML -------------------------------------------------------------------------------------------------

GeneratorSet generators_from_yaml(const yaml& list, const YamlPlace& place,
                                  mrpt::system::VerbosityLevel verbosity)
{
    register_classes();
    GeneratorSet generators = mp2p_icp::modules_from_yaml<Generator>(list, place, "generator", verbosity);
    if (generators.empty())
    {
        generators.push_back(Generator::Create());
        generators.back()->setMinLoggingLevel(verbosity);
    }
    return generators;
}

GeneratorSet generators_from_yaml_file(const std::string& file_name, mrpt::system::VerbosityLevel verbosity)
{
    return generators_from_yaml(mp2p_icp::module_list_from_file(file_name, "generators"),
                                {file_name, "generators"}, verbosity);
}

}  // namespace mp2p_icp_filters
