#pragma once

#include <cstddef>
#include <cstdlib>

namespace mp2p_icp_test
{
/// How often a random test repeats: `usual`, or `full` where the environment variable MP2PICP_FULL_TESTS is
/// set.
inline size_t repetitions(size_t usual, size_t full)
{
    return std::getenv("MP2PICP_FULL_TESTS") ? full : usual;
}
}  // namespace mp2p_icp_test
