#include "cost_comparison.h"

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
bool CostComparison::has_risen(double gate) const
{
    return to - from > 3 * standard_error + 1e-6 * from + 1e-12 * gate * gate;
}

CostComparison compare_costs(const std::vector<double>& from, const std::vector<double>& to)
{
    CostComparison out;
    const size_t size = std::min(from.size(), to.size());
    const auto for_each_known = [&](const auto& f)
    {
        for (size_t i = 0; i < size; i++)
            if (std::isfinite(from[i]) && std::isfinite(to[i])) f(from[i], to[i]);
    };
    double count = 0, squares = 0;
    for_each_known([&](double a, double b) { out.from += a, out.to += b, count++; });
    if (count == 0) return out;
    out.from /= count, out.to /= count;
    for_each_known([&](double a, double b) { squares += std::pow(b - a - (out.to - out.from), 2); });
    if (count > 1) out.standard_error = std::sqrt(squares / (count * (count - 1)));
    return out;
}

}  // namespace mp2p_icp
