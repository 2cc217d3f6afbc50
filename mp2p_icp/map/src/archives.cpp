#include "archives.h"

#include <mp2p_icp/errors.h>
#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/obs/registerAllClasses.h>
#include <mrpt/version.h>

#include <algorithm>

#include "files.h"
#include "one_line_reason.h"
#include "sandbox.h"

namespace mp2p_icp
{
namespace
{
/// MRPT finds classes by name only after this.
void register_mrpt_classes()
{
    static const bool done = []
    {
        mrpt::obs::registerAllClasses_mrpt_obs();
        mrpt::maps::registerAllClasses_mrpt_maps();
        return true;
    }();
    (void)done;
}

/// MRPT's messages in our words.
std::string archive_reason(const std::exception& e)
{
    const std::string text = one_line_reason(e);
    const std::string start = "Stored object has class '", end = "' which is not registered";
    const auto from = text.find(start), to = text.find(end);
    if (from == std::string::npos || to == std::string::npos) return text;
    const auto name = text.substr(from + start.size(), to - from - start.size());
    constexpr auto digit = [](int shift) { return std::to_string((MRPT_VERSION >> shift) & 15); };
    return "holds an object of the class '" + name + "', which MRPT " + digit(8) + "." + digit(4) + "." +
           digit(0) + " does not have";
}
}  // namespace

ArchiveReader::ArchiveReader(std::string_view bytes, uint64_t start)
{
    stream_.assignMemoryNotOwn(bytes.data(), bytes.size());
    stream_.Seek(static_cast<int64_t>(start));
    archive_ = mrpt::serialization::archiveUniquePtrFrom(stream_);
}

mrpt::serialization::CSerializable::Ptr ArchiveReader::read()
{
    const uint64_t begin = position();
    try
    {
        return archive_->ReadObject();
    }
    catch (const std::bad_alloc&)
    {
        throw;
    }
    catch (const std::exception& e)
    {
        throw std::runtime_error("the object at " + place_byte(begin) +
                                 " cannot be read: " + archive_reason(e));
    }
}

std::string rehearse(const std::string& source, std::string_view bytes,
                     const std::function<std::string()>& task)
{
    register_mrpt_classes();
    // Real archives need a few times their own size (observations are small objects; depth images become
    // points), and are read at tens of MB/s. Damaged ones that would claim much more end early.
    constexpr uint64_t fixed_bytes = 256'000'000, times_own_size = 64;
    constexpr double slowest_bytes_per_second = 2e6;
    SandboxLimits limits;
    limits.extra_memory_bytes =
        std::min(READ_MEMORY_BUDGET_BYTES - bytes.size(), fixed_bytes + times_own_size * bytes.size());
    limits.seconds = 60 + static_cast<double>(bytes.size()) / slowest_bytes_per_second;
    const auto outcome = run_in_sandbox(task, limits);
    if (!outcome.ok) throw DataError(source, outcome.text);
    return outcome.text;
}

void perform(const std::string& source, const std::function<void()>& task)
{
    const std::lock_guard<std::mutex> lock(sandbox_mutex());
    try
    {
        task();
    }
    catch (const std::exception& e)
    {
        throw DataError(source, one_line_reason(e));
    }
}

}  // namespace mp2p_icp
