#pragma once

#include <gtest/gtest.h>
#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

namespace mp2p_icp_test
{
using mp2p_icp::metric_map_t;
using mp2p_icp::Pairings;
using mp2p_icp::SeededRandom;
using mrpt::maps::CSimplePointsMap;
using mrpt::math::TPoint3Df;
using mrpt::poses::CPose3D;

const float NaN = std::numeric_limits<float>::quiet_NaN();

using Cloud = std::vector<TPoint3Df>;

inline Cloud random_cloud(size_t n, double size, uint64_t seed)
{
    SeededRandom random(seed);
    Cloud cloud(n);
    for (auto& p : cloud)
        for (float* v : {&p.x, &p.y, &p.z}) *v = static_cast<float>(random.uniform(-size, size));
    return cloud;
}

inline CSimplePointsMap::Ptr points_map(const Cloud& cloud)
{
    const auto map = CSimplePointsMap::Create();
    for (const auto& p : cloud) map->insertPoint(p.x, p.y, p.z);
    return map;
}
inline metric_map_t map_of(const std::map<std::string, Cloud>& layers)
{
    metric_map_t m;
    for (const auto& [name, cloud] : layers) m.layers[name] = points_map(cloud);
    return m;
}
inline metric_map_t raw_map(const Cloud& cloud)
{
    return map_of({{"raw", cloud}});
}

/// (global index, local index) in the order of the list.
using IndexPairs = std::vector<std::pair<uint32_t, uint32_t>>;
inline IndexPairs index_pairs(const Pairings& p)
{
    IndexPairs out;
    for (const auto& x : p.paired_pt2pt) out.emplace_back(x.globalIdx, x.localIdx);
    return out;
}

inline Pairings matched(const mp2p_icp::Matcher& m, const metric_map_t& global, const metric_map_t& local,
                        const CPose3D& pose = {}, const mp2p_icp::MatchContext& context = {})
{
    mp2p_icp::MatchState state(global, local);
    Pairings out;
    EXPECT_TRUE(m.match(global, local, pose, context, state, out));
    return out;
}

/// The slow way to pair two clouds: every distance, in float, of the moved points rounded to float.
struct BruteForce
{
    Cloud global, local, moved;
    BruteForce(const Cloud& g, const Cloud& l, const CPose3D& pose) : global(g), local(l)
    {
        const Eigen::Matrix3d R = mp2p_icp::rotation_of(pose);
        const Eigen::Vector3d t = mp2p_icp::translation_of(pose);
        for (const auto& p : l)
        {
            const Eigen::Vector3d q = R * Eigen::Vector3d(double(p.x), double(p.y), double(p.z)) + t;
            moved.emplace_back(static_cast<float>(q.x()), static_cast<float>(q.y()),
                               static_cast<float>(q.z()));
        }
    }
    float dist_sq(size_t g, size_t l) const
    {
        const float dx = moved[l].x - global[g].x, dy = moved[l].y - global[g].y,
                    dz = moved[l].z - global[g].z;
        return dx * dx + dy * dy + dz * dz;
    }
    double range_sq(size_t l) const
    {
        const double x = double(local[l].x), y = double(local[l].y), z = double(local[l].z);
        return x * x + y * y + z * z;
    }
    struct Candidate
    {
        uint32_t global, local;
        float dist_sq;
    };
    /// Up to k nearest per local point, nearer than its limit, ties by the lower global index.
    template <class LimitSq>
    std::vector<Candidate> candidates(size_t k, const LimitSq& limit_sq) const
    {
        std::vector<Candidate> out;
        for (uint32_t l = 0; l < local.size(); l++)
        {
            std::vector<std::pair<float, uint32_t>> all;
            for (uint32_t g = 0; g < global.size(); g++)
                if (dist_sq(g, l) < limit_sq(l)) all.emplace_back(dist_sq(g, l), g);
            std::sort(all.begin(), all.end());
            for (size_t i = 0; i < std::min(k, all.size()); i++)
                out.push_back({all[i].second, l, all[i].first});
        }
        return out;
    }
    /// Of each global point's candidates, the nearest stays; the lower local index among equals.
    static std::vector<Candidate> one_to_one(const std::vector<Candidate>& in)
    {
        std::vector<Candidate> out;
        for (const auto& c : in)
        {
            bool best = true;
            for (const auto& o : in)
                if (o.global == c.global &&
                    (o.dist_sq < c.dist_sq || (o.dist_sq == c.dist_sq && o.local < c.local)))
                    best = false;
            if (best) out.push_back(c);
        }
        return out;
    }
    static IndexPairs indices(const std::vector<Candidate>& in)
    {
        IndexPairs out;
        for (const auto& c : in) out.emplace_back(c.global, c.local);
        return out;
    }
};

/// A pose that leaves clouds near each other.
inline CPose3D small_pose(SeededRandom& random)
{
    return {random.uniform(-1, 1),     random.uniform(-1, 1),     random.uniform(-1, 1),
            random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)};
}
}  // namespace mp2p_icp_test
