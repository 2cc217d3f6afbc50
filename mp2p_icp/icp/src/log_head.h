#pragma once

#include <mp2p_icp/archive_file.h>

#include <string>

namespace mp2p_icp
{
/// \exception DataError if it is not that of a log that can be read
void check_log_head(const std::string& file_name, const ArchiveHead& head);
}  // namespace mp2p_icp
