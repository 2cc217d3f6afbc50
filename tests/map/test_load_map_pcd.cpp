#include <liblzf/lzf.h>

#include "io_test_tools.h"

using namespace mp2p_icp_test;

namespace
{
std::string header(const std::string& fields, const std::string& sizes, const std::string& types,
                   const std::string& counts, size_t points, const std::string& data,
                   const std::string& viewpoint = "0 0 0 1 0 0 0")
{
    const std::string n = std::to_string(points);
    return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes +
           "\nTYPE " + types + "\nCOUNT " + counts + "\nWIDTH " + n + "\nHEIGHT 1\nVIEWPOINT " + viewpoint +
           "\nPOINTS " + n + "\nDATA " + data + "\n";
}

/// The block of a `binary_compressed` file, by liblzf's own compressor.
std::string compressed(const std::string& content)
{
    std::string out(content.size() * 2 + 64, '\0');
    const auto size = lzf_compress(content.data(), static_cast<unsigned>(content.size()), out.data(),
                                   static_cast<unsigned>(out.size()));
    EXPECT_GT(size, 0u);
    return little_endian<uint32_t>(size) + little_endian(static_cast<uint32_t>(content.size())) +
           out.substr(0, size);
}

struct PcdType
{
    std::string letter, size;
    std::string (*write)(double);
};
template <class T>
PcdType pcd_type(const std::string& letter)
{
    return {letter, std::to_string(sizeof(T)), [](double v) { return little_endian(static_cast<T>(v)); }};
}
const std::vector<PcdType>& pcd_types()
{
    static const std::vector<PcdType> all = {
        pcd_type<int8_t>("I"),  pcd_type<uint8_t>("U"),  pcd_type<int16_t>("I"), pcd_type<uint16_t>("U"),
        pcd_type<int32_t>("I"), pcd_type<uint32_t>("U"), pcd_type<int64_t>("I"), pcd_type<uint64_t>("U"),
        pcd_type<float>("F"),   pcd_type<double>("F")};
    return all;
}
const Rows three_points = {{1, 2, 3}, {40, 50, 60}, {7, 8, 99}};
}  // namespace

TEST(LoadMapPcd, everyTypeInEveryKindOfDataGivesTheSamePoints)
{
    for (const auto& t : pcd_types())
    {
        SCOPED_TRACE(t.letter + t.size);
        const auto head = [&](const std::string& data)
        {
            const std::string s = t.size, l = t.letter;
            return header("x y z", s + " " + s + " " + s, l + " " + l + " " + l, "1 1 1", 3, data);
        };
        std::string ascii = head("ascii"), binary = head("binary"), by_field;
        for (const auto& p : three_points)
        {
            for (const float v : p)
            {
                ascii += std::to_string(static_cast<int>(v)) + " ";
                binary += t.write(static_cast<double>(v));
            }
            ascii += "\n";
        }
        for (size_t k = 0; k < 3; k++)
            for (const auto& p : three_points) by_field += t.write(static_cast<double>(p[k]));
        const auto a = load_bytes(ascii, ".pcd"), b = load_bytes(binary, ".pcd"),
                   c = load_bytes(head("binary_compressed") + compressed(by_field), ".pcd");
        EXPECT_EQ(a.report.kind, "PCD (ascii)");
        EXPECT_EQ(b.report.kind, "PCD (binary)");
        EXPECT_EQ(c.report.kind, "PCD (binary_compressed)");
        for (const auto* m : {&a, &b, &c})
            expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CSimplePointsMap>(*m)), three_points);
    }
}

TEST(LoadMapPcd, fieldsOfSeveralValuesAreSkippedAndOthersFoundBehindThem)
{
    const std::string fields = "descriptor x _ y z intensity", sizes = "4 4 1 4 8 2", types = "F F U F F U",
                      counts = "3 1 4 1 1 1";
    std::string binary, by_field;
    for (int i = 0; i < 2; i++)
        binary += std::string(12, 'd') + little_endian(1.5f + static_cast<float>(i)) + "pppp" +
                  little_endian(2.f) + little_endian(3.25) + little_endian<uint16_t>(700);
    by_field = std::string(24, 'd') + little_endian(1.5f) + little_endian(2.5f) + "pppppppp" +
               little_endian(2.f) + little_endian(2.f) + little_endian(3.25) + little_endian(3.25) +
               little_endian<uint16_t>(700) + little_endian<uint16_t>(700);
    const std::string row = " 0 0 0 0 2 3.25 700\n";
    const auto head = [&](const char* data) { return header(fields, sizes, types, counts, 2, data); };
    for (const auto& bytes : {head("binary") + binary, head("binary_compressed") + compressed(by_field),
                              head("ascii") + "9 9 9 1.5 0 0 0 0 2 3.25 700\n9 9 9 2.5" + row})
    {
        const auto m = load_bytes(bytes, ".pcd");
        expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CPointsMapXYZI>(m)),
                         {{1.5f, 2, 3.25f, 700}, {2.5f, 2, 3.25f, 700}});
        EXPECT_TRUE(contains(notes_of(m.report), "left out: descriptor\n")) << notes_of(m.report);
    }
}

