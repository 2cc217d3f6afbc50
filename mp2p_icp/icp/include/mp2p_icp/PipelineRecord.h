#pragma once

#include <mp2p_icp/Formula.h>
#include <mp2p_icp/yaml_tools.h>
#include <mrpt/serialization/CArchive.h>

#include <memory>
#include <string>
#include <vector>

namespace mp2p_icp
{
class ICP;
struct Parameters;

/// One matcher, solver or quality evaluator, as it was in a run.
struct StageRecord
{
    std::string class_name;
    yaml params = yaml::Map();  ///< all of them
    bool enabled = true;
    double weight = 1.0;     ///< of an evaluator
    RunVariables variables;  ///< that its formulas saw, besides those of the run
    /// Its real class was one that derives from class_name and has no name of its own: it cannot be made
    /// again.
    bool nameless = false;
};

/// An ICP object as data: enough to make it again.
struct PipelineRecord
{
    std::string class_name;
    std::vector<StageRecord> matchers, solvers, quality;

    /// The configuration of `icp` now.
    static PipelineRecord of(const ICP& icp);

    /// As a pipeline file holds it; the variables have no place there.
    yaml to_yaml(const Parameters& parameters) const;

    /** An ICP object of this configuration. \exception ConfigError for a class that this program does not
     * know, or parameters that it does not take.
     */
    std::shared_ptr<ICP> make() const;

    void serializeTo(mrpt::serialization::CArchive& out) const;
    void serializeFrom(mrpt::serialization::CArchive& in);
};

}  // namespace mp2p_icp
