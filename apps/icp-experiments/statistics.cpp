#include "statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mp2p_icp_apps::experiments
{
namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

double quantile(const std::vector<double>& sorted, double share)
{
    const double place = share * static_cast<double>(sorted.size() - 1);
    const auto below = static_cast<size_t>(place);
    const size_t above = std::min(below + 1, sorted.size() - 1);
    return sorted[below] + (place - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}
}  // namespace

double root_mean_square(const std::vector<double>& values)
{
    double sum = 0;
    for (const double v : values) sum += v * v;
    return values.empty() ? NaN : std::sqrt(sum / static_cast<double>(values.size()));
}

Statistics statistics_of(std::vector<double> values)
{
    if (values.empty()) return {0, NaN, NaN, NaN, NaN, NaN, NaN, NaN};
    const double rmse = root_mean_square(values);
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) { return quantile(values, share); };
    return {values.size(), at(.05), at(.25), at(.5), at(.75), at(.95), rmse, values.back()};
}

Share share_of(size_t hits, size_t runs)
{
    if (runs == 0) return {NaN, NaN, NaN};
    const auto n = static_cast<double>(runs);
    const double p = static_cast<double>(hits) / n, z_sq = 1.96 * 1.96;
    const double middle = (p + z_sq / (2 * n)) / (1 + z_sq / n);
    const double half = std::sqrt(z_sq * (p * (1 - p) / n + z_sq / (4 * n * n))) / (1 + z_sq / n);
    return {p, std::min(p, middle - half), std::max(p, middle + half)};
}

Line fitted_line(const std::vector<double>& x, const std::vector<double>& y)
{
    double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
    for (size_t i = 0; i < x.size(); i++)
    {
        const double weight = 1 / (y[i] * y[i]);
        w += weight, wx += weight * x[i], wy += weight * y[i];
        wxx += weight * x[i] * x[i], wxy += weight * x[i] * y[i];
    }
    const double slope = (w * wxy - wx * wy) / (w * wxx - wx * wx);
    return {(wy - slope * wx) / w, slope};
}

}  // namespace mp2p_icp_apps::experiments
