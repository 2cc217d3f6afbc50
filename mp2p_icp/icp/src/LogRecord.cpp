#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/archive_file.h>
#include <mp2p_icp/errors.h>

#include <stdexcept>

#include "log_version.h"

namespace mp2p_icp
{
namespace
{
/// What the parser does not check: enumerations, that is, and whatever else others rely on.
void check(const LogRecord& log)
{
    if (log.icpResult.verdict > Verdict::failed) throw std::runtime_error("there is no such verdict");
    if (log.icpResult.terminationReason > IterTermReason::Cycled)
        throw std::runtime_error("there is no such termination reason");
    for (const auto& twist : log.icpResult.unobservable)
        if (twist.kind > FreeTwist::Kind::Screw) throw std::runtime_error("there is no such kind of motion");
    for (const auto& map : {log.pcGlobal, log.pcLocal})
    {
        (void)map->coordinate_offset();  // throws if it is not three numbers
        (void)map->contents_summary(), (void)map->bounding_box();
    }
}

void check_head(const std::string& file_name, const ArchiveHead& head)
{
    if (head.class_name.empty()) throw DataError(file_name, "", "an ICP log (.icplog)", "no MRPT archive");
    if (head.class_name != "mp2p_icp::LogRecord")
        throw DataError(file_name, "", "an ICP log (.icplog)", "an object of the class " + head.class_name);
    if (head.version < LOG_VERSION)
        throw DataError(file_name, "is a log of the original mp2p_icp (version " +
                                       std::to_string(head.version) +
                                       " of its format), which this program does not read: it has other "
                                       "contents. Open it with the original's icp-log-viewer, or log the run "
                                       "again with this library");
    if (head.version > LOG_VERSION)
        throw DataError(file_name, "", "version " + std::to_string(LOG_VERSION) + " of the ICP log",
                        "version " + std::to_string(head.version) + ", of a newer mp2p_icp");
}
}  // namespace

bool LogRecord::save_to_file(const std::string& file_name) const
{
    try
    {
        write_archive_file(file_name, *this);
        return true;
    }
    catch (const DataError&)
    {
        return false;
    }
}

LogRecord LogRecord::load_from_file(const std::string& file_name)
{
    const std::string bytes = read_archive_file(file_name);
    check_head(file_name, archive_head(bytes));
    const auto check_object = [](mrpt::serialization::CSerializable& object)
    { check(dynamic_cast<LogRecord&>(object)); };
    const auto object = read_archive_object(file_name, bytes, check_object);
    return std::move(dynamic_cast<LogRecord&>(*object));
}

}  // namespace mp2p_icp
