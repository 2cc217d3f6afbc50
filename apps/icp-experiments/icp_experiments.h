#pragma once

#include <string>
#include <vector>

#include "icp_run.h"

namespace mp2p_icp_apps
{
/** The whole of icp-experiments: runs the experiments that its arguments (without the program's name) say.
 * Never throws: every trouble is one line on `err`. \return 0: all done; 1: wrong usage or input, or a file
 * that cannot be written; 2: all numbers are there, but not the figures.
 */
int icp_experiments(const std::vector<std::string>& arguments, const ProgramStreams& streams) noexcept;

}  // namespace mp2p_icp_apps
