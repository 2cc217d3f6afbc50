#include <sys/resource.h>

#include <chrono>
#include <functional>

#include "io_test_archives.h"
#include "mutations.h"

/** \file test_load_map_hostile.cpp
 * Seeded damage to files of every format. Whatever the bytes, loading ends with a map or a DataError: no
 * other exception, no crash, no more than 2 GB, no long wait.
 */
using namespace mp2p_icp_test;

namespace
{
constexpr int mutations_per_format = 1000;

struct Tally
{
    int loaded = 0, refused = 0;
};

void expect_bounded_memory(int who, const char* name)
{
    rusage usage = {};
    getrusage(who, &usage);
    EXPECT_LT(usage.ru_maxrss, 2'000'000) << "kB, of " << name;
}

/** \param prepare from the mutated bytes to the file's bytes (compression); \param entry of a rawlog or
 * simplemap, such as `:3`
 */
Tally load_mutations(
    const std::string& original, const std::string& suffix, uint64_t seed,
    const std::function<std::string(const std::string&)>& prepare = [](const std::string& s) { return s; },
    const std::string& entry = "", int count = mutations_per_format)
{
    using Clock = std::chrono::steady_clock;
    Tally tally;
    for (int i = 0; i < count; i++)
    {
        mp2p_icp::SeededRandom random(seed * 1000003 + static_cast<uint64_t>(i));
        const TempFile file(suffix, prepare(mutated(original, random)));
        const auto start = Clock::now();
        try
        {
            const auto m = mp2p_icp::load_map(file.path() + entry);
            (void)m.map->contents_summary();
            (void)m.map->bounding_box();
            tally.loaded++;
        }
        catch (const mp2p_icp::DataError& e)
        {
            EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos)
                << "mutation " << i << ": " << e.what();
            tally.refused++;
        }
        catch (const std::exception& e)
        {
            ADD_FAILURE() << "mutation " << i << " of seed " << seed << ": not a DataError: " << e.what();
        }
        EXPECT_LT(std::chrono::duration<double>(Clock::now() - start).count(), 20)
            << "s, mutation " << i << " of seed " << seed;
    }
    expect_bounded_memory(RUSAGE_SELF, "this process");
    expect_bounded_memory(RUSAGE_CHILDREN, "the processes in which archives are read");
    EXPECT_EQ(tally.loaded + tally.refused, count);
    return tally;
}

/// The damage must be of both kinds, else the test tests nothing.
void expect_both(const Tally& t)
{
    EXPECT_GT(t.loaded, mutations_per_format / 100);
    EXPECT_GT(t.refused, mutations_per_format / 10);
}

/// The bytes of a saved cloud with intensity or colours.
std::string saved(const std::string& layer, const std::string& suffix)
{
    const TempFile file(suffix);
    mp2p_icp::save_map(rich_map(false), file.path(), layer);
    return bytes_of_file(file.path());
}
}  // namespace

TEST(LoadMapHostile, plyAscii)
{
    expect_both(
        load_mutations("ply\nformat ascii 1.0\ncomment coordinate_offset 1 2 3\nelement vertex 3\nproperty "
                       "float x\nproperty double y\n"
                       "property float z\nproperty list uchar int t\nproperty uchar red\nproperty uchar "
                       "green\nproperty uchar blue\n"
                       "element face 1\nproperty list uchar int i\nend_header\n1 2 3 0 1 2 3\n4 5 6 1 9 4 5 "
                       "6\nnan 8 9 0 7 8 9\n3 0 1 2\n",
                       ".ply", 1));
}
TEST(LoadMapHostile, plyBinary)
{
    expect_both(load_mutations(saved("with intensity", ".ply"), ".ply", 2));
}
TEST(LoadMapHostile, plyBinaryWithLists)
{
    std::string bytes =
        "ply\nformat binary_big_endian 1.0\nelement camera 2\nproperty list ushort double d\nelement vertex "
        "2\nproperty float x\n"
        "property list int short l\nproperty float y\nproperty float z\nend_header\n";
    bytes += std::string("\0\0\0\1", 4) + "12345678" + big_endian(1.f) + big_endian<int32_t>(2) + "abcd" +
             big_endian(2.f) + big_endian(3.f) + big_endian(4.f) + big_endian<int32_t>(0) + big_endian(5.f) +
             big_endian(6.f);
    ASSERT_EQ(load_bytes(bytes, ".ply").report.points_read, 2u);
    expect_both(load_mutations(bytes, ".ply", 3));
}
TEST(LoadMapHostile, pcdAscii)
{
    expect_both(
        load_mutations("# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb n\nSIZE 4 8 4 4 2\nTYPE F F F U I\nCOUNT "
                       "1 1 1 1 2\nWIDTH 2\nHEIGHT 1\n"
                       "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3 16711680 4 5\n6 7 8 255 9 1\n",
                       ".pcd", 4));
}
TEST(LoadMapHostile, pcdBinary)
{
    expect_both(load_mutations(saved("coloured", ".pcd"), ".pcd", 5));
}
TEST(LoadMapHostile, pcdBinaryCompressed)
{
    // LZF by hand: a literal run of 12 bytes, then a back reference of 12 bytes at distance 12.
    std::string bytes =
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA "
        "binary_compressed\n";
    const std::string lzf = std::string(1, '\x0b') + little_endian(1.f) + little_endian(2.f) +
                            little_endian(3.f) + "\xe0\x03\x0b";
    bytes += little_endian(static_cast<uint32_t>(lzf.size())) + little_endian<uint32_t>(24) + lzf;
    ASSERT_EQ(load_bytes(bytes, ".pcd").report.points_read, 2u);
    expect_both(load_mutations(bytes, ".pcd", 6));
}
TEST(LoadMapHostile, text)
{
    expect_both(load_mutations("x,y,z,intensity\n# c\n1,2,3,0.5\r\n4.5e3,-5,nan,0\n7,8,9,1\n", ".csv", 7));
}
TEST(LoadMapHostile, kitti)
{
    expect_both(load_mutations(saved("with intensity", ".bin"), ".bin", 8));
}
TEST(LoadMapHostile, obj)
{
    expect_both(load_mutations("# c\no x\nv 1 2 3 0.5 1 0\nv 4 5 6 0 0 1\nvn 0 0 1\nf 1 2 1\n", ".obj", 9));
}

