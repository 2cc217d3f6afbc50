#include "gzip.h"

#include <mp2p_icp/errors.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <vector>

#include "files.h"

namespace mp2p_icp
{
namespace
{
constexpr int GZIP_WINDOW = 15 + 16;  // zlib: largest window, gzip framing with its CRC-32 and length

/// A z_stream that frees itself.
struct Inflater
{
    z_stream z = {};
    Inflater()
    {
        if (inflateInit2(&z, GZIP_WINDOW) != Z_OK) throw std::runtime_error("zlib cannot be initialized");
    }
    ~Inflater() { inflateEnd(&z); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;
};

Bytef* bytef(const char* p)
{
    return const_cast<Bytef*>(reinterpret_cast<const Bytef*>(p));
}

/// Inflates the member that starts at `at`, giving each piece to `sink(data, size)`, and moves `at` behind
/// it.
template <class Sink>
void inflate_member(const std::string& source, std::string_view in, size_t& at, std::vector<char>& buffer,
                    const Sink& sink)
{
    Inflater inflater;
    auto& z = inflater.z;
    int rc = Z_OK;
    while (rc != Z_STREAM_END)
    {
        const auto given = std::min<size_t>(in.size() - at, std::numeric_limits<uInt>::max());
        z.next_in = bytef(in.data() + at);
        z.avail_in = static_cast<uInt>(given);
        z.next_out = bytef(buffer.data());
        z.avail_out = static_cast<uInt>(buffer.size());
        rc = inflate(&z, Z_NO_FLUSH);
        at += given - z.avail_in;
        sink(buffer.data(), buffer.size() - z.avail_out);
        if (rc == Z_OK || rc == Z_STREAM_END) continue;
        const std::string found = rc == Z_BUF_ERROR ? "its end (truncated)" : z.msg ? z.msg : "damaged data";
        throw DataError(source, "compressed " + place_byte(at), "intact gzip data", found);
    }
}

template <class Sink>
void inflate_members(const std::string& source, std::string_view in, const Sink& sink)
{
    std::vector<char> buffer(1 << 18);
    size_t at = 0;
    do inflate_member(source, in, at, buffer, sink);
    while (is_gzip(in.substr(at)));
    // gzip(1) accepts zero padding after the last member, and so do we; anything else is not gzip.
    if (in.find_first_not_of('\0', at) != std::string_view::npos)
        throw DataError(source, "compressed " + place_byte(at), "the end of the gzip data",
                        "other data after it");
}
}  // namespace

bool is_gzip(std::string_view bytes)
{
    return bytes.size() > 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b';
}

std::string gunzip(const std::string& source, std::string_view compressed)
{
    // Twice: counting first means that a small file cannot claim much memory, and that what is claimed is
    // exact.
    uint64_t size = 0;
    const uint64_t cap = std::min(READ_CONTENT_CAP_BYTES, READ_MEMORY_BUDGET_BYTES - compressed.size());
    inflate_members(source, compressed,
                    [&](const char*, size_t n)
                    {
                        size += n;
                        if (size > cap)
                            throw DataError(source, "",
                                            "at most " + std::to_string(cap) + " bytes of content",
                                            "more when decompressed");
                    });
    std::string content;
    content.reserve(size);
    inflate_members(source, compressed, [&](const char* data, size_t n) { content.append(data, n); });
    return content;
}

std::string gunzip_all(const std::string& source, std::string bytes)
{
    for (int i = 0; i < 2 && is_gzip(bytes); i++) bytes = gunzip(source, bytes);
    return bytes;
}

std::string gzip(std::string_view content)
{
    z_stream z = {};
    if (deflateInit2(&z, Z_DEFAULT_COMPRESSION, Z_DEFLATED, GZIP_WINDOW, 8, Z_DEFAULT_STRATEGY) != Z_OK)
        throw std::runtime_error("zlib cannot be initialized");
    std::string out;
    std::vector<char> buffer(1 << 18);
    size_t at = 0;
    int rc = Z_OK;
    while (rc != Z_STREAM_END)
    {
        const auto given = std::min<size_t>(content.size() - at, 1 << 30);
        z.next_in = bytef(content.data() + at);
        z.avail_in = static_cast<uInt>(given);
        z.next_out = bytef(buffer.data());
        z.avail_out = static_cast<uInt>(buffer.size());
        rc = deflate(&z, at + given == content.size() ? Z_FINISH : Z_NO_FLUSH);
        at += given - z.avail_in;
        out.append(buffer.data(), buffer.size() - z.avail_out);
    }
    deflateEnd(&z);
    return out;
}

}  // namespace mp2p_icp
