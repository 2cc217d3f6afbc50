#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace mp2p_icp_certify
{
/// The exit codes of icp-certify; like those of icp-run.
enum ExitCode : int
{
    EXIT_HOLDS = 0,
    EXIT_WRONG_INPUT = 1,  ///< wrong usage, or a file that cannot be read
    EXIT_DOES_NOT_HOLD = 2
};

/** The whole of icp-certify: checks a certificate as its arguments (without the program's name) say. Never
 * throws: every trouble is one line on `err` and EXIT_WRONG_INPUT. Help and version give EXIT_HOLDS.
 */
int icp_certify(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) noexcept;

}  // namespace mp2p_icp_certify
