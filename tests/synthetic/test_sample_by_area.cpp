#include <gtest/gtest.h>
#include <mp2p_icp/synthetic/load_obj_mesh.h>
#include <mp2p_icp/synthetic/sample_by_area.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cmath>
#include <filesystem>

using namespace mp2p_icp::synthetic;
using Eigen::Vector3d;

namespace
{
Vector3d point(const mrpt::maps::CSimplePointsMap& points, size_t i)
{
    mrpt::math::TPoint3D p;
    points.getPoint(i, p.x, p.y, p.z);
    return {p.x, p.y, p.z};
}

/// Index of the nearest triangle, and the distance to it.
std::pair<size_t, double> nearest(const TriangleMesh& mesh, const Vector3d& p)
{
    std::pair<size_t, double> best{0, 1e300};
    for (size_t i = 0; i < mesh.size(); i++)
        if (const double d = mesh.triangle(i).distance_to(p); d < best.second) best = {i, d};
    return best;
}

double chi_square(const std::vector<double>& found, const std::vector<double>& expected)
{
    double sum = 0;
    for (size_t i = 0; i < found.size(); i++) sum += std::pow(found[i] - expected[i], 2) / expected[i];
    return sum;
}

/// A limit that a chi-square value with `k` degrees of freedom stays below with probability 0.9999 (Wilson
/// and Hilferty).
double chi_square_limit(double k)
{
    return k * std::pow(1 - 2 / (9 * k) + 3.72 * std::sqrt(2 / (9 * k)), 3);
}
}  // namespace

TEST(sample_by_area, points_lie_on_the_triangles_and_each_gets_its_share)
{
    // Faces of very different sizes; apart from each other, so that the nearest triangle is the one drawn
    // from.
    TriangleMesh mesh;
    for (int i = 0; i < 8; i++)
    {
        const double s = 1 + i, x = 20.0 * i;
        mesh.append({{{x, 0, 0}, {x + s, 0, 1}, {x, s, -1}}, {{0, 1, 2}}});
    }
    mesh.append({{{500, 0, 0}, {501, 0, 0}, {502, 0, 0}}, {{0, 1, 2}}});  // no area: no point
    constexpr size_t COUNT = 40000;
    const auto points = sample_by_area(mesh, COUNT, 11);
    ASSERT_EQ(points->size(), COUNT);

    std::vector<double> found(8), expected;
    for (size_t i = 0; i < COUNT; i++)
    {
        const auto [triangle, distance] = nearest(mesh, point(*points, i));
        ASSERT_LT(distance, 1e-6 * 160);  // the points are float, the mesh is 160 m long
        ASSERT_LT(triangle, 8u);
        found[triangle]++;
    }
    for (size_t i = 0; i < 8; i++) expected.push_back(COUNT * mesh.triangle(i).area() / mesh.area());
    EXPECT_LT(chi_square(found, expected), chi_square_limit(7));
}

TEST(sample_by_area, points_are_uniform_within_a_triangle)
{
    // The lines between the middles of the sides cut a triangle into four of equal area.
    const TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
    constexpr size_t COUNT = 40000;
    const auto points = sample_by_area(mesh, COUNT, 5);
    std::vector<double> found(4);
    for (size_t i = 0; i < COUNT; i++)
    {
        const Vector3d p = point(*points, i);
        found[p.x() > 0.5 ? 0 : p.y() > 0.5 ? 1 : p.x() + p.y() < 0.5 ? 2 : 3]++;
    }
    EXPECT_LT(chi_square(found, std::vector<double>(4, COUNT / 4.0)), chi_square_limit(3));
}

TEST(sample_by_area, same_seed_same_points_other_seed_other_points)
{
    const auto mesh = box_room(3, 4, 5);
    const auto a = sample_by_area(mesh, 1000, 1), b = sample_by_area(mesh, 1000, 1),
               c = sample_by_area(mesh, 1000, 2);
    EXPECT_EQ(a->getPointsBufferRef_x(), b->getPointsBufferRef_x());
    EXPECT_EQ(a->getPointsBufferRef_y(), b->getPointsBufferRef_y());
    EXPECT_EQ(a->getPointsBufferRef_z(), b->getPointsBufferRef_z());
    size_t same = 0;
    for (size_t i = 0; i < 1000; i++) same += point(*a, i) == point(*c, i);
    EXPECT_EQ(same, 0u);
}

TEST(sample_by_area, a_mesh_without_area_is_refused)
{
    EXPECT_THROW(sample_by_area({}, 10, 1), std::invalid_argument);
    EXPECT_THROW(sample_by_area({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}, 10, 1),
                 std::invalid_argument);
}

TEST(sample_by_area, points_of_the_bunny_lie_on_the_bunny)
{
    const std::string path = "/usr/share/glmark2/models/bunny.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "the package glmark2-data is not installed";
    const auto mesh = load_obj_mesh(path);
    const auto points = sample_by_area(mesh, 200, 3);
    const auto box = mesh.bounding_box();
    for (size_t i = 0; i < points->size(); i++)
        ASSERT_LT(nearest(mesh, point(*points, i)).second, 1e-6 * (box.max - box.min).norm());
}
