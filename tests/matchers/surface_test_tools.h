#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <cstring>

#include "matcher_test_tools.h"

namespace mp2p_icp_test
{
inline Eigen::Vector3d to_double(const TPoint3Df& p)
{
    return {double(p.x), double(p.y), double(p.z)};
}
inline TPoint3Df to_point(const Eigen::Vector3d& p)
{
    return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}
inline Eigen::Vector3d random_unit(SeededRandom& random)
{
    return Eigen::Vector3d(random.gaussian(), random.gaussian(), random.gaussian()).normalized();
}

/// Some planes, lines and balls of points, each about 3 m across, in random order of kinds.
inline Cloud cloud_of_shapes(size_t shapes, size_t points_each, double noise, uint64_t seed)
{
    SeededRandom random(seed);
    Cloud cloud;
    for (size_t s = 0; s < shapes; s++)
    {
        const Eigen::Vector3d u = random_unit(random), v = u.unitOrthogonal(), w = u.cross(v);
        const Eigen::Vector3d at(random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(-4, 4));
        const size_t dimensions = 1 + s % 3;
        for (size_t i = 0; i < points_each; i++)
        {
            Eigen::Vector3d p = at + random.uniform(-1.5, 1.5) * u;
            if (dimensions > 1) p += random.uniform(-1.5, 1.5) * v;
            if (dimensions > 2) p += random.uniform(-1.5, 1.5) * w;
            cloud.push_back(to_point(
                p + noise * Eigen::Vector3d(random.gaussian(), random.gaussian(), random.gaussian())));
        }
    }
    return cloud;
}

/// A cloud near another one: its points, moved a little.
inline Cloud scattered(const Cloud& cloud, double size, uint64_t seed)
{
    SeededRandom random(seed);
    Cloud out;
    for (const auto& p : cloud)
        out.push_back(to_point(to_double(p) + random.uniform(0, size) * random_unit(random)));
    return out;
}

/// The slow way: the k nearest points within a radius of one of them, and their principal axes.
struct SlowPca
{
    size_t count = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), values = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::Zero();

    SlowPca() = default;
    SlowPca(const Cloud& cloud, size_t of, size_t k, double radius)
    {
        std::vector<std::pair<float, size_t>> all;
        for (size_t i = 0; i < cloud.size(); i++)
        {
            const float d = (cloud[i] - cloud[of]).sqrNorm();
            if (d < static_cast<float>(radius * radius)) all.emplace_back(d, i);
        }
        std::sort(all.begin(), all.end());
        count = std::min(all.size(), k);
        for (size_t j = 0; j < count; j++)
            mean += to_double(cloud[all[j].second]) / static_cast<double>(count);
        Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
        for (size_t j = 0; j < count; j++)
        {
            const Eigen::Vector3d d = to_double(cloud[all[j].second]) - mean;
            covariance += d * d.transpose() / static_cast<double>(count);
        }
        const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU);
        values = svd.singularValues().reverse();
        normal = svd.matrixU().col(2), direction = svd.matrixU().col(0);
    }
};

/// An answer of a slow reference; Unsure where rounding to float may decide.
enum class Answer
{
    No,
    Unsure,
    Yes
};
inline Answer less(double a, double b)
{
    if (std::abs(a - b) <= 2e-6 * std::max(std::abs(a), std::abs(b)) + 1e-9) return Answer::Unsure;
    return a < b ? Answer::Yes : Answer::No;
}
inline Answer all_of(std::initializer_list<Answer> answers)
{
    return std::min(answers);
}

/// Up to k nearest global points of each local one, closer than a distance.
inline std::vector<std::vector<uint32_t>> slow_nearest(const BruteForce& clouds, size_t k, double distance)
{
    std::vector<std::vector<uint32_t>> out(clouds.local.size());
    for (const auto& c :
         clouds.candidates(k, [distance](size_t) { return static_cast<float>(distance * distance); }))
        out[c.local].push_back(c.global);
    return out;
}

template <class T>
bool same_bits_of(const std::vector<T>& a, const std::vector<T>& b)
{
    return a.size() == b.size() &&
           (a.empty() || std::memcmp(static_cast<const void*>(a.data()), static_cast<const void*>(b.data()),
                                     a.size() * sizeof(T)) == 0);
}
/// Of all numbers in the lists of points, planes and lines.
inline void expect_same_pairings(const Pairings& a, const Pairings& b)
{
    EXPECT_TRUE(same_bits_of(a.paired_pt2pl, b.paired_pt2pl));
    EXPECT_TRUE(same_bits_of(a.paired_pt2ln, b.paired_pt2ln));
    EXPECT_EQ(index_pairs(a), index_pairs(b));
    EXPECT_EQ(a.potential_pairings, b.potential_pairings);
    EXPECT_EQ(a.pt2pl_weights, b.pt2pl_weights);
    EXPECT_EQ(a.pt2ln_weights, b.pt2ln_weights);
    EXPECT_EQ(a.point_weights, b.point_weights);
}

inline Eigen::Vector3d normal_of(const mp2p_icp::point_plane_pair_t& pair)
{
    const auto& c = pair.pl_global.plane.coefs;
    return {c[0], c[1], c[2]};
}
inline Eigen::Vector3d direction_of(const mp2p_icp::point_line_pair_t& pair)
{
    const auto& d = pair.ln_global.director;
    return {d[0], d[1], d[2]};
}

/// A lattice of points on the plane through `at` that u and v span, from -n to n steps each way.
inline void add_lattice(Cloud& cloud, const Eigen::Vector3d& at, const Eigen::Vector3d& u,
                        const Eigen::Vector3d& v, int n, double step)
{
    for (int i = -n; i <= n; i++)
        for (int j = -n; j <= n; j++) cloud.push_back(to_point(at + step * (i * u + j * v)));
}
}  // namespace mp2p_icp_test
