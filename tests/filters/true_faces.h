#pragma once

#include <mp2p_icp/plane_patch.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mrpt/core/bits_math.h>

#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace mp2p_icp_test
{
/// A synthetic scan of a world, and the world.
struct ScannedWorld
{
    mp2p_icp::synthetic::TriangleMesh mesh;
    mrpt::poses::CPose3D pose;  ///< of the sensor in the world
    mp2p_icp::synthetic::SyntheticScan scan;
};

inline mp2p_icp::synthetic::RotatingLidar lidar_of(double lowest_deg, double highest_deg, double sigma,
                                                   uint64_t seed)
{
    mp2p_icp::synthetic::RotatingLidar lidar;
    lidar.rings = 64, lidar.azimuth_steps = 900;
    lidar.lowest_deg = lowest_deg, lidar.highest_deg = highest_deg;
    lidar.sigma = sigma, lidar.seed = seed;
    return lidar;
}
inline ScannedWorld scanned_room(uint64_t seed, double sigma = 0.01)
{
    ScannedWorld w{
        mp2p_icp::synthetic::room_with_boxes(10, 8, 3, 6, 100 + seed), {0.2, 0.1, 1.2, 0.3, 0.02, -0.03}, {}};
    w.scan = scan_from(mp2p_icp::synthetic::RayTracer(w.mesh), w.pose, lidar_of(-45, 45, sigma, seed + 1));
    return w;
}
inline ScannedWorld scanned_street(uint64_t seed, double sigma = 0.01)
{
    ScannedWorld w{mp2p_icp::synthetic::street(60, 100 + seed), {0.2, 0.1, 1.8, 0.3, 0.02, -0.03}, {}};
    w.scan = scan_from(mp2p_icp::synthetic::RayTracer(w.mesh), w.pose, lidar_of(-25, 15, sigma, seed + 1));
    return w;
}

/// An infinite plane of a world's surface, in the sensor's frame: normal towards the sensor, n'x = offset.
struct TrueFace
{
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double offset = 0;
};
inline TrueFace face_of(const ScannedWorld& w, uint32_t triangle)
{
    const auto t = w.mesh.triangle(triangle);
    const Eigen::Matrix3d R = mp2p_icp::rotation_of(w.pose);
    Eigen::Vector3d n = R.transpose() * t.normal();
    double offset = n.dot(R.transpose() * (t.a - mp2p_icp::translation_of(w.pose)));
    if (offset > 0) n = -n, offset = -offset;
    return {n, offset};
}

/// The face on which most of these points lie, and which share of them does.
struct FaceShare
{
    TrueFace face;
    double share;
};
inline FaceShare main_face(const ScannedWorld& w, const std::vector<uint32_t>& points)
{
    std::map<std::array<long, 4>, std::pair<size_t, TrueFace>> votes;  // triangles of one plane vote together
    for (const uint32_t i : points)
    {
        const TrueFace f = face_of(w, w.scan.triangle[i]);
        auto& vote = votes[{std::lround(f.normal.x() * 1e4), std::lround(f.normal.y() * 1e4),
                            std::lround(f.normal.z() * 1e4), std::lround(f.offset * 1e3)}];
        vote.first++, vote.second = f;
    }
    std::pair<size_t, TrueFace> best{0, {}};
    for (const auto& [key, vote] : votes)
        if (vote.first > best.first) best = vote;
    return {best.second, static_cast<double>(best.first) / static_cast<double>(points.size())};
}

/// How far a plane is from the truth.
struct PlaneError
{
    double angle_deg;     ///< between the normals, up to 180
    double offset;        ///< distance of the centroid from the true plane, m
    Eigen::Vector3d abh;  ///< see plane_fit_t::covariance
};
inline PlaneError error_of(const mp2p_icp::fitted_plane_t& plane, const TrueFace& face)
{
    const Eigen::Vector3d n = plane.normal(), u = plane.fit->axis_u, v = n.cross(u);
    const double height = face.normal.dot(mp2p_icp::to_eigen(plane.centroid)) - face.offset;
    return {mrpt::RAD2DEG(std::acos(std::clamp(n.dot(face.normal), -1.0, 1.0))),
            std::abs(height),
            {-face.normal.dot(u), -face.normal.dot(v), -height}};
}

/// Is the plane predicted to be known within 3 mm and 0.15 degrees?
inline bool is_sure(const mp2p_icp::plane_fit_t& fit)
{
    return fit.offset_deviation() < 0.003 && mrpt::RAD2DEG(fit.angle_deviation()) < 0.15;
}
}  // namespace mp2p_icp_test
