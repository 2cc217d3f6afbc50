#include "input_maps.h"

#include <mp2p_icp/errors.h>

namespace mp2p_icp_apps
{
using mp2p_icp::DataError;
using mp2p_icp::is_observations_path;
using mp2p_icp::metric_map_t;

namespace
{
InputMap complete(mp2p_icp::LoadedMap loaded)
{
    if (loaded.map->size() == 0)
        throw DataError(loaded.report.source, "holds nothing to align: no point, plane or line");
    return {loaded.report, loaded.map, nullptr};
}

/// \exception DataError, where the generators or the observations cannot do it
mp2p_icp_filters::GeneratorsReport generate(const mp2p_icp_filters::GeneratorSet& generators,
                                            const InputMap& in, metric_map_t& map)
{
    try
    {
        return mp2p_icp_filters::apply_generators(generators, *in.observations, map);
    }
    catch (const std::exception& e)
    {  // a file that is stored beside the dataset is missing, for example
        throw DataError(in.report.source, mp2p_icp::short_reason(e));
    }
}

InputMap read_input(const std::string& path)
{
    if (!is_observations_path(path)) return complete(mp2p_icp::load_map(path));
    InputMap in;
    in.observations = mp2p_icp::load_observations(path, in.report);
    metric_map_t only_for_counting;
    const auto found =
        generate(mp2p_icp_filters::generators_from_yaml(mp2p_icp::yaml()), in, only_for_counting);
    in.report.points_read = found.points_made + found.points_dropped_nonfinite;
    in.report.points_dropped_nonfinite = found.points_dropped_nonfinite;
    return in;
}
}  // namespace

InputPair read_inputs(const std::string& local_path, const std::string& global_path)
{
    if (is_observations_path(local_path) || is_observations_path(global_path))
        return {read_input(local_path), read_input(global_path)};
    // Together, so that far-away clouds get one common coordinate offset.
    auto [local, global] = mp2p_icp::load_map_pair(local_path, global_path);
    return {complete(std::move(local)), complete(std::move(global))};
}

void InputMap::generate_map(const mp2p_icp_filters::GeneratorSet& generators)
{
    if (!observations) return;
    map = metric_map_t::Create();
    const auto made = generate(generators, *this, *map);
    if (made.points_made == 0)
        throw DataError(report.source, "the generators made no point of its " +
                                           std::to_string(observations->size()) + " observations, and used " +
                                           std::to_string(made.observations_used) + " of them");
}

void InputPair::generate_maps(const mp2p_icp_filters::GeneratorSet& generators)
{
    local.generate_map(generators);
    global.generate_map(generators);
}

}  // namespace mp2p_icp_apps
