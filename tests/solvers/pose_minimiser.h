#pragma once

#include <mrpt/poses/CPose3DPDFGaussianInf.h>

#include <algorithm>

#include "solver_test_tools.h"

namespace mp2p_icp_test
{
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// x y z yaw pitch roll.
inline Vector6 coordinates(const CPose3D& p)
{
    return (Vector6() << p.x(), p.y(), p.z(), p.yaw(), p.pitch(), p.roll()).finished();
}
inline CPose3D pose_of(const Vector6& c)
{
    return {c(0), c(1), c(2), c(3), c(4), c(5)};
}

inline mrpt::poses::CPose3DPDFGaussianInf prior_of(const CPose3D& mean, const Matrix6& information)
{
    mrpt::poses::CPose3DPDFGaussianInf prior;
    prior.mean = mean;
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) prior.cov_inv(r, c) = information(r, c);
    return prior;
}

/// The slow way down: a simplex (Nelder and Mead) over the six coordinates.
template <class Cost>
Vector6 nelder_mead(const Cost& cost, const Vector6& start, double size)
{
    std::vector<std::pair<double, Vector6>> s;
    for (int i = 0; i < 7; i++)
    {
        Vector6 v = start;
        if (i < 6) v(i) += size;
        s.emplace_back(cost(v), v);
    }
    const auto by_cost = [](const auto& a, const auto& b) { return a.first < b.first; };
    for (int k = 0; k < 4000; k++)
    {
        std::sort(s.begin(), s.end(), by_cost);
        if ((s[6].second - s[0].second).norm() < 1e-10) break;
        Vector6 centre = Vector6::Zero();
        for (int i = 0; i < 6; i++) centre += s[static_cast<size_t>(i)].second / 6;
        const auto at = [&](double f)
        {
            const Vector6 v = centre + f * (centre - s[6].second);
            return std::make_pair(cost(v), v);
        };
        auto next = at(1);
        if (next.first < s[0].first)
        {
            next = std::min(next, at(2), by_cost);
        }
        else if (next.first >= s[5].first)
        {
            next = std::min(at(0.5), at(-0.5), by_cost);
        }
        if (next.first < s[6].first)
            s[6] = next;
        else
            for (size_t i = 1; i < 7; i++)
                s[i].second = 0.5 * (s[i].second + s[0].second), s[i].first = cost(s[i].second);
    }
    return s[0].second;
}

/// The best of several starts, each polished by restarting.
template <class Cost>
Vector6 brute_force(const Cost& cost, const std::vector<CPose3D>& starts)
{
    Vector6 best = coordinates(starts[0]);
    for (const auto& start : starts)
    {
        Vector6 c = coordinates(start);
        for (const double size : {0.5, 0.1, 0.02, 0.004}) c = nelder_mead(cost, c, size);
        if (cost(c) < cost(best)) best = c;
    }
    return best;
}

inline Matrix6 random_information(SeededRandom& random, double scale)
{
    Matrix6 A;
    for (int i = 0; i < 36; i++) A(i / 6, i % 6) = random.gaussian();
    return scale * A * A.transpose();
}
}  // namespace mp2p_icp_test
