#include <gtest/gtest.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/synthetic/RayTracer.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cmath>

using namespace mp2p_icp::synthetic;
using Eigen::Vector3d;

namespace
{
Vector3d random_vector(mp2p_icp::SeededRandom& random, double size)
{
    return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

/// From a point inside a box about `centre`, to its wall.
double range_in_box(const Vector3d& half_size, const Vector3d& centre, const Vector3d& origin,
                    const Vector3d& direction)
{
    double range = 1e300;
    for (int axis = 0; axis < 3; axis++)
    {
        if (direction[axis] == 0) continue;
        const double wall = centre[axis] + std::copysign(half_size[axis], direction[axis]);
        range = std::min(range, (wall - origin[axis]) / direction[axis]);
    }
    return range;
}

/// Slow and obvious: where the ray meets the plane of the triangle, if that is on the triangle.
std::optional<double> range_by_plane(const Triangle& t, const Vector3d& origin, const Vector3d& direction)
{
    const Vector3d n = t.normal();
    if (n.dot(direction) == 0) return std::nullopt;
    const double range = n.dot(t.a - origin) / n.dot(direction);
    if (range < 0 || t.distance_to(origin + range * direction) > 1e-9) return std::nullopt;
    return range;
}
}  // namespace

TEST(RayTracer, ranges_in_a_box_room_are_the_analytic_ones)
{
    const Vector3d half(4, 3, 1.25), centre(0, 0, 1.25);
    const RayTracer tracer(box_room(8, 6, 2.5));
    mp2p_icp::SeededRandom random(1);
    for (int i = 0; i < 5000; i++)
    {
        const Vector3d origin = centre + 0.99 * random_vector(random, 1).cwiseProduct(half);
        const Vector3d direction = random_vector(random, 1).normalized();
        const auto hit = tracer.first_hit(origin, direction);
        ASSERT_TRUE(hit);
        ASSERT_NEAR(hit->range, range_in_box(half, centre, origin, direction),
                    1e-12 * 10);  // the room is 10 m across
    }
}

TEST(RayTracer, no_ray_slips_between_triangles_at_edges_and_corners)
{
    // From the centre: along the axes through the diagonals of the faces, to the edges and into the corners.
    const RayTracer tracer(box_room(2, 2, 2));
    for (int x = -2; x <= 2; x++)
        for (int y = -2; y <= 2; y++)
            for (int z = -2; z <= 2; z++)
            {
                if (x == 0 && y == 0 && z == 0) continue;
                const Vector3d towards(x, y, z);
                const auto hit = tracer.first_hit({0, 0, 1}, towards.normalized());
                ASSERT_TRUE(hit) << towards.transpose();
                EXPECT_NEAR(hit->range, towards.norm() / towards.cwiseAbs().maxCoeff(), 1e-12);
            }
}

TEST(RayTracer, finds_the_same_hits_as_a_search_over_all_triangles)
{
    mp2p_icp::SeededRandom random(2);
    TriangleMesh mesh;
    for (int i = 0; i < 300; i++)
    {
        const Vector3d at = random_vector(random, 5);
        TriangleMesh one;
        for (int c = 0; c < 3; c++)
        {
            const Vector3d v = at + random_vector(random, 1);
            one.vertices.emplace_back(v.x(), v.y(), v.z());
        }
        one.triangles = {{0, 1, 2}};
        mesh.append(one);
    }
    const RayTracer tracer(mesh);
    size_t hits = 0;
    for (int i = 0; i < 3000; i++)
    {
        const Vector3d origin = random_vector(random, 6), direction = random_vector(random, 1).normalized();
        std::optional<double> expected;
        uint32_t expected_triangle = 0;
        for (uint32_t t = 0; t < mesh.size(); t++)
            if (const auto r = range_by_plane(mesh.triangle(t), origin, direction);
                r && (!expected || *r < *expected))
            {
                expected = r;
                expected_triangle = t;
            }
        const auto hit = tracer.first_hit(origin, direction);
        ASSERT_EQ(hit.has_value(), expected.has_value());
        if (!hit) continue;
        hits++;
        ASSERT_NEAR(hit->range, *expected, 1e-9);  // rays that graze a triangle lose digits
        ASSERT_EQ(hit->triangle, expected_triangle);
    }
    EXPECT_GT(hits, 500u) << "the comparison must be about something";
    EXPECT_LT(hits, 2900u);
}

TEST(RayTracer, sees_nothing_behind_it_nor_beyond_the_range)
{
    const RayTracer tracer({{{5, -1, -1}, {5, 1, -1}, {5, 0, 2}}, {{0, 1, 2}}});
    EXPECT_TRUE(tracer.first_hit({0, 0, 0}, {1, 0, 0}));
    EXPECT_FALSE(tracer.first_hit({0, 0, 0}, {-1, 0, 0}));
    EXPECT_TRUE(tracer.first_hit({10, 0, 0}, {-1, 0, 0})) << "both faces are seen";
    EXPECT_TRUE(tracer.first_hit({0, 0, 0}, {1, 0, 0}, 5.0));
    EXPECT_FALSE(tracer.first_hit({0, 0, 0}, {1, 0, 0}, 4.999));
    EXPECT_FALSE(RayTracer(TriangleMesh()).first_hit({0, 0, 0}, {1, 0, 0}));
}
