#pragma once

#include <mp2p_icp/load_map.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>

#include <functional>
#include <string>
#include <string_view>

/** \file archives.h
 * MRPT archives in memory. MRPT's parser believes every count it reads: one damaged byte can make it claim
 * all memory, or crash. So all parsing is first rehearsed in a child process with limits; only if that goes
 * well does this process do the same.
 */
namespace mp2p_icp
{
/// Objects from bytes in memory, which must outlive the reader.
class ArchiveReader
{
 public:
    explicit ArchiveReader(std::string_view bytes, uint64_t start = 0);

    uint64_t position() const { return stream_.getPosition(); }
    bool at_end() const { return position() >= stream_.getTotalBytesCount(); }

    /// The next object. \exception std::runtime_error with one line, the byte where the object starts
    /// included.
    mrpt::serialization::CSerializable::Ptr read();

 private:
    mrpt::io::CMemoryStream stream_;
    mrpt::serialization::CArchive::UniquePtr archive_;
};

/** Does in a child process what this process is about to do with the bytes of an archive.
 * \return what the task returns. \exception DataError if the task throws, crashes, or needs too much memory
 * or time.
 */
std::string rehearse(const std::string& source, std::string_view bytes,
                     const std::function<std::string()>& task);

/// Does it here, after a rehearsal; nobody forks meanwhile. \exception DataError if the task throws.
void perform(const std::string& source, const std::function<void()>& task);

/// A `.mm` file's content. \exception DataError
LoadedMap read_metric_map(const std::string& source, std::string_view bytes);

/// An entry of a rawlog or simplemap. \exception DataError, also if it holds no range data
mrpt::obs::CSensoryFrame::Ptr read_observations(const std::string& source, std::string_view bytes,
                                                uint64_t entry);

}  // namespace mp2p_icp
