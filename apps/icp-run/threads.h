#pragma once

#include <functional>
#include <optional>

namespace mp2p_icp_apps
{
/** Does the work on at most so many threads; on as many as the machine has if not given. An exception of the
 * work reaches the caller. \exception std::invalid_argument for more than one in a build without TBB.
 */
void with_threads(const std::optional<unsigned>& count, const std::function<void()>& work);

}  // namespace mp2p_icp_apps
