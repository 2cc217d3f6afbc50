#include <cmath>

#include "io_test_tools.h"

using namespace mp2p_icp_test;

namespace
{
/// A scalar type of PLY with both of its names, and how one value is written.
struct PlyType
{
    std::vector<std::string> names;
    std::string (*little)(double);
    std::string (*big)(double);
};
template <class T>
PlyType ply_type(const std::vector<std::string>& names)
{
    return {names, [](double v) { return little_endian(static_cast<T>(v)); },
            [](double v) { return big_endian(static_cast<T>(v)); }};
}
const std::vector<PlyType>& ply_types()
{
    static const std::vector<PlyType> all = {
        ply_type<int8_t>({"char", "int8"}),    ply_type<uint8_t>({"uchar", "uint8"}),
        ply_type<int16_t>({"short", "int16"}), ply_type<uint16_t>({"ushort", "uint16"}),
        ply_type<int32_t>({"int", "int32"}),   ply_type<uint32_t>({"uint", "uint32"}),
        ply_type<float>({"float", "float32"}), ply_type<double>({"double", "float64"})};
    return all;
}

const Rows three_points = {
    {1, 2, 3}, {40, 50, 60}, {7, 8, 99}};  // positive, so that every type can hold them

std::string header(const std::string& format, const std::string& type)
{
    return "ply\nformat " + format + " 1.0\nelement vertex 3\nproperty " + type + " x\nproperty " + type +
           " y\nproperty " + type + " z\nend_header\n";
}
}  // namespace

TEST(LoadMapPly, everyScalarTypeInEveryEncodingGivesTheSamePoints)
{
    for (const auto& t : ply_types())
        for (const auto& name : t.names)
        {
            SCOPED_TRACE(name);
            std::string ascii = header("ascii", name), little = header("binary_little_endian", name),
                        big = header("binary_big_endian", name);
            for (const auto& p : three_points)
            {
                for (const float v : p)
                {
                    ascii += std::to_string(static_cast<int>(v)) + " ";
                    little += t.little(static_cast<double>(v));
                    big += t.big(static_cast<double>(v));
                }
                ascii += "\n";
            }
            const auto a = load_bytes(ascii, ".ply"), l = load_bytes(little, ".ply"),
                       b = load_bytes(big, ".ply");
            EXPECT_EQ(a.report.kind, "PLY (ascii)");
            EXPECT_EQ(l.report.kind, "PLY (binary little endian)");
            EXPECT_EQ(b.report.kind, "PLY (binary big endian)");
            for (const auto* m : {&a, &l, &b})
            {
                expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CSimplePointsMap>(*m)), three_points);
                EXPECT_TRUE(m->report.notes.empty()) << notes_of(m->report);
            }
        }
}

TEST(LoadMapPly, listsAndOtherElementsAreSkippedWhereverTheyStand)
{
    const std::string element_lines =
        "element camera 2\nproperty list uchar short ids\nproperty float f\n"
        "element vertex 2\nproperty list uint8 int32 tags\nproperty float z\nproperty double x\nproperty "
        "uchar y\n"
        "element face 1\nproperty list uchar int vertex_indices\n";
    const std::string ascii =
        "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nobj_info x\r\n" + element_lines +
        "end_header\r\n2 7 8 0.5\r\n0 1.5\r\n1 4 3.5 1.5 2\r\n0 -3 1 200\r\n3 0 1 1\r\n";
    std::string binary = "ply\nformat binary_little_endian 1.0\n" + element_lines + "end_header\n";
    binary += little_endian<uint8_t>(2) + little_endian<int16_t>(7) + little_endian<int16_t>(8) +
              little_endian(0.5f);
    binary += little_endian<uint8_t>(0) + little_endian(1.5f);
    binary += little_endian<uint8_t>(1) + little_endian<int32_t>(4) + little_endian(3.5f) +
              little_endian(1.5) + little_endian<uint8_t>(2);
    binary +=
        little_endian<uint8_t>(0) + little_endian(-3.f) + little_endian(1.0) + little_endian<uint8_t>(200);
    binary += little_endian<uint8_t>(3) + std::string(12, 'x');
    for (const auto& bytes : {ascii, binary})
    {
        const auto m = load_bytes(bytes, ".ply");
        expect_same_bits(rows_of(*raw_layer(m)), {{1.5f, 2, 3.5f}, {1, 200, -3}});
        EXPECT_TRUE(contains(notes_of(m.report), "left out: tags")) << notes_of(m.report);
    }
}

