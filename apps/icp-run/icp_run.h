#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/// Where a program writes.
struct ProgramStreams
{
    std::ostream& out;
    std::ostream& err;
    bool err_is_terminal = false;  ///< then long work shows its progress there
};

/// The exit codes of icp-run.
enum ExitCode : int
{
    EXIT_ALIGNED = 0,
    EXIT_WRONG_INPUT = 1,  ///< wrong usage or input, or an output that cannot be written
    EXIT_NOT_TRUSTED = 2   ///< ran, but the verdict is another one than `aligned`
};

/** The whole of icp-run: aligns two clouds as its arguments (without the program's name) say. Never throws:
 * every trouble is one line on `err` and EXIT_WRONG_INPUT. Help, version and descriptions give EXIT_ALIGNED.
 */
int icp_run(const std::vector<std::string>& arguments, const ProgramStreams& streams) noexcept;

}  // namespace mp2p_icp_apps
