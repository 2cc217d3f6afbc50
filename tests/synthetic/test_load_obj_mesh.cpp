#include <gtest/gtest.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/synthetic/load_obj_mesh.h>

#include <filesystem>
#include <sstream>

using namespace mp2p_icp::synthetic;

namespace
{
TriangleMesh read(const std::string& text)
{
    std::istringstream in(text);
    return read_obj_mesh(in, "test.obj");
}

/// The message of the DataError that reading this text ends with.
std::string error_of(const std::string& text)
{
    try
    {
        read(text);
    }
    catch (const mp2p_icp::DataError& e)
    {
        return e.what();
    }
    return "no error";
}

using Corners = std::vector<std::array<uint32_t, 3>>;
const std::string SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
}  // namespace

TEST(load_obj_mesh, reads_all_four_kinds_of_corners)
{
    const Corners expected{{0, 1, 2}};
    EXPECT_EQ(read(SQUARE + "f 1 2 3\n").triangles, expected);
    EXPECT_EQ(read(SQUARE + "f 1/9 2/8 3/7\n").triangles, expected);
    EXPECT_EQ(read(SQUARE + "f 1//9 2//8 3//7\n").triangles, expected);
    EXPECT_EQ(read(SQUARE + "f 1/4/9 2/5/8 3/6/7\n").triangles, expected);
}

TEST(load_obj_mesh, negative_numbers_count_back_from_the_last_vertex_so_far)
{
    const Corners expected{{0, 1, 3}, {2, 3, 4}};
    EXPECT_EQ(read(SQUARE + "f -4 -3/1 -1//2\nv 5 5 5\nf -3 -2 -1\n").triangles, expected);
}

TEST(load_obj_mesh, polygons_become_fans_with_the_same_area)
{
    const auto mesh = read(SQUARE + "f 1 2 3 4\n");
    EXPECT_EQ(mesh.triangles, (Corners{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_DOUBLE_EQ(mesh.area(), 1.0);
}

TEST(load_obj_mesh, skips_everything_but_vertices_and_faces)
{
    const auto mesh = read(
        "# comment\nmtllib a.mtl\no thing\r\nv 1e-1 -2.5 +3 1.0\r\nvt 0 0\nvn 0 0 1\nv 1 0 0\nv 0 1 0\n\n"
        "g group\nusemtl m\ns off\nf 1 2 \\\n 3\n");
    ASSERT_EQ(mesh.vertices.size(), 3u);
    EXPECT_EQ(mesh.vertices[0], mrpt::math::TPoint3D(0.1, -2.5, 3));
    EXPECT_EQ(mesh.triangles, (Corners{{0, 1, 2}}));
}

TEST(load_obj_mesh, errors_name_the_source_and_the_line)
{
    for (const std::string bad :
         {"f 1 2 5\n", "f 1 2 0\n", "f 1 2 -5\n", "f 1 2\n", "f 1 2 x\n", "f 1 2 1.5\n", "v 1 2\n",
          "v 1 2 nan\n", "v 1 2 inf\n", "v 1 2 z\n", "f 1 2 99999999999999999999\n"})
    {
        const std::string error = error_of(SQUARE + bad);
        EXPECT_NE(error.find("test.obj"), std::string::npos) << bad << error;
        EXPECT_NE(error.find("line 5"), std::string::npos) << bad << error;
    }
    EXPECT_NE(error_of(SQUARE).find("no face"), std::string::npos);
    EXPECT_NE(error_of("").find("no face"), std::string::npos);
    EXPECT_THROW(load_obj_mesh("/no/such/file.obj"), mp2p_icp::DataError);
}

TEST(load_obj_mesh, reads_the_bunny)
{
    const std::string path = "/usr/share/glmark2/models/bunny.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "the package glmark2-data is not installed";
    const auto mesh = load_obj_mesh(path);
    EXPECT_GT(mesh.size(), 10000u);
    const auto box = mesh.bounding_box();
    // glmark2 keeps the model within the cube [-1, 1]^3, and its longest side fills it.
    EXPECT_NEAR(box.max.x - box.min.x, 2.0, 1e-6);
    EXPECT_LT(box.max.z - box.min.z, 2.0);
    EXPECT_GT(mesh.area(), 4.0);   // more than front and back of a disc of radius 0.8,
    EXPECT_LT(mesh.area(), 24.0);  // less than the cube around it
}
