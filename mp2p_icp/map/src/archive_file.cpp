#include <mp2p_icp/archive_file.h>
#include <mp2p_icp/errors.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

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
/// As a gzip file that is not compressed, in pieces: no second copy of what may be large.
void write_framed(const std::string& path, std::string_view bytes)
{
    errno = 0;
    const gzFile file = gzopen(path.c_str(), "wb0");
    constexpr size_t piece = 1 << 20;
    bool good = file != nullptr;
    for (size_t at = 0; good && at < bytes.size(); at += piece)
    {
        const auto size = static_cast<unsigned>(std::min(piece, bytes.size() - at));
        good = gzwrite(file, bytes.data() + at, size) == static_cast<int>(size);
    }
    if (file) good = gzclose(file) == Z_OK && good;
    if (!good)
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
