#include "Aligner.h"

#include <filesystem>

namespace mp2p_icp_bench
{
using namespace mp2p_icp;

Pipeline quiet_pipeline(const std::string& text, const std::string& name)
{
    return pipeline_from_yaml(yaml_from_text(text, name), {}, mrpt::system::LVL_ERROR);
}

Aligner::Aligner(const std::string& name_or_file)
    : pipeline_(std::filesystem::exists(name_or_file)
                    ? pipeline_from_yaml_file(name_or_file, mrpt::system::LVL_ERROR)
                    : quiet_pipeline(shipped_pipeline(name_or_file), name_or_file))
{
}

metric_map_t Aligner::filtered(metric_map_t map) const
{
    const auto filters = pipeline_.filters.find("filters");
    if (filters != pipeline_.filters.end()) mp2p_icp_filters::apply_filter_pipeline(filters->second, map);
    return map;
}

Results Aligner::align(const metric_map_t& local, const metric_map_t& global,
                       const mrpt::poses::CPose3D& guess,
                       const std::optional<mrpt::poses::CPose3DPDFGaussianInf>& prior) const
{
    Results result;
    pipeline_.icp->align(local, global, guess.asTPose(), pipeline_.parameters, result, prior);
    return result;
}
}  // namespace mp2p_icp_bench
