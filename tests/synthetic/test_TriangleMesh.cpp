#include <gtest/gtest.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/synthetic/TriangleMesh.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cmath>

using namespace mp2p_icp::synthetic;
using Eigen::Vector3d;

TEST(TriangleMesh, area_of_a_right_triangle_is_half_the_product_of_its_legs)
{
    const Triangle t{{1, 1, 1}, {4, 1, 1}, {1, 5, 1}};
    EXPECT_DOUBLE_EQ(t.area(), 6.0);
    EXPECT_NEAR((t.normal() - Vector3d(0, 0, 1)).norm(), 0, 1e-15);
}

TEST(TriangleMesh, a_triangle_without_area_has_no_normal_and_measures_distance_to_its_segment)
{
    const Triangle t{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    EXPECT_EQ(t.area(), 0);
    EXPECT_EQ(t.normal(), Vector3d::Zero());
    EXPECT_DOUBLE_EQ(t.distance_to({1.5, 2, 0}), 2.0);
    EXPECT_DOUBLE_EQ(t.distance_to({5, 4, 0}), 5.0);
}

TEST(TriangleMesh, distance_is_right_inside_beside_edges_and_beyond_corners)
{
    const Triangle t{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    EXPECT_DOUBLE_EQ(t.distance_to({1, 1, -3}), 3.0);                  // above the inside
    EXPECT_DOUBLE_EQ(t.distance_to({2, -3, 4}), 5.0);                  // beside ab
    EXPECT_DOUBLE_EQ(t.distance_to({-3, 2, 4}), 5.0);                  // beside ca
    EXPECT_NEAR(t.distance_to({4, 4, 0}), 2 * std::sqrt(2.0), 1e-15);  // beside bc
    EXPECT_DOUBLE_EQ(t.distance_to({-2, -2, 1}), 3.0);                 // beyond a
    EXPECT_DOUBLE_EQ(t.distance_to({7, -4, 0}), 5.0);                  // beyond b
    EXPECT_DOUBLE_EQ(t.distance_to({-4, 7, 0}), 5.0);                  // beyond c
}

TEST(TriangleMesh, distance_equals_that_of_a_dense_search)
{
    mp2p_icp::SeededRandom random(7);
    const auto draw = [&]()
    { return Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)); };
    for (int i = 0; i < 50; i++)
    {
        const Triangle t{draw(), draw(), draw()};
        const Vector3d p = draw();
        double best = 1e9;
        constexpr int N = 200;
        for (int u = 0; u <= N; u++)
            for (int v = 0; u + v <= N; v++)
                best = std::min(best, (t.a + (t.b - t.a) * u / N + (t.c - t.a) * v / N - p).norm());
        // The nearest grid point is within the longest side / N of the nearest point of the triangle.
        EXPECT_LE(t.distance_to(p), best + 1e-12);
        EXPECT_GE(t.distance_to(p), best - 3.5 / N);
    }
}

TEST(TriangleMesh, area_of_a_box_is_that_of_its_six_faces)
{
    const auto box = box_mesh(mrpt::poses::CPose3D(1, 2, 3, 0.4, 0.5, 0.6), {2, 3, 4});
    EXPECT_NEAR(box.area(), 2 * (2 * 3 + 3 * 4 + 4 * 2), 1e-12);
}

TEST(TriangleMesh, bounding_box_holds_used_vertices_only)
{
    TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 2, -3}, {100, 100, 100}}, {{0, 1, 2}}};
    const auto box = mesh.bounding_box();
    EXPECT_EQ(box.min, mrpt::math::TPoint3D(0, 0, -3));
    EXPECT_EQ(box.max, mrpt::math::TPoint3D(1, 2, 0));
    EXPECT_THROW(TriangleMesh().bounding_box(), std::invalid_argument);
}

TEST(TriangleMesh, append_keeps_both_meshes)
{
    TriangleMesh mesh = box_mesh({}, {1, 1, 1});
    mesh.append(box_mesh(mrpt::poses::CPose3D(10, 0, 0, 0, 0, 0), {2, 2, 2}));
    ASSERT_EQ(mesh.size(), 24u);
    EXPECT_NEAR(mesh.area(), 6 + 24, 1e-12);
    EXPECT_DOUBLE_EQ(mesh.bounding_box().max.x, 11);
    EXPECT_DOUBLE_EQ(mesh.bounding_box().min.x, -0.5);
}
