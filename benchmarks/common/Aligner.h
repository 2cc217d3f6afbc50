#pragma once

#include <mp2p_icp/icp_pipeline_from_yaml.h>

#include <optional>

namespace mp2p_icp_bench
{
/// A pipeline with its filters, and some ways to ask for it.
class Aligner
{
 public:
    /// A shipped pipeline, or a file.
    explicit Aligner(const std::string& name_or_file);
    explicit Aligner(mp2p_icp::Pipeline pipeline) : pipeline_(std::move(pipeline)) {}

    const mp2p_icp::Pipeline& pipeline() const { return pipeline_; }
    /// Formulas see the variables of the source from now on.
    void attach(const mp2p_icp::ParameterSource& source) { pipeline_.attachToParameterSource(source); }

    /// The map with the layers that the pipeline makes of it.
    mp2p_icp::metric_map_t filtered(mp2p_icp::metric_map_t map) const;
    mp2p_icp::Results align(
        const mp2p_icp::metric_map_t& local, const mp2p_icp::metric_map_t& global,
        const mrpt::poses::CPose3D& guess,
        const std::optional<mrpt::poses::CPose3DPDFGaussianInf>& prior = std::nullopt) const;

 private:
    mp2p_icp::Pipeline pipeline_;
};

/// From YAML text, quiet. \param name for messages
mp2p_icp::Pipeline quiet_pipeline(const std::string& text, const std::string& name);
}  // namespace mp2p_icp_bench