TEST(LoadMapPly, intensityIsKeptUnderEachOfItsNames)
{
    for (const std::string name : {"intensity", "scalar_intensity", "scalar_Intensity", "reflectance"})
    {
        const auto m = load_bytes(
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float " +
                name + "\nproperty float z\nend_header\n1 2 0.25 3\n4 5 -7.5 6\n",
            ".ply");
        expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CPointsMapXYZI>(m)),
                         {{1, 2, 3, 0.25f}, {4, 5, 6, -7.5f}});
    }
}

TEST(LoadMapPly, coloursOfBytesAndOfFloatsBecomeZeroToOne)
{
    const auto file = [](const std::string& type, const std::string& row)
    {
        return "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
               "z\nproperty " +
               type + " red\nproperty " + type + " green\nproperty " + type +
               " blue\nproperty uchar alpha\nend_header\n" + row;
    };
    const auto bytes = load_bytes(file("uchar", "1 2 3 255 0 1 9\n"), ".ply");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CColouredPointsMap>(bytes)),
                     {{1, 2, 3, 1, 0, 1 / 255.f}});
    const auto floats = load_bytes(file("float", "1 2 3 1 0.125 0.5 9\n"), ".ply");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CColouredPointsMap>(floats)),
                     {{1, 2, 3, 1, 0.125f, 0.5f}});
    EXPECT_TRUE(contains(notes_of(floats.report), "alpha"));
}

TEST(LoadMapPly, colourGoesBeforeIntensityAndThatIsNoted)
{
    const auto m = load_bytes(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
        "z\nproperty float intensity\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n1 2 3 9 51 102 255\n",
        ".ply");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CColouredPointsMap>(m)),
                     {{1, 2, 3, 51 / 255.f, 102 / 255.f, 1}});
    EXPECT_TRUE(contains(notes_of(m.report), "intensity is left out"));
}

TEST(LoadMapPly, eachFaultIsNamedWithItsPlace)
{
    const std::string ok =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float "
        "z\nend_header\n";
    EXPECT_EQ(error_of_bytes(ok + "1 2 3\n", ".ply"),
              "FILE, line 8: expected 2 lines of element 'vertex', found 6 bytes");
    EXPECT_EQ(error_of_bytes(ok + "11 22 33 \n\n \n", ".ply"),
              "FILE, line 10: expected the rest of element 'vertex' after it, found the end of the file");
    EXPECT_EQ(error_of_bytes(ok + "1 2 3\n4 x5 6\n", ".ply"), "FILE, line 9: expected a number, found 'x5'");
    EXPECT_EQ(error_of_bytes(ok + "1 2 3\n4 5 6 7\n", ".ply"), "FILE, line 9: expected 3 values, found 4");
    EXPECT_EQ(error_of_bytes(ok + "1 2 3\n4 5     \n", ".ply"),
              "FILE, line 9: expected more than 2 values, found '4 5     '");
    EXPECT_EQ(error_of_bytes("ply\nformat ascii 1.0\nelement vertex 1\nproperty flaot x\n", ".ply"),
              "FILE, line 4: expected a PLY type such as float or uchar, found 'flaot'");
    EXPECT_EQ(error_of_bytes("ply\nformat ascii 1.0\nelement vertex -1\n", ".ply"),
              "FILE, line 3: expected 'element NAME COUNT', found 'element vertex -1'");
    EXPECT_EQ(error_of_bytes("ply\nformat ascii 2.0\n", ".ply"),
              "FILE, line 2: expected 'format ascii|binary_little_endian|binary_big_endian 1.0', found "
              "'format ascii 2.0'");
    EXPECT_EQ(error_of_bytes("ply\nformat ascii 1.0\n", ".ply"),
              "FILE, line 2: expected 'end_header', found the end of the file");
    EXPECT_EQ(error_of_bytes("ply\nformat ascii 1.0\nend_header\n", ".ply"),
              "FILE, line 3: expected an element 'vertex' before, found 'end_header'");
    EXPECT_EQ(
        error_of_bytes(
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
            ".ply"),
        "FILE, line 3: expected one column 'z', found 0");
    std::string binary = header("binary_little_endian", "float");
    EXPECT_EQ(error_of_bytes(binary + std::string(35, '\0'), ".ply"),
              "FILE, byte " + std::to_string(binary.size()) +
                  ": expected 3 of element 'vertex' (12 bytes or more each), found 35 bytes");
}

TEST(LoadMapPly, aCountThatTheFileCannotHoldClaimsNoMemory)
{
    const std::string text = error_of_bytes(
        "ply\nformat binary_big_endian 1.0\nelement vertex 18446744073709551615\nproperty float x\nproperty "
        "float y\n"
        "property float z\nend_header\n" +
            std::string(120, '\1'),
        ".ply");
    EXPECT_TRUE(contains(text, "expected 18446744073709551615 of element 'vertex'")) << text;
}
