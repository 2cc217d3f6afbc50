#include <libdeflate.h>
#include <mp2p_icp/archive_file.h>
#include <mp2p_icp/errors.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <new>

#include "archives.h"
#include "content_kind.h"
#include "files.h"
#include "gzip.h"

namespace mp2p_icp
{
using mrpt::serialization::CSerializable;

std::string read_archive_file(const std::string& path)
{
    return gunzip_all(path, read_whole_file(path));
}

ArchiveHead archive_head(std::string_view bytes)
{
    ArchiveHead head{archive_class(bytes)};
    const bool short_length = !bytes.empty() && static_cast<unsigned char>(bytes[0]) >= 0x80;
    const size_t at = (short_length ? 1 : 4) + head.class_name.size();
    if (!head.class_name.empty() && at < bytes.size()) head.version = static_cast<uint8_t>(bytes[at]);
    return head;
}

CSerializable::Ptr read_archive_object(const std::string& source, std::string_view bytes,
                                       const std::function<void(CSerializable&)>& check)
{
    const auto parse = [&]
    {
        const auto object = ArchiveReader(bytes).read();
        if (!object) throw std::runtime_error("the archive holds no object");
        check(*object);
        return object;
    };
    rehearse(source, bytes,
             [&]
             {
                 parse();
                 return std::string();
             });
    CSerializable::Ptr object;
    perform(source, [&] { object = parse(); });
    return object;
}

namespace
{
/// As a gzip file that is not compressed. (libdeflate takes a third of zlib's time for that.)
void write_framed(const std::string& path, std::string_view bytes)
{
    const std::unique_ptr<libdeflate_compressor, void (*)(libdeflate_compressor*)> compressor(
        libdeflate_alloc_compressor(0), libdeflate_free_compressor);
    if (!compressor) throw std::bad_alloc();
    const size_t bound = libdeflate_gzip_compress_bound(compressor.get(), bytes.size());
    const std::unique_ptr<char[]> framed(new char[bound]);
    const size_t size =
        libdeflate_gzip_compress(compressor.get(), bytes.data(), bytes.size(), framed.get(), bound);
    errno = 0;
    std::ofstream out(path, std::ios::binary);
    out.write(framed.get(), static_cast<std::streamsize>(size));
    out.close();
    if (size == 0 || !out)
        throw DataError(
            path, std::string("cannot be written") + (errno ? std::string(": ") + std::strerror(errno) : ""));
}
}  // namespace

void write_archive_file(const std::string& path, const CSerializable& object)
{
    mrpt::io::CMemoryStream stream;
    stream.setAllocBlockSize(1 << 22);  // it grows by so much at a time
    mrpt::serialization::archiveFrom(stream) << object;
    const std::string_view bytes(static_cast<const char*>(stream.getRawBufferData()),
                                 stream.getTotalBytesCount());
    write_framed(path, bytes);
}

}  // namespace mp2p_icp
