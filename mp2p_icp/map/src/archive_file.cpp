#include <mp2p_icp/archive_file.h>

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

void write_archive_file(const std::string& path, const CSerializable& object)
{
    mrpt::io::CMemoryStream stream;
    mrpt::serialization::archiveFrom(stream) << object;
    const std::string_view bytes(static_cast<const char*>(stream.getRawBufferData()),
                                 stream.getTotalBytesCount());
    write_whole_file(path, gzip(bytes));
}

}  // namespace mp2p_icp
