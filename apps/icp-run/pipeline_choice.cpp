#include "pipeline_choice.h"

#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/modules_from_yaml.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <stdexcept>

namespace mp2p_icp_apps
{
using mp2p_icp::metric_map_t;

namespace
{
constexpr auto VERBOSITY = mrpt::system::LVL_ERROR;  // what a person should know, icp-run says itself

template <class Names>
std::string joined(const Names& names)
{
    std::string out;
    for (const auto& name : names) out += (out.empty() ? "" : ", ") + name;
    return out.empty() ? "none" : out;
}

template <class Map>
std::vector<std::string> keys_of(const Map& map)
{
    std::vector<std::string> keys;
    for (const auto& entry : map) keys.push_back(entry.first);
    return keys;
}

std::string did_you_mean(const std::string& name, const std::vector<std::string>& known)
{
    const std::string nearest = mp2p_icp::nearest_name(name, known);
    return nearest.empty() ? "" : "; did you mean '" + nearest + "'?";
}
}  // namespace

NamedPipeline load_pipeline(const std::string& file_or_name)
{
    std::error_code ignored;
    if (std::filesystem::exists(file_or_name, ignored))
        return {file_or_name, mp2p_icp::pipeline_from_yaml_file(file_or_name, VERBOSITY)};
    const auto shipped = mp2p_icp::shipped_pipeline_names();
    if (std::find(shipped.begin(), shipped.end(), file_or_name) == shipped.end())
        throw std::invalid_argument(
            "--config: '" + file_or_name + "' is neither a file nor a shipped pipeline" +
            did_you_mean(file_or_name, shipped) + " (shipped: " + joined(shipped) + ")");
    const std::string source = file_or_name + " (shipped)";
    const auto config = mp2p_icp::yaml_from_text(mp2p_icp::shipped_pipeline(file_or_name), source);
    return {file_or_name, mp2p_icp::pipeline_from_yaml(config, {source, ""}, VERBOSITY)};
}

std::string default_pipeline_for_inputs(const InputPair& inputs, bool own_generators)
{
    const bool has_raw = inputs.local.map->layers.count(metric_map_t::PT_LAYER_RAW) > 0;
    return mp2p_icp::default_pipeline_for(*inputs.local.map, *inputs.global.map,
                                          inputs.global.observations && has_raw && !own_generators);
}

mp2p_icp_filters::FilterPipeline choose_filters(const NamedPipeline& from, const std::string& filters_file,
                                                const std::optional<std::string>& entry_name,
                                                const std::string& option)
{
    const std::string name = entry_name.value_or("filters");
    if (!filters_file.empty())
    {
        const auto list = mp2p_icp::module_list_from_file(filters_file, name);
        return mp2p_icp_filters::filter_pipeline_from_yaml(list, {filters_file, name}, VERBOSITY);
    }
    const auto& lists = from.pipeline.filters;
    if (const auto it = lists.find(name); it != lists.end()) return it->second;
    if (!entry_name) return {};
    const auto known = keys_of(lists);
    throw std::invalid_argument(option + ": the pipeline " + from.name + " has no list of filters named '" +
                                name + "'" + did_you_mean(name, known) + " (it has: " + joined(known) + ")");
}

void check_layers_meet(const mp2p_icp::ICP& icp, const metric_map_t& local, const metric_map_t& global)
{
    bool any = false;
    for (const auto& matcher : icp.matchers())
    {
        if (!matcher->enabled) continue;
        any = true;
        const auto* of_points = dynamic_cast<const mp2p_icp::Matcher_Points_Base*>(matcher.get());
        if (!of_points || !of_points->layer_pairs(global, local).empty()) return;
    }
    if (!any) throw std::invalid_argument("the pipeline has no matcher that is enabled");
    throw std::invalid_argument("no layer name is in both maps (local: " + joined(keys_of(local.layers)) +
                                "; global: " + joined(keys_of(global.layers)) +
                                "); say which to match with `pointLayerMatches` of the matchers");
}

uint64_t global_points_used(const mp2p_icp::ICP& icp, const metric_map_t& local, const metric_map_t& global)
{
    std::set<std::string> names;
    for (const auto& matcher : icp.matchers())
    {
        if (!matcher->enabled) continue;
        const auto* of_points = dynamic_cast<const mp2p_icp::Matcher_Points_Base*>(matcher.get());
        if (!of_points) return global.size_points_only();
        for (const auto& pair : of_points->layer_pairs(global, local)) names.insert(pair.global);
    }
    uint64_t count = 0;
    for (const auto& name : names) count += global.point_layer(name)->size();
    return count;
}

}  // namespace mp2p_icp_apps
