#pragma once

#include <gtest/gtest.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/observability.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/random_pose.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

namespace mp2p_icp_test
{
using Eigen::Matrix3d;
using Eigen::Vector3d;
using mp2p_icp::Pairings;
using mp2p_icp::SeededRandom;
using mrpt::poses::CPose3D;

inline Vector3d random_direction(SeededRandom& random)
{
    return Vector3d(random.gaussian(), random.gaussian(), random.gaussian()).normalized();
}
inline Vector3d random_point(SeededRandom& random, double size)
{
    const double x = random.uniform(-size, size), y = random.uniform(-size, size);
    return {x, y, random.uniform(-size, size)};
}
inline Matrix3d rotation_about(const Vector3d& axis, double angle)
{
    return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}
inline CPose3D any_pose(SeededRandom& random, double size = 20)
{
    return mp2p_icp::synthetic::random_pose({size, size, size, M_PI, M_PI / 2, M_PI}, random);
}
inline Matrix3d any_rotation(SeededRandom& random)
{
    return Eigen::Quaterniond(random.gaussian(), random.gaussian(), random.gaussian(), random.gaussian())
        .normalized()
        .toRotationMatrix();
}

inline void add_pair(Pairings& p, const Vector3d& global, const Vector3d& local)
{
    const auto index = static_cast<uint32_t>(p.paired_pt2pt.size());
    p.paired_pt2pt.push_back(
        mrpt::tfest::TMatchingPair_d(index, index, mp2p_icp::to_mrpt(global), mp2p_icp::to_mrpt(local)));
}
inline Vector3d global_of(const Pairings& p, size_t i)
{
    return mp2p_icp::to_eigen(mrpt::math::TPoint3D(p.paired_pt2pt[i].global));
}
inline Vector3d local_of(const Pairings& p, size_t i)
{
    return mp2p_icp::to_eigen(mrpt::math::TPoint3D(p.paired_pt2pt[i].local));
}
/// The local points, exactly moved by the pose (plus noise), as global ones.
inline Pairings moved_points(const std::vector<Vector3d>& local, const Matrix3d& R, const Vector3d& t,
                             double noise = 0, uint64_t seed = 1)
{
    SeededRandom random(seed);
    Pairings p;
    for (const auto& b : local)
        add_pair(p, R * b + t + noise * Vector3d(random.gaussian(), random.gaussian(), random.gaussian()), b);
    return p;
}
inline std::vector<Vector3d> random_points(size_t n, double size, uint64_t seed)
{
    SeededRandom random(seed);
    std::vector<Vector3d> points(n);
    for (auto& p : points) p = random_point(random, size);
    return points;
}

inline double point_cost(const Pairings& p, const std::vector<double>& w, const Matrix3d& R,
                         const Vector3d& t)
{
    double sum = 0;
    for (size_t i = 0; i < p.paired_pt2pt.size(); i++)
        sum += w[i] * (R * local_of(p, i) + t - global_of(p, i)).squaredNorm();
    return sum;
}

/// Angle between two rotations, rad.
inline double angle_between(const Matrix3d& A, const Matrix3d& B)
{
    return mp2p_icp::rotation_angle(A.transpose() * B);
}

inline std::vector<std::pair<size_t, double>> as_runs(const std::vector<double>& weights)
{
    std::vector<std::pair<size_t, double>> runs;
    for (const double w : weights) runs.emplace_back(1, w);
    return runs;
}

inline mp2p_icp::ObservabilityParameters known_sigma(const std::optional<double>& sigma)
{
    mp2p_icp::ObservabilityParameters p;
    p.sigma = sigma;
    return p;
}

inline void expect_same_bits(const CPose3D& a, const CPose3D& b)
{
    EXPECT_EQ(mp2p_icp::rotation_of(a), mp2p_icp::rotation_of(b));
    EXPECT_EQ(mp2p_icp::translation_of(a), mp2p_icp::translation_of(b));
}
}  // namespace mp2p_icp_test