TEST(LoadMapPcd, packedColoursAreUnpackedFromWholeNumbersAndFromFloats)
{
    const uint32_t packed = 0xff3366u;
    float as_float;
    std::memcpy(&as_float, &packed, 4);
    char text[64];
    std::snprintf(text, sizeof(text), "%.9g", static_cast<double>(as_float));
    const Rows expected = {{1, 2, 3, 1, 0x33 / 255.f, 0x66 / 255.f}};
    const std::string xyz = little_endian(1.f) + little_endian(2.f) + little_endian(3.f);
    for (const std::string name : {"rgb", "rgba"})
        for (const std::string type : {"F", "U"})
        {
            const auto head = [&](const char* data)
            { return header("x y z " + name, "4 4 4 4", "F F F " + type, "1 1 1 1", 1, data); };
            for (const auto& bytes :
                 {head("binary") + xyz + little_endian(packed), head("ascii") + "1 2 3 16724838\n",
                  type == "F" ? head("ascii") + "1 2 3 " + text + "\n" : head("ascii") + "1 2 3 16724838"})
                expect_same_bits(
                    rows_of(*raw_layer_as<mrpt::maps::CColouredPointsMap>(load_bytes(bytes, ".pcd"))),
                    expected);
        }
}

TEST(LoadMapPcd, aViewpointIsIgnoredWithANote)
{
    const std::string data = "1 2 3\n";
    const auto m =
        load_bytes(header("x y z", "4 4 4", "F F F", "1 1 1", 1, "ascii", "1 0 0 1 0 0 0") + data, ".pcd");
    EXPECT_TRUE(contains(notes_of(m.report), "VIEWPOINT"));
    expect_same_bits(rows_of(*raw_layer(m)), {{1, 2, 3}});
    EXPECT_EQ(
        notes_of(load_bytes(header("x y z", "4 4 4", "F F F", "1 1 1", 1, "ascii", "0 0 0 1.0 0 0 0") + data,
                            ".pcd")
                     .report),
        "");
}

TEST(LoadMapPcd, anOrganizedCloudDropsItsHoles)
{
    const auto m = load_bytes(
        "VERSION .7\r\nFIELDS x y z\r\nSIZE 4 4 4\r\nTYPE F F F\r\nWIDTH 2\r\nHEIGHT 2\r\nPOINTS 4\r\nDATA "
        "ascii\r\n"
        "1 2 3\r\nnan nan nan\r\n4 5 6\r\n-nan inf 7\r\n",
        ".pcd");
    expect_same_bits(rows_of(*raw_layer(m)), {{1, 2, 3}, {4, 5, 6}});
    EXPECT_EQ(m.report.points_read, 4u);
    EXPECT_EQ(m.report.points_dropped_nonfinite, 2u);
}

TEST(LoadMapPcd, eachFaultIsNamedWithItsPlace)
{
    const auto head = [](size_t n, const char* data)
    { return header("x y z", "4 4 4", "F F F", "1 1 1", n, data); };
    const std::string at = std::to_string(head(5, "binary").size());
    EXPECT_EQ(error_of_bytes(head(5, "binary") + std::string(59, 'a'), ".pcd"),
              "FILE, byte " + at + ": expected 5 points of 12 bytes, found 59 bytes");
    EXPECT_EQ(error_of_bytes(head(2, "ascii") + "1 2 3\n4 5\n6\n", ".pcd"),
              "FILE, line 13: expected 3 values, found '4 5'");
    EXPECT_EQ(error_of_bytes(head(2, "ascii") + "1 2 3\n4 5 z\n", ".pcd"),
              "FILE, line 13: expected a number, found 'z'");
    EXPECT_EQ(error_of_bytes(head(2, "ascii") + "11 22 333\n\n", ".pcd"),
              "FILE, line 13: expected 1 more points after it, found the end of the file");
    EXPECT_EQ(error_of_bytes(head(2, "asci"), ".pcd"),
              "FILE, line 11: expected 'DATA ascii|binary|binary_compressed', found 'asci'");
    EXPECT_EQ(error_of_bytes(header("x y z", "4 4 3", "F F F", "1 1 1", 1, "ascii"), ".pcd"),
              "FILE, line 5: expected TYPE: I or U of size 1, 2, 4, 8 or F of size 4, 8, found 'F3'");
    EXPECT_EQ(error_of_bytes(header("x y z", "4 4", "F F F", "1 1 1", 1, "ascii"), ".pcd"),
              "FILE, line 4: expected SIZE: 3 entries, as in FIELDS, found 2");
    EXPECT_EQ(
        error_of_bytes(
            "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 2\nPOINTS 3\nDATA ascii\n",
            ".pcd"),
        "FILE, line 7: expected POINTS: WIDTH times HEIGHT, 4, found 3");
    EXPECT_EQ(error_of_bytes("VERSION .7\nFIELDS x y z\n", ".pcd"),
              "FILE, line 2: expected a 'DATA' line after it, found the end of the file");
    const std::string lzf = compressed(std::string(60, 'a'));
    EXPECT_TRUE(contains(error_of_bytes(head(5, "binary_compressed") + lzf.substr(0, lzf.size() - 1), ".pcd"),
                         "compressed bytes"));
    EXPECT_TRUE(contains(error_of_bytes(head(6, "binary_compressed") + lzf, ".pcd"),
                         "expected the size of 6 points of 12 bytes, found 60"));
    std::string damaged = lzf;
    damaged[8] = '\xff';  // a back reference at the very start
    EXPECT_TRUE(contains(error_of_bytes(head(5, "binary_compressed") + damaged, ".pcd"), "intact LZF data"));
}
