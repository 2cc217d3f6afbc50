#pragma once

#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/metricmap.h>

#include <functional>
#include <map>
#include <string>

namespace mp2p_icp
{
/// Parameters of an ICP run.
struct Parameters : public Parameterizable
{
    uint32_t maxIterations = 40;
    double minAbsStep_trans = 5e-4;  ///< m; the run has converged when a step is smaller than this ...
    double minAbsStep_rot = 1e-4;    ///< rad; ... and than this

    /// The run has diverged when the local points' mean has moved by more than so many times the first
    /// matching distance.
    double maxMotionOverThreshold = 10.0;

    /// Iteration number -> least quality (0..1) to go on.
    std::map<uint32_t, double> quality_checkpoints = {{50, 0.05}, {100, 0.10}};

    bool debugPrintIterationProgress = false;

    bool generateDebugFiles = false;
    std::string debugFileNameFormat =
        "icp-run-$UNIQUE_ID-local-$LOCAL_ID$LOCAL_LABEL-global-$GLOBAL_ID$GLOBAL_LABEL.icplog";
    uint32_t decimationDebugFiles = 1;  ///< write one of so many logs
    bool saveIterationDetails = false;
    uint32_t decimationIterationDetails = 10;

    /// Applied to copies of the maps before they are logged, e.g. to drop layers.
    std::function<void(metric_map_t&)> functor_before_logging_local, functor_before_logging_global;

    void declare_parameters(ParameterDeclaration& declare) override;
    void load_from(const yaml& params, const YamlPlace& place = {}) { load_parameters(params, place); }
    void save_to(yaml& params) const { params = save_parameters(); }
};

}  // namespace mp2p_icp
