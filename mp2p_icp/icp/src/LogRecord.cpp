#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/archive_file.h>
#include <mp2p_icp/errors.h>

#include <stdexcept>

#include "log_head.h"

namespace mp2p_icp
{
namespace
{
/// What the parser does not check: enumerations, that is, and whatever else others rely on.
void check(const LogRecord& log)
{
    const auto expect_one_of = [](const char* what, const auto& value)
    {
        if (to_string(value).empty()) throw std::runtime_error(std::string("there is no such ") + what);
    };
    expect_one_of("verdict", log.icpResult.verdict);
    expect_one_of("termination reason", log.icpResult.terminationReason);
    for (const auto& twist : log.icpResult.unobservable) expect_one_of("kind of motion", twist.kind);
    for (const auto& map : {log.pcGlobal, log.pcLocal})
    {
        (void)map->coordinate_offset();  // throws if it is not three numbers
        (void)map->contents_summary(), (void)map->bounding_box();
    }
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
    check_log_head(file_name, archive_head(bytes));
    const auto check_object = [](mrpt::serialization::CSerializable& object)
    { check(dynamic_cast<LogRecord&>(object)); };
    const auto object = read_archive_object(file_name, bytes, check_object);
    return std::move(dynamic_cast<LogRecord&>(*object));
}

}  // namespace mp2p_icp
