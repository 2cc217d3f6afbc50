#include <mp2p_icp/random.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cmath>
#include <stdexcept>

namespace mp2p_icp::synthetic
{
using mrpt::math::TPoint3D;
using mrpt::poses::CPose3D;

namespace
{
/// A box with its base on the ground.
TriangleMesh standing_box(double x, double y, double yaw, const TPoint3D& size)
{
    return box_mesh(CPose3D(x, y, 0.5 * size.z, yaw, 0, 0), size);
}

void append_rectangle(TriangleMesh& mesh, const TPoint3D& a, const TPoint3D& b, const TPoint3D& c,
                      const TPoint3D& d)
{
    mesh.append({{a, b, c, d}, {{0, 1, 2}, {0, 2, 3}}});
}

void append_houses(TriangleMesh& mesh, double length_x, double side, SeededRandom& random)
{
    for (double x = -0.5 * length_x; x < 0.5 * length_x - 5;)
    {
        const TPoint3D size(random.uniform(6, 14), random.uniform(6, 10), random.uniform(4, 12));
        const double front = random.uniform(8, 10);
        mesh.append(standing_box(x + 0.5 * size.x, side * (front + 0.5 * size.y), 0, size));
        x += size.x + random.uniform(2, 6);
    }
}

void append_poles(TriangleMesh& mesh, double length_x, double side, SeededRandom& random)
{
    for (double x = -0.5 * length_x + random.uniform(0, 10); x < 0.5 * length_x; x += random.uniform(8, 16))
        mesh.append(standing_box(x, side * 7, random.uniform(-M_PI, M_PI), {0.3, 0.3, random.uniform(4, 7)}));
}
}  // namespace

TriangleMesh box_mesh(const CPose3D& pose, const TPoint3D& size)
{
    if (!(size.x > 0 && size.y > 0 && size.z > 0))
        throw std::invalid_argument("box_mesh: all sides must be above zero");
    TriangleMesh mesh;
    for (int corner = 0; corner < 8; corner++)  // bits 0, 1, 2: the upper side along x, y, z
    {
        const auto half = [corner](int bit, double length)
        { return ((corner >> bit & 1) ? 0.5 : -0.5) * length; };
        mesh.vertices.push_back(pose.composePoint({half(0, size.x), half(1, size.y), half(2, size.z)}));
    }
    mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},   // -x, +x
                      {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},   // -y, +y
                      {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};  // -z, +z
    return mesh;
}

TriangleMesh box_room(double length_x, double width_y, double height_z)
{
    TriangleMesh mesh = standing_box(0, 0, 0, {length_x, width_y, height_z});
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);  // normals inwards
    return mesh;
}

TriangleMesh room_with_boxes(double length_x, double width_y, double height_z, size_t box_count,
                             uint64_t seed)
{
    if (!(length_x >= 5 && width_y >= 5 && height_z >= 0.5))
        throw std::invalid_argument(
            "room_with_boxes: the room must be at least 5 m long and wide, and 0.5 m high");
    TriangleMesh mesh = box_room(length_x, width_y, height_z);
    SeededRandom random(seed);
    constexpr double HALF_DIAGONAL =
        0.86;  // of a box of 1.2 x 1.2 m, rounded up: keeps it inside the room, off the centre
    for (size_t placed = 0; placed < box_count;)
    {
        const double x = random.uniform(-1, 1) * (0.5 * length_x - HALF_DIAGONAL);
        const double y = random.uniform(-1, 1) * (0.5 * width_y - HALF_DIAGONAL);
        if (std::hypot(x, y) < 1 + HALF_DIAGONAL) continue;
        const double yaw = random.uniform(-M_PI, M_PI);
        const TPoint3D size(random.uniform(0.3, 1.2), random.uniform(0.3, 1.2),
                            random.uniform(0.4, height_z));
        mesh.append(standing_box(x, y, yaw, size));
        placed++;
    }
    return mesh;
}

TriangleMesh corridor(double length_x, double width_y, double height_z)
{
    const double x = 0.5 * length_x, y = 0.5 * width_y, z = height_z;
    TriangleMesh mesh;
    append_rectangle(mesh, {-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0});
    append_rectangle(mesh, {-x, -y, z}, {-x, y, z}, {x, y, z}, {x, -y, z});
    append_rectangle(mesh, {-x, -y, 0}, {-x, -y, z}, {x, -y, z}, {x, -y, 0});
    append_rectangle(mesh, {-x, y, 0}, {x, y, 0}, {x, y, z}, {-x, y, z});
    return mesh;
}

TriangleMesh street(double length_x, uint64_t seed)
{
    if (!(length_x >= 20)) throw std::invalid_argument("street: it must be at least 20 m long");
    const double x = 0.5 * length_x, y = 30;
    TriangleMesh mesh;
    append_rectangle(mesh, {-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0});
    SeededRandom random(seed);
    for (const double side : {-1.0, 1.0})
    {
        append_houses(mesh, length_x, side, random);
        append_poles(mesh, length_x, side, random);
    }
    return mesh;
}

}  // namespace mp2p_icp::synthetic
