#pragma once

#include <string>
#include <string_view>

namespace mp2p_icp
{
bool is_gzip(std::string_view bytes);

/** The content of a gzip file (one or more members), after its CRC and lengths have been verified. Memory:
 * exactly the content. \exception DataError if it is truncated, damaged, or its content is above
 * READ_CONTENT_CAP_BYTES.
 */
std::string gunzip(const std::string& source, std::string_view compressed);

/// The same for what may be compressed or not, and MRPT's own files compressed again as `.gz`: up to twice.
std::string gunzip_all(const std::string& source, std::string bytes);

/// One gzip member without name or time, so that equal contents give equal files.
std::string gzip(std::string_view content);

}  // namespace mp2p_icp
