#pragma once

#include <vector>

namespace mp2p_icp
{
/// Matcher::truncated_costs() of two poses, over the local points of which both are known.
struct CostComparison
{
    double from = 0, to = 0;    ///< the means, m^2; 0 if nothing can be compared
    double standard_error = 0;  ///< of their difference, the points taken as independent, m^2

    /** Has the mean risen by more than three times its own standard error? Costs are samples: which points
     * lie just inside the gate, and which one is the nearest, changes with every micrometre, so that one of
     * two equally good poses would always be "worse"; like this, one in 700 is. The rounding of float
     * distances is not a rise either.
     */
    bool has_risen(double gate) const;
};

/// The two lists are of the same length. O(N).
CostComparison compare_costs(const std::vector<double>& from, const std::vector<double>& to);

}  // namespace mp2p_icp
