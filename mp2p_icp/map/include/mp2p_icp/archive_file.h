#pragma once

#include <mrpt/serialization/CSerializable.h>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

/** \file archive_file.h
 * Files that hold MRPT archives, compressed or not, read so that no damage to them can harm this process:
 * MRPT's parser, which believes every count, is given the bytes only after they have been decompressed and
 * verified whole, and in a child process with limits first.
 */
namespace mp2p_icp
{
/// The content of a file, decompressed. \exception DataError if it is missing, damaged, or too large.
std::string read_archive_file(const std::string& path);

/// How the first object of an archive begins.
struct ArchiveHead
{
    std::string class_name;  ///< empty: the bytes are no archive
    uint8_t version = 0;     ///< of the class
};
ArchiveHead archive_head(std::string_view bytes);

/** The first object of an archive.
 * \param check Called with it, first in the child process: throws, whatever, to refuse the object; what
 * crashes here, crashes there. \exception DataError naming the source, if it cannot be read. Thread-safe.
 */
mrpt::serialization::CSerializable::Ptr read_archive_object(
    const std::string& source, std::string_view bytes,
    const std::function<void(mrpt::serialization::CSerializable&)>& check);

/** One object as a gzip file; equal objects give equal files. It is not compressed: float coordinates shrink
 * by a sixth, and that takes longer than to align them. \exception DataError if it cannot be written.
 */
void write_archive_file(const std::string& path, const mrpt::serialization::CSerializable& object);

}  // namespace mp2p_icp
