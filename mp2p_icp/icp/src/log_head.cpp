#include "log_head.h"

#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/errors.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "log_version.h"

namespace mp2p_icp
{
namespace
{
constexpr const char* CLASS_NAME = "mp2p_icp::LogRecord";
constexpr size_t HEAD_BYTES = 4096;

std::string first_bytes(const std::string& path)
{
    std::ifstream in(path, std::ios::binary);
    std::string bytes(HEAD_BYTES, 0);
    if (!in) throw DataError(path, "no such file, or it cannot be read");
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<size_t>(in.gcount()));
    return bytes;
}

/// What the first bytes of a gzip file begin with; nothing, if they are none.
std::string inflated_start(std::string& bytes)
{
    constexpr int gzip_window = 15 + 16;
    z_stream z = {};
    if (inflateInit2(&z, gzip_window) != Z_OK) return {};
    std::string out(HEAD_BYTES, 0);
    z.next_in = reinterpret_cast<Bytef*>(bytes.data()), z.avail_in = static_cast<uInt>(bytes.size());
    z.next_out = reinterpret_cast<Bytef*>(out.data()), z.avail_out = static_cast<uInt>(out.size());
    (void)inflate(&z, Z_SYNC_FLUSH);
    out.resize(out.size() - z.avail_out);
    inflateEnd(&z);
    return out;
}

/// The place behind the class name, its length and the version.
size_t after_head(std::string_view bytes)
{
    const bool short_length = static_cast<unsigned char>(bytes[0]) >= 0x80;
    return (short_length ? 1 : 4) + std::strlen(CLASS_NAME) + 1;
}
}  // namespace

void check_log_head(const std::string& file_name, const ArchiveHead& head)
{
    const std::string version = "version " + std::to_string(head.version);
    if (head.class_name.empty()) throw DataError(file_name, "", "an ICP log (.icplog)", "no MRPT archive");
    if (head.class_name != CLASS_NAME)
        throw DataError(file_name, "", "an ICP log (.icplog)", "an object of the class " + head.class_name);
    if (head.version < FIRST_LOG_VERSION)
        throw DataError(file_name,
                        "is a log of the original mp2p_icp (" + version +
                            " of its format), which this program does not read: it has other contents. Open "
                            "it with the original's icp-log-viewer, or log the run again with this library");
    if (head.version < LOG_VERSION)
        throw DataError(file_name, "is a log of an older version of this library (" + version +
                                       " of its format), which this one does not read. Log the run again");
    if (head.version > LOG_VERSION)
        throw DataError(file_name, "", "version " + std::to_string(LOG_VERSION) + " of the ICP log",
                        version + ", of a newer mp2p_icp");
}

/// No parser of MRPT's sees these bytes; the places are those of LogRecord::serializeTo().
LogHeadline read_log_headline(const std::string& file_name)
{
    std::string bytes = first_bytes(file_name);
    for (int i = 0; i < 2; i++)
        if (auto content = inflated_start(bytes); !content.empty()) bytes = std::move(content);
    check_log_head(file_name, archive_head(bytes));
    constexpr size_t results_version = 1;
    const size_t at = after_head(bytes) + results_version;
    LogHeadline out;
    if (bytes.size() < at + 1 + sizeof(double))
        throw DataError(file_name, "", "the results of an ICP log", "its end (truncated)");
    out.verdict = static_cast<Verdict>(bytes[at]);
    std::memcpy(&out.quality, bytes.data() + at + 1, sizeof(double));
    if (to_string(out.verdict).empty()) throw DataError(file_name, "there is no such verdict");
    if (!std::isfinite(out.quality)) throw DataError(file_name, "its quality is not a number");
    return out;
}

}  // namespace mp2p_icp
