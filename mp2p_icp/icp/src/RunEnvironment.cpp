#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/parallel.h>
#include <mp2p_icp/version.h>
#include <mrpt/system/os.h>

#include <fstream>

namespace mp2p_icp
{
namespace
{
/// `model name` (or, on other processors, `Model`) of /proc/cpuinfo.
std::string processor_name()
{
    std::ifstream in("/proc/cpuinfo");
    for (std::string line; std::getline(in, line);)
    {
        const auto colon = line.find(": ");
        if (colon != std::string::npos && (line.rfind("model name", 0) == 0 || line.rfind("Model", 0) == 0))
            return line.substr(colon + 2);
    }
    return "unknown";
}
}  // namespace

RunEnvironment this_environment()
{
    static const std::string processor = processor_name();
    return {MP2P_ICP_VERSION, mrpt::system::MRPT_getVersion(),
#ifdef __clang__
            "Clang " __clang_version__,
#else
            "GCC " __VERSION__,
#endif
            processor, static_cast<uint32_t>(threads_at_hand())};
}

}  // namespace mp2p_icp
