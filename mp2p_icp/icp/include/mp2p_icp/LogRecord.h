#pragma once

#include <mp2p_icp/Parameters.h>
#include <mp2p_icp/Results.h>
#include <mp2p_icp/metricmap.h>
#include <mrpt/math/TPose3D.h>
#include <mrpt/serialization/CSerializable.h>

#include <map>
#include <optional>
#include <string>

namespace mp2p_icp
{
/// The whole story of one ICP run, to be looked at later.
class LogRecord : public mrpt::serialization::CSerializable
{
    DEFINE_SERIALIZABLE(LogRecord, mp2p_icp)

 public:
    metric_map_t::ConstPtr pcGlobal, pcLocal;
    mrpt::math::TPose3D initialGuessLocalWrtGlobal;
    Parameters icpParameters;
    Results icpResult;

    struct DebugInfoPerIteration
    {
        mrpt::poses::CPose3D optimalPose;
        Pairings pairings;
    };
    using iterations_details_t = std::map<size_t, DebugInfoPerIteration>;
    std::optional<iterations_details_t> iterationsDetails;
    RunVariables dynamicVariables;

    /// As a gzip file. Returns false if it cannot be written.
    bool save_to_file(const std::string& file_name) const;
};

}  // namespace mp2p_icp
