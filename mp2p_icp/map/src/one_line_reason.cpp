#include "one_line_reason.h"

#include <algorithm>

namespace mp2p_icp
{
std::string one_line_reason(const std::exception& e)
{
    std::string text = e.what();
    for (const std::string mark : {"Original exception:\n", "Message:"})
        if (const auto at = text.rfind(mark); at != std::string::npos) text = text.substr(at + mark.size());
    text = text.substr(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    text = text.substr(0, text.find('\n'));
    return text.empty() ? "unknown error" : text;
}

}  // namespace mp2p_icp
