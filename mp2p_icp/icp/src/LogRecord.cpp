#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/errors.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/optional_serialization.h>
#include <mrpt/serialization/stl_serialization.h>

#include <sstream>

IMPLEMENTS_SERIALIZABLE(LogRecord, mrpt::serialization::CSerializable, mp2p_icp)

namespace mp2p_icp
{
namespace
{
std::string as_text(const yaml& y)
{
    std::stringstream out;
    y.printAsYAML(out);
    return out.str();
}
}  // namespace

uint8_t LogRecord::serializeGetVersion() const
{
    return 0;
}

void LogRecord::serializeTo(mrpt::serialization::CArchive& out) const
{
    out << *pcGlobal << *pcLocal << initialGuessLocalWrtGlobal;
    out << as_text(icpParameters.save_parameters());
    icpResult.serializeTo(out);
    out.WriteAs<uint64_t>(iterationsDetails ? iterationsDetails->size() : 0);
    if (iterationsDetails)
        for (const auto& [iteration, details] : *iterationsDetails)
            out.WriteAs<uint64_t>(iteration), out << details.optimalPose << details.pairings;
    out << dynamicVariables;
}

void LogRecord::serializeFrom(mrpt::serialization::CArchive& in, uint8_t version)
{
    if (version != 0) throw DataError("ICP log", "", "version 0", "version " + std::to_string(version));
    auto global = std::make_shared<metric_map_t>(), local = std::make_shared<metric_map_t>();
    in >> *global >> *local >> initialGuessLocalWrtGlobal;
    pcGlobal = global, pcLocal = local;
    std::string parameters;
    in >> parameters;
    icpParameters.load_parameters(yaml_from_text(parameters));
    icpResult.serializeFrom(in);
    iterationsDetails.reset();
    for (uint64_t left = in.ReadAs<uint64_t>(); left > 0; left--)
    {
        if (!iterationsDetails) iterationsDetails.emplace();
        const auto iteration = in.ReadAs<uint64_t>();
        auto& details = (*iterationsDetails)[iteration];
        in >> details.optimalPose >> details.pairings;
    }
    in >> dynamicVariables;
}

bool LogRecord::save_to_file(const std::string& file_name) const
{
    mrpt::io::CFileGZOutputStream file;
    if (!file.open(file_name)) return false;
    auto archive = mrpt::serialization::archiveFrom(file);
    archive << *this;
    return true;
}

}  // namespace mp2p_icp
