#pragma once

#include <string>

namespace mp2p_icp_filters
{
/// What is wrong with a regular expression (ECMAScript); empty if nothing is.
std::string regex_problem(const std::string& expression);

/// Does the expression match the whole text? An empty expression matches nothing, not even an empty text.
bool regex_matches(const std::string& text, const std::string& expression);
}  // namespace mp2p_icp_filters
