#pragma once

#include <exception>
#include <string>

namespace mp2p_icp
{
/** One line of an exception's text. MRPT reports an exception inside an exception inside ..., over many lines
 * with call stacks; the innermost one says what happened.
 */
std::string one_line_reason(const std::exception& e);

}  // namespace mp2p_icp
