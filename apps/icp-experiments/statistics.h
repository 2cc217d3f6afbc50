#pragma once

#include <cstddef>
#include <vector>

namespace mp2p_icp_apps::experiments
{
/// Of one number over many runs. All NaN without runs.
struct Statistics
{
    std::size_t runs = 0;
    double q05, q25, median, q75, q95;
    double rmse;  ///< root of the mean square
    double largest;
};
/// Quantiles are interpolated between the two nearest runs.
Statistics statistics_of(std::vector<double> values);

/// Root of the mean square; NaN of nothing.
double root_mean_square(const std::vector<double>& values);

/// A share of runs, with the 95 % interval of Wilson.
struct Share
{
    double value, low, high;
};
Share share_of(std::size_t hits, std::size_t runs);

/// The line a + b x that fits best where every y has the same relative error. Needs two distinct x.
struct Line
{
    double constant, slope;
};
Line fitted_line(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace mp2p_icp_apps::experiments
