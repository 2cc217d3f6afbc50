#include <clocale>

#include "io_test_tools.h"

using namespace mp2p_icp_test;

TEST(LoadMapText, everySeparatorAndLineEndGivesTheSamePoints)
{
    const Rows expected = {{1, -2.5f, 3e-3f}, {4, 5, 6}};
    for (const std::string text :
         {"1 -2.5 3e-3\n4 5 6\n", "1\t-2.5\t3e-3\n4\t5\t6", "1,-2.5,3e-3\n4,5,6\n",
          "1; -2.5 ;3E-3;\n+4;5;6;\n", "  1 , -2.5 , .3e-2 \r\n\r\n4 , 5 , 6\r\n",
          "# a comment\n// another\n\n1 -2.5 3e-3\n# between\n4 5 6\n#end", "x y z\n1 -2.5 3e-3\n4 5 6\n",
          "\xef\xbb\xbf"
          "1 -2.5 3e-3\n4 5 6\n",
          "\xef\xbb\xbfx,y,z\r\n1,-2.5,3e-3\r\n4,5,6\r\n", "X;Y;Z\r\n1;-2.5;3e-3\r\n4;5;6\r\n"})
    {
        SCOPED_TRACE(text);
        const auto m = load_bytes(text, ".xyz");
        expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CSimplePointsMap>(m)), expected);
        EXPECT_EQ(notes_of(m.report), "");
    }
}

TEST(LoadMapText, theNumberOfColumnsTellsWhatTheyAre)
{
    expect_same_bits(
        rows_of(*raw_layer_as<mrpt::maps::CPointsMapXYZI>(load_bytes("1 2 3 0.5\n4 5 6 7\n", ".txt"))),
        {{1, 2, 3, 0.5f}, {4, 5, 6, 7}});
    expect_same_bits(
        rows_of(*raw_layer_as<mrpt::maps::CColouredPointsMap>(load_bytes("1 2 3 255 0 1\n", ".txt"))),
        {{1, 2, 3, 1, 0, 1 / 255.f}});
    expect_same_bits(
        rows_of(*raw_layer_as<mrpt::maps::CColouredPointsMap>(load_bytes("1 2 3 1.0 0 0.5\n", ".txt"))),
        {{1, 2, 3, 1, 0, 0.5f}});
    const auto five = load_bytes("1 2 3 8 9\n", ".txt");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CSimplePointsMap>(five)), {{1, 2, 3}});
    EXPECT_TRUE(contains(notes_of(five.report), "column 4, column 5"));
    const auto normals = load_bytes("1 2 3 0.6 -0.8 0\n", ".txt");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CSimplePointsMap>(normals)), {{1, 2, 3}});
    EXPECT_TRUE(contains(notes_of(normals.report), "normals"));
}

TEST(LoadMapText, namesGoBeforePositions)
{
    const auto m = load_bytes("time,\"z\",y,x,Intensity\n9,3,2,1,0.5\n", ".csv");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CPointsMapXYZI>(m)), {{1, 2, 3, 0.5f}});
    EXPECT_TRUE(contains(notes_of(m.report), "left out: time"));
    // With units: time is not x.
    const auto units = load_bytes("time [s],x [m],\"y [m]\",z\n9,1,2,3\n", ".csv");
    expect_same_bits(rows_of(*raw_layer(units)), {{1, 2, 3}});
    // As CloudCompare writes them.
    const auto c = load_bytes("//X,Y,Z,R,G,B\n1,2,3,0,51,255\n", ".asc");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CColouredPointsMap>(c)),
                     {{1, 2, 3, 0, 51 / 255.f, 1}});
}

TEST(LoadMapText, numbersThatAreNotFiniteAreDroppedAndCounted)
{
    const auto m = load_bytes(
        "nan 1 2\n1 2 3\n1 inf 2\n-inf 2 3\n1 2 NaN\n1.#QNAN 2 3\n-1.#IND 2 3\n1e999 2 3\n-nan(ind) 2 "
        "3\n1e300 1 1\n1e-999 0 0\n",
        ".xyz");
    EXPECT_EQ(m.report.points_read, 11u);
    EXPECT_EQ(m.report.points_dropped_nonfinite, 9u);
    expect_same_bits(rows_of(*raw_layer(m)), {{1, 2, 3}, {0, 0, 0}});
}

TEST(LoadMapText, theLocaleDoesNotMatter)
{
    const char* german = std::setlocale(LC_ALL, "de_DE.UTF-8");
    const auto m = load_bytes("1.5 2.25 3\n", ".xyz");
    std::setlocale(LC_ALL, "C");
    expect_same_bits(rows_of(*raw_layer(m)), {{1.5f, 2.25f, 3}});
    if (!german) GTEST_SKIP() << "the locale de_DE.UTF-8 is not installed; read in the C locale only";
}

