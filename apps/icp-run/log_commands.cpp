#include "log_commands.h"

#include <mp2p_icp/diagnosis.h>
#include <mp2p_icp/replay.h>

#include <ostream>

namespace mp2p_icp_apps
{
int replay_log(const std::string& file_name, std::ostream& out)
{
    const auto outcome = mp2p_icp::replay(mp2p_icp::LogRecord::load_from_file(file_name));
    out << "replay: " << outcome.sentence << "\n";
    return outcome.same ? EXIT_ALIGNED : EXIT_WRONG_INPUT;
}

int explain_log(const std::string& file_name, std::ostream& out)
{
    const auto diagnosis = mp2p_icp::diagnose(mp2p_icp::LogRecord::load_from_file(file_name));
    for (const auto& sentence : diagnosis.sentences) out << sentence << "\n";
    return EXIT_ALIGNED;
}

}  // namespace mp2p_icp_apps
