// GCC 12 warns about its own <regex> when sanitizers are on (GCC bug 105562).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include "text_match.h"

#include <regex>

namespace mp2p_icp_filters
{
std::string regex_problem(const std::string& expression)
{
    try
    {
        const std::regex compiled(expression);
        return {};
    }
    catch (const std::regex_error& e)
    {
        return e.what();
    }
}

bool regex_matches(const std::string& text, const std::string& expression)
{
    if (expression.empty()) return false;
    if (expression == ".*") return true;  // the default
    return std::regex_match(text, std::regex(expression));
}
}  // namespace mp2p_icp_filters
