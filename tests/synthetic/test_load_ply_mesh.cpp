#include <gtest/gtest.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/synthetic/load_ply_mesh.h>

#include <algorithm>
#include <cstring>
#include <sstream>

#include "expect_problem.h"

using namespace mp2p_icp::synthetic;

namespace
{
TriangleMesh read(const std::string& text)
{
    std::istringstream in(text);
    return read_ply_mesh(in, "test.ply");
}

using Corners = std::vector<std::array<uint32_t, 3>>;

/// A square of 2 m x 1 m and a triangle, with properties and an element that mean nothing here.
std::string header(const std::string& format)
{
    return "ply\nformat " + format +
           " 1.0\ncomment made by hand\nelement vertex 5\nproperty float x\nproperty double y\nproperty "
           "float z\nproperty short red\nelement camera 1\nproperty list uchar float view\nelement face "
           "2\nproperty char kind\nproperty list uchar int vertex_indices\nend_header\n";
}
const std::string ASCII =
    "0 0 0 -1\n2 0 0 -1\n2 1 0 7\n0 1 0 7\n0 1 3.5 7\n2 0.5 0.25\n-1 4 0 1 2 3\n-2 3 4 3 2\n";

/// ASCII in binary.
class Bytes
{
 public:
    explicit Bytes(bool big_endian) : big_endian_(big_endian) {}
    template <class T>
    Bytes& operator<<(T value)
    {
        char bytes[sizeof(T)];
        std::memcpy(bytes, &value, sizeof(T));
        if (big_endian_) std::reverse(bytes, bytes + sizeof(T));
        text.append(bytes, sizeof(T));
        return *this;
    }
    std::string text;

 private:
    bool big_endian_;
};

std::string binary(bool big_endian)
{
    Bytes b(big_endian);
    const double vertices[5][4] = {{0, 0, 0, -1}, {2, 0, 0, -1}, {2, 1, 0, 7}, {0, 1, 0, 7}, {0, 1, 3.5, 7}};
    for (const auto& v : vertices)
        b << static_cast<float>(v[0]) << v[1] << static_cast<float>(v[2]) << static_cast<int16_t>(v[3]);
    b << uint8_t(2) << 0.5f << 0.25f;
    b << int8_t(-1) << uint8_t(4) << int32_t(0) << int32_t(1) << int32_t(2) << int32_t(3);
    b << int8_t(-2) << uint8_t(3) << int32_t(4) << int32_t(3) << int32_t(2);
    return b.text;
}

void expect_the_mesh(const TriangleMesh& mesh)
{
    EXPECT_EQ(mesh.triangles, (Corners{{0, 1, 2}, {0, 2, 3}, {4, 3, 2}}));
    ASSERT_EQ(mesh.vertices.size(), 5u);
    EXPECT_EQ(mesh.vertices[4].y, 1.0);
    EXPECT_EQ(mesh.vertices[4].z, 3.5);
    EXPECT_DOUBLE_EQ(mesh.area(), 2.0 + 3.5);  // half of 2 m x 3.5 m
}
}  // namespace

TEST(load_ply_mesh, reads_ascii_and_both_kinds_of_binary_alike)
{
    expect_the_mesh(read(header("ascii") + ASCII));
    expect_the_mesh(read(header("binary_little_endian") + binary(false)));
    expect_the_mesh(read(header("binary_big_endian") + binary(true)));
}

TEST(load_ply_mesh, tells_what_is_wrong)
{
    using mp2p_icp_test::expect_problem_with;
    const auto fails = [](const std::string& text, const std::vector<std::string>& parts)
    { expect_problem_with<mp2p_icp::DataError>(parts, [&] { read(text); }); };
    const std::string vertices =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    const std::string faces = "element face 1\nproperty list uchar int vertex_index\nend_header\n";
    fails("solid\n", {"test.ply", "`ply`", "`solid`"});
    fails("ply\nformat ebcdic 1.0\n", {"ebcdic"});
    fails(vertices, {"end_header"});
    fails(vertices + "property quad w\nend_header\n", {"`quad`"});
    fails(vertices + "end_header\n0 0 0 1 0 0 0 1 0\n", {"no face"});
    fails(vertices + faces + "0 0 0 1 0 0 0 1 0\n3 0 1\n", {"the end of the file"});
    fails(vertices + faces + "0 0 0 1 0 0 0 1 0\n3 0 1 3\n", {"one of the 3 vertices"});
    fails(vertices + faces + "0 0 0 1 0 0 0 1 0\n3 0 1 -1\n", {"one of the 3 vertices"});
    fails(vertices + faces + "0 0 0 1 0 0 0 1 0\n2 0 1\n", {"three or more corners"});
    fails(vertices + faces + "0 0 0 1 nan 0 0 1 0\n3 0 1 2\n", {"vertex 1"});
    fails(header("binary_little_endian") + binary(false).substr(0, 120), {"the end of the file"});
}
