#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/se3.h>

#include <vector>

namespace mp2p_icp
{
/// A point pairing, both sides relative to the first finite one: sums and means keep their digits then.
struct PointPair
{
    Eigen::Vector3d a, b;
    size_t index;
};
using PointPairs = std::vector<PointPair>;

inline PointPairs finite_pairs(const MatchedPointList& pairs)
{
    PointPairs out;
    out.reserve(pairs.size());
    for (size_t i = 0; i < pairs.size(); i++)
    {
        const Eigen::Vector3d a = to_eigen(mrpt::math::TPoint3D(pairs[i].global)),
                              b = to_eigen(mrpt::math::TPoint3D(pairs[i].local));
        if (a.allFinite() && b.allFinite()) out.push_back({a, b, i});
    }
    if (out.empty()) return out;
    const Eigen::Vector3d a0 = out[0].a, b0 = out[0].b;
    for (auto& p : out) p.a -= a0, p.b -= b0;
    return out;
}

inline std::vector<size_t> indices_of(const PointPairs& pairs)
{
    std::vector<size_t> out;
    out.reserve(pairs.size());
    for (const auto& p : pairs) out.push_back(p.index);
    return out;
}

}  // namespace mp2p_icp
