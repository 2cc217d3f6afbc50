#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace mp2p_icp_test
{
/// `work` must throw a `Problem` whose text has all of `parts` in it.
template <class Problem, class Work>
void expect_problem_with(const std::vector<std::string>& parts, const Work& work)
{
    try
    {
        work();
        ADD_FAILURE() << "nothing was thrown; expected: " << (parts.empty() ? "" : parts[0]);
    }
    catch (const Problem& e)
    {
        for (const auto& part : parts)
            EXPECT_NE(std::string(e.what()).find(part), std::string::npos)
                << "'" << part << "' is not in: " << e.what();
    }
}
}  // namespace mp2p_icp_test