TEST(LoadMapHostile, gzip)
{
    const auto t = load_mutations(gzipped("1 2 3\n4 5 6\n7 8 9\n"), ".xyz.gz", 10);
    EXPECT_GT(t.refused, mutations_per_format * 3 / 4);  // little survives the CRC
    expect_both(load_mutations("1 2 3\n4 5 6\n7 8 9\n", ".xyz.gz", 11, gzipped));
}

TEST(LoadMapHostile, metricMap)
{
    Tally sum;
    for (const bool with_metadata : {false, true})
    {
        const auto t = load_mutations(archive_of(rich_map(with_metadata)), ".mm", with_metadata ? 12 : 13,
                                      gzipped, "", mutations_per_format / 2);
        sum.loaded += t.loaded, sum.refused += t.refused;
    }
    expect_both(sum);
    EXPECT_GT(load_mutations(gzipped(archive_of(rich_map(true))), ".mm", 14).refused,
              mutations_per_format * 3 / 4);
}

TEST(LoadMapHostile, rawlog)
{
    Tally sum;
    for (const int entry : {1, 3, 4, 5})
    {
        const auto t = load_mutations(rawlog_bytes(), ".rawlog", static_cast<uint64_t>(20 + entry), gzipped,
                                      ":" + std::to_string(entry), mutations_per_format / 4);
        sum.loaded += t.loaded, sum.refused += t.refused;
    }
    expect_both(sum);
}

TEST(LoadMapHostile, simplemap)
{
    expect_both(load_mutations(simplemap_bytes(), ".simplemap", 30, gzipped, ":1"));
}

TEST(LoadMapHostile, realObservations)
{
    // Larger files, whose parsers are the more intricate ones; fewer mutations to stay quick.
    for (const std::string name :
         {"rot_scan_2d.rawlog", "rot_scan_velodyne.rawlog", "test_velodyne_VLP16.rawlog"})
    {
        const auto path = mrpt_dataset(name);
        MP2P_ICP_SKIP_WITHOUT(path);
        load_mutations(
            gunzipped(path), ".rawlog", 40, [](const std::string& s) { return s; }, ":0", 100);
    }
}

TEST(LoadMapHostile, countsThatWouldClaimAllMemoryAreRefusedQuickly)
{
    // The number of points of a layer, and of lines, as 2^32-1: MRPT alone would claim 48 to 200 GB.
    std::string map = archive_of(rich_map(false));
    const auto after = [&map](const std::string& what) { return map.find(what) + what.size(); };
    for (const size_t at : {after("CSimplePointsMap") + 1, after("TLine3D")})
    {
        std::string bad = map;
        bad.replace(at, 4, little_endian<uint32_t>(UINT32_MAX));
        const auto start = std::chrono::steady_clock::now();
        EXPECT_NE(error_of_bytes(bad, ".mm"), "no error");
        EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 10);
    }
    expect_bounded_memory(RUSAGE_CHILDREN, "the processes in which archives are read");
}