TEST(LoadMapText, eachFaultIsNamedWithItsLine)
{
    EXPECT_EQ(error_of_bytes("1 2 3\n# c\n4 5\n", ".xyz"), "FILE, line 3: expected 3 numbers, found 2");
    EXPECT_EQ(error_of_bytes("1 2 3\n4 5 6 7\n", ".xyz"), "FILE, line 2: expected 3 numbers, found more");
    EXPECT_EQ(error_of_bytes("1 2 3\n4 five 6\n", ".xyz"), "FILE, line 2: expected a number, found 'five'");
    EXPECT_EQ(error_of_bytes("1,2,3\n4,,6\n", ".csv"), "FILE, line 2: expected a number, found ''");
    EXPECT_EQ(error_of_bytes("1 2\n", ".xyz"), "FILE, line 1: expected three or more numbers, found '1 2'");
    EXPECT_EQ(error_of_bytes("x,y,z\n", ".csv"),
              "FILE, line 1: expected a row of numbers, found the end of the file");
    EXPECT_EQ(error_of_bytes("x,y,z,x\n1,2,3,4\n", ".csv"), "FILE, line 2: expected one column 'x', found 2");
    // Decimal commas would make other columns, without a word.
    EXPECT_EQ(error_of_bytes("x;y;z\n0,5;1,25;3,0\n", ".csv"),
              "FILE, line 2: expected one kind of separator, and numbers with a decimal point, found "
              "'0,5;1,25;3,0'");
    EXPECT_EQ(error_of_bytes("x,y,z\n0,5,1,25,3,0\n", ".csv"),
              "FILE, line 2: expected 3 numbers, as many as the columns have names, found 6");
    EXPECT_EQ(error_of_bytes("nan nan nan\ninf 1 2\n", ".xyz"),
              "FILE: there is no finite point among its 2 points");
}

TEST(LoadMapKitti, recordsOfFourFloatsAreRead)
{
    std::string bytes;
    for (const float v : {1.f, 2.f, 3.f, 0.25f, std::numeric_limits<float>::quiet_NaN(), 0.f, 0.f, 0.f, -4.f,
                          5.f, 6.f, 0.75f})
        bytes += little_endian(v);
    const auto m = load_bytes(bytes, ".bin");
    EXPECT_EQ(m.report.kind, "KITTI .bin");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CPointsMapXYZI>(m)),
                     {{1, 2, 3, 0.25f}, {-4, 5, 6, 0.75f}});
    EXPECT_EQ(m.report.points_dropped_nonfinite, 1u);
    EXPECT_EQ(
        error_of_bytes(bytes.substr(0, 47), ".bin"),
        "FILE, byte 32: expected a KITTI record of 16 bytes (x, y, z, intensity as floats), found 15 bytes");
}

TEST(LoadMapObj, verticesAreReadWithTheirColours)
{
    const auto plain = load_bytes(
        "# Blender\nmtllib a.mtl\no thing\nv 1 2 3\nv -4 5.5 6\nvn 0 0 1\nvt 0 1\nf 1//1 2//1 1//1\n",
        ".obj");
    EXPECT_EQ(plain.report.kind, "OBJ (vertices)");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CSimplePointsMap>(plain)), {{1, 2, 3}, {-4, 5.5f, 6}});
    const auto commented = load_bytes("v 1 2 3 # one\nv 4 5 6# two\n", ".obj");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CSimplePointsMap>(commented)), {{1, 2, 3}, {4, 5, 6}});
    const auto coloured = load_bytes("v 1 2 3 0.5 1 0\r\nv 4 5 6 0 0 0.25\r\n", ".obj");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CColouredPointsMap>(coloured)),
                     {{1, 2, 3, 0.5f, 1, 0}, {4, 5, 6, 0, 0, 0.25f}});
    const auto homogeneous = load_bytes("v 1 2 3 1\n", ".obj");
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CSimplePointsMap>(homogeneous)), {{1, 2, 3}});
    EXPECT_TRUE(contains(notes_of(homogeneous.report), "left out: w"));
    EXPECT_EQ(error_of_bytes("v 1 2 3\nv 1 2\n", ".obj"),
              "FILE, line 2: expected 3 numbers after 'v', found 'v 1 2'");
    EXPECT_EQ(error_of_bytes("v 1 2 3\nv 1 y 2\n", ".obj"), "FILE, line 2: expected a number, found 'y'");
    EXPECT_EQ(error_of_bytes("f 1 2 3\n", ".obj"),
              "FILE, line 1: expected a vertex ('v x y z'), found the end of the file");
}
