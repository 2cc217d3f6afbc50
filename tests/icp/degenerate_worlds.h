#pragma once

#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cmath>
#include <string>
#include <vector>

namespace mp2p_icp_test
{
/// A quadrilateral: corners in order.
inline mp2p_icp::synthetic::TriangleMesh quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                              const Eigen::Vector3d& c, const Eigen::Vector3d& d)
{
    mp2p_icp::synthetic::TriangleMesh mesh;
    for (const auto& v : {a, b, c, d}) mesh.vertices.push_back(mp2p_icp::to_mrpt(v));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}
inline mp2p_icp::synthetic::TriangleMesh wall(double y)
{
    return quad({-300, y, -300}, {300, y, -300}, {300, y, 300}, {-300, y, 300});
}
inline mp2p_icp::synthetic::TriangleMesh ground()
{
    return quad({-300, -300, 0}, {300, -300, 0}, {300, 300, 0}, {-300, 300, 0});
}

inline mp2p_icp::synthetic::TriangleMesh two_walls()
{
    auto mesh = wall(-3);
    mesh.append(wall(4));
    return mesh;
}

/// A round tunnel about the x axis.
inline mp2p_icp::synthetic::TriangleMesh tunnel(double radius)
{
    constexpr int SIDES = 240;
    mp2p_icp::synthetic::TriangleMesh mesh;
    const auto rim = [&](int i, double x)
    {
        return Eigen::Vector3d(x, radius * std::cos(2 * M_PI * i / SIDES),
                               radius * std::sin(2 * M_PI * i / SIDES));
    };
    for (int i = 0; i < SIDES; i++)
        mesh.append(quad(rim(i, -300), rim(i + 1, -300), rim(i + 1, 300), rim(i, 300)));
    return mesh;
}

/// About the origin.
inline mp2p_icp::synthetic::TriangleMesh sphere(double radius)
{
    constexpr int RINGS = 60, SIDES = 120;
    mp2p_icp::synthetic::TriangleMesh mesh;
    const auto at = [&](int ring, int side)
    {
        const double polar = M_PI * ring / RINGS, around = 2 * M_PI * side / SIDES;
        return Eigen::Vector3d(radius * std::sin(polar) * std::cos(around),
                               radius * std::sin(polar) * std::sin(around), radius * std::cos(polar));
    };
    for (int r = 0; r < RINGS; r++)
        for (int s = 0; s < SIDES; s++)
            mesh.append(quad(at(r, s), at(r, s + 1), at(r + 1, s + 1), at(r + 1, s)));
    return mesh;
}

/// A world in which a range sensor cannot see all motions.
struct DegenerateWorld
{
    std::string name;
    mp2p_icp::synthetic::TriangleMesh mesh;
    size_t free;                     ///< motions
    std::vector<std::string> named;  ///< of them, those whose axis is one of the frame
};

inline std::vector<DegenerateWorld> degenerate_worlds()
{
    return {{"corridor", mp2p_icp::synthetic::corridor(600, 4, 3), 1, {"x"}},
            {"tunnel", tunnel(3), 2, {"roll", "x"}},
            {"open plane", ground(), 3, {"x", "y", "yaw"}},
            {"sphere", sphere(6), 3, {}},
            {"one wall", wall(4), 3, {"pitch", "x", "z"}},
            {"two walls", two_walls(), 3, {"pitch", "x", "z"}}};
}

}  // namespace mp2p_icp_test
