#include <gtest/gtest.h>
#include <mp2p_icp/synthetic/RayTracer.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cmath>

using namespace mp2p_icp::synthetic;
using Eigen::Vector3d;

namespace
{
/// Volume of a closed mesh with outward normals; its negative with inward ones.
double signed_volume(const TriangleMesh& mesh)
{
    double sum = 0;
    for (size_t i = 0; i < mesh.size(); i++)
    {
        const auto t = mesh.triangle(i);
        sum += t.a.dot(t.b.cross(t.c)) / 6;
    }
    return sum;
}
}  // namespace

TEST(worlds, a_box_is_closed_and_its_normals_point_outwards)
{
    const auto box = box_mesh(mrpt::poses::CPose3D(5, 6, 7, 1, 0.5, -2), {2, 3, 4});
    EXPECT_NEAR(signed_volume(box), 24, 1e-9);
    Vector3d area_vector = Vector3d::Zero();  // zero for a closed surface
    for (size_t i = 0; i < box.size(); i++) area_vector += box.triangle(i).area() * box.triangle(i).normal();
    EXPECT_NEAR(area_vector.norm(), 0, 1e-12);
    EXPECT_THROW(box_mesh({}, {1, 0, 1}), std::invalid_argument);
}

TEST(worlds, a_room_stands_on_the_floor_and_its_normals_point_inwards)
{
    const auto room = box_room(8, 6, 3);
    EXPECT_NEAR(signed_volume(room), -8 * 6 * 3, 1e-9);
    EXPECT_EQ(room.bounding_box().min, mrpt::math::TPoint3D(-4, -3, 0));
    EXPECT_EQ(room.bounding_box().max, mrpt::math::TPoint3D(4, 3, 3));
}

TEST(worlds, boxes_stay_inside_the_room_and_off_its_centre)
{
    for (uint64_t seed = 0; seed < 20; seed++)
    {
        const auto room = room_with_boxes(7, 5, 2.5, 10, seed);
        ASSERT_EQ(room.size(), 12u * 11);
        const auto box = room.bounding_box();
        EXPECT_EQ(box.min, mrpt::math::TPoint3D(-3.5, -2.5, 0));
        EXPECT_EQ(box.max, mrpt::math::TPoint3D(3.5, 2.5, 2.5));
        for (size_t i = 12; i < room.size(); i++)  // the room itself comes first
            for (const double z : {0.0, 0.2, 1.0, 2.0})
                EXPECT_GT(room.triangle(i).distance_to({0, 0, z}), 1.0);
    }
    EXPECT_NE(room_with_boxes(7, 5, 2.5, 1, 1).vertices, room_with_boxes(7, 5, 2.5, 1, 2).vertices);
    EXPECT_THROW(room_with_boxes(4, 8, 2.5, 1, 1), std::invalid_argument);
    EXPECT_THROW(room_with_boxes(8, 8, 0.3, 1, 1), std::invalid_argument);
}

TEST(worlds, a_corridor_is_open_at_its_ends_only)
{
    const RayTracer tracer(corridor(30, 2, 2.5));
    const Vector3d centre(0, 0, 1);
    EXPECT_FALSE(tracer.first_hit(centre, {1, 0, 0}));
    EXPECT_FALSE(tracer.first_hit(centre, {-1, 0, 0}));
    EXPECT_DOUBLE_EQ(tracer.first_hit(centre, {0, 1, 0})->range, 1.0);
    EXPECT_DOUBLE_EQ(tracer.first_hit(centre, {0, -1, 0})->range, 1.0);
    EXPECT_DOUBLE_EQ(tracer.first_hit(centre, {0, 0, 1})->range, 1.5);
    EXPECT_DOUBLE_EQ(tracer.first_hit(centre, {0, 0, -1})->range, 1.0);
}

TEST(worlds, the_roadway_of_a_street_is_free_and_its_sides_are_not)
{
    const auto world = street(100, 3);
    const RayTracer tracer(world);
    for (const double y : {-5.9, 0.0, 5.9}) EXPECT_FALSE(tracer.first_hit({-50, y, 1}, {1, 0, 0}, 100)) << y;
    size_t seen = 0;
    for (double x = -40; x <= 40; x += 1)
        for (const double side : {-1.0, 1.0})
            seen += tracer.first_hit({x, 0, 1}, {0, side, 0}, 20).has_value();
    EXPECT_GT(seen, 162 / 2u) << "houses are wider than gaps";
    EXPECT_LT(seen, 162u) << "there are gaps";
    EXPECT_DOUBLE_EQ(tracer.first_hit({0, 0, 2}, {0, 0, -1})->range, 2.0);
}
