#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/** The whole of icp-solve: finds the pose that fits a file of pairings best, as its arguments (without the
 * program's name) say. Never throws: every trouble is one line on `err`. \return 0: the pairings determine
 * the pose (and no other fits as well, where that is proven); 1: wrong usage or input; 2: solved, but not
 * that.
 */
int icp_solve(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) noexcept;

}  // namespace mp2p_icp_apps
