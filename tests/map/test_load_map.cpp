#include <mrpt/io/lazy_load_path.h>
#include <mrpt/obs/CRawlog.h>

#include <thread>

#include "io_test_archives.h"

using namespace mp2p_icp_test;
using mp2p_icp::load_map;
using mp2p_icp::load_map_pair;

namespace
{
const std::string small_ply =
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
    "z\nend_header\n1 2 3\n";
const std::string small_pcd =
    "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3\n";
const std::string small_obj = "v 1 2 3\n", small_text = "1 2 3\n";
std::string small_mm()
{
    mp2p_icp::metric_map_t map;
    const auto c = mrpt::maps::CSimplePointsMap::Create();
    c->insertPoint(1, 2, 3);
    map.layers["raw"] = c;
    return archive_of(map);
}

/// A cloud in UTM coordinates, as text, and the same one moved to the origin by whole metres.
std::string utm_text(const mrpt::math::TPoint3D& move, bool nan = false)
{
    std::string text = nan ? "nan 1 2\n" : "";
    mp2p_icp::SeededRandom random(11);
    for (int i = 0; i < 200; i++)
    {
        char line[128];  // millimetres: both clouds are the same decimal numbers
        const auto mm = [&] { return static_cast<int>(random.index(200000)) - 100000; };
        std::snprintf(line, sizeof(line), "%.3f %.3f %.3f\n", move.x + 1e-3 * mm(), move.y + 1e-3 * mm(),
                      move.z + 1e-3 * mm());
        text += line;
    }
    return text;
}
const mrpt::math::TPoint3D utm(500000, 4600000, 120);
}  // namespace

// ---- Kinds, suffixes, compression -------------------------------------------------------------------------

TEST(LoadMap, aKnownKindUnderAWrongSuffixIsReadWithANote)
{
    const std::vector<std::pair<std::string, std::string>> kinds = {{".ply", small_ply},
                                                                    {".pcd", small_pcd},
                                                                    {".obj", small_obj},
                                                                    {".xyz", small_text},
                                                                    {".mm", small_mm()}};
    for (const auto& [right, bytes] : kinds)
        for (const auto& [suffix, other] : kinds)
        {
            SCOPED_TRACE(right + " named " + suffix);
            const auto m = load_bytes(bytes, suffix);
            expect_same_bits(rows_of(*raw_layer(m)), {{1, 2, 3}});
            const std::string note =
                suffix == right ? "" : "named " + suffix + ", but it is " + m.report.kind + "\n";
            EXPECT_EQ(notes_of(m.report), note);
        }
    EXPECT_EQ(notes_of(load_bytes(small_ply, "").report), "without a suffix, but it is PLY (ascii)\n");
    EXPECT_EQ(notes_of(load_bytes(small_ply, ".bin").report), "named .bin, but it is PLY (ascii)\n");
}

TEST(LoadMap, everyKindIsReadFromGzip)
{
    for (const auto& [suffix, bytes] :
         std::vector<std::pair<std::string, std::string>>{{".ply", small_ply},
                                                          {".pcd", small_pcd},
                                                          {".obj", small_obj},
                                                          {".xyz", small_text},
                                                          {".mm", small_mm()},
                                                          {".mm", gzipped(small_mm())}})
    {
        const auto m = load_bytes(gzipped(bytes), suffix + ".gz");
        expect_same_bits(rows_of(*raw_layer(m)), {{1, 2, 3}});
        EXPECT_EQ(notes_of(m.report), "");
    }
    EXPECT_EQ(notes_of(load_bytes(gzipped(small_ply), ".ply").report),
              "not named .gz, but it is compressed\n");
    EXPECT_EQ(notes_of(load_bytes(small_ply, ".ply.gz").report), "named .gz, but it is not compressed\n");
    const auto two_members =
        load_bytes(gzipped("1 2 3\n") + gzipped("4 5 6\n") + std::string(512, '\0'), ".xyz.gz");
    expect_same_bits(rows_of(*raw_layer(two_members)), {{1, 2, 3}, {4, 5, 6}});
}

TEST(LoadMap, gzipIsVerified)
{
    const std::string good = gzipped(utm_text({0, 0, 0}));
    for (size_t cut = 1; cut < 20; cut++)
        EXPECT_TRUE(contains(error_of_bytes(good.substr(0, good.size() - cut), ".xyz.gz"), "truncated"))
            << cut;
    for (const size_t back : {2u, 6u})  // length, CRC
    {
        std::string bad = good;
        bad[good.size() - back] = static_cast<char>(bad[good.size() - back] ^ 1);
        EXPECT_TRUE(contains(error_of_bytes(bad, ".xyz.gz"),
                             back == 2 ? "incorrect length check" : "incorrect data check"))
            << error_of_bytes(bad, ".xyz.gz");
    }
    EXPECT_TRUE(contains(error_of_bytes(good + "rest", ".xyz.gz"), "other data after it"));
}

TEST(LoadMap, aDecompressionBombIsRefused)
{
    const std::string hundred_mb = gzipped(std::string(100 << 20, '1'));  // about 100 kB
    std::string bomb;
    for (int i = 0; i < 11; i++) bomb += hundred_mb;
    EXPECT_TRUE(contains(error_of_bytes(bomb, ".xyz.gz"), "expected at most 1073741824 bytes of content"));
}

TEST(LoadMap, whatCannotBeReadIsNamedInOneLine)
{
    EXPECT_EQ(error_of_path("/nonexistent/x.ply"), "FILE: there is no such file");
    EXPECT_EQ(error_of_path("/nonexistent/x.rawlog:3"), "/nonexistent/x.rawlog: there is no such file");
    EXPECT_EQ(error_of_path("/tmp"), "FILE: is a directory, not a file");
    for (const std::string suffix : {".ply", ".pcd", ".xyz", ".bin", ".obj", ".mm", ".xyz.gz"})
        EXPECT_EQ(error_of_bytes("", suffix), "FILE: the file is empty") << suffix;
    EXPECT_EQ(error_of_bytes(gzipped(""), ".xyz.gz"), "FILE: there is nothing in it");
    EXPECT_EQ(error_of_bytes(std::string("\0\1\2\3", 4), ".dat"),
              "FILE, byte 0: expected a PLY, PCD, OBJ, MRPT or KITTI file or rows of numbers, found binary "
              "data of an unknown kind");
    EXPECT_EQ(
        error_of_bytes("\nhello world\n", ".txt"),
        "FILE, line 2: expected a PLY, PCD, OBJ, MRPT or KITTI file or rows of numbers, found 'hello world'");
    EXPECT_EQ(error_of_bytes("LASF" + std::string(300, '\0'), ".las"),
              "FILE: is a LAS/LAZ file, a kind that is not supported");
    EXPECT_EQ(error_of_bytes("\x93mp2p_icp::LogRecord" + std::string(9, '\0'), ".icplog"),
              "FILE: is an ICP log (.icplog), a kind that is not supported");
    EXPECT_TRUE(contains(error_of_bytes(rawlog_bytes(), ".rawlog"), "is a rawlog; name one of its entries"));
    EXPECT_TRUE(
        contains(error_of_bytes(simplemap_bytes(), ".simplemap"), "is a simplemap; name one of its entries"));
}

TEST(LoadMap, aTruncatedArchiveIsADataErrorWhereverItEnds)
{
    const std::string whole = archive_of(rich_map(true));
    for (size_t size = 30; size < whole.size(); size += 37)
    {
        const std::string error = error_of_bytes(whole.substr(0, size), ".mm");
        EXPECT_TRUE(contains(error, "FILE: ")) << size << ": " << error;
        EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    }
}

TEST(LoadMap, aMapLosesItsNonFinitePointsAndKeepsTheOthersFields)
{
    mp2p_icp::metric_map_t map;
    const auto c = mrpt::maps::CPointsMapXYZI::Create();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    c->insertPointRGB(nan, 0, 0, 1, 0, 0);
    c->insertPointRGB(1, 2, 3, 4, 0, 0);
    c->insertPointRGB(0, -std::numeric_limits<float>::infinity(), 0, 5, 0, 0);
    c->insertPointRGB(5, 6, 7, 8, 0, 0);
    map.layers["raw"] = c;
    const auto m = load_bytes(archive_of(map), ".mm");
    EXPECT_EQ(m.report.points_read, 4u);
    EXPECT_EQ(m.report.points_dropped_nonfinite, 2u);
    expect_same_bits(rows_of(*raw_layer(m)), {{1, 2, 3, 4}, {5, 6, 7, 8}});

    mp2p_icp::metric_map_t all_nan;
    const auto bad = mrpt::maps::CSimplePointsMap::Create();
    bad->insertPoint(nan, nan, nan);
    all_nan.layers["raw"] = bad;
    EXPECT_TRUE(contains(error_of_bytes(archive_of(all_nan), ".mm"), "there is no finite point"));
}

TEST(LoadMap, thePointsGoIntoTheLayerThatIsAskedFor)
{
    mp2p_icp::LoadOptions options;
    options.layer = "mine";
    EXPECT_EQ(load_bytes(small_ply, ".ply", options).map->point_layer("mine")->size(), 1u);
}

// ---- Large coordinates ------------------------------------------------------------------------------------

TEST(LoadMap, farCoordinatesAreStoredAsExactlyAsNearOnes)
{
    const auto near = load_bytes(utm_text({0, 0, 0}), ".xyz");
    EXPECT_EQ(near.map->coordinate_offset(), mrpt::math::TPoint3D(0, 0, 0));
    mp2p_icp::LoadOptions options;
    options.coordinate_offset = utm;
    const auto far = load_bytes(utm_text(utm), ".xyz", options);
    EXPECT_EQ(far.map->coordinate_offset(), utm);
    const auto a = rows_of(*raw_layer(near)), b = rows_of(*raw_layer(far));
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); i++)
        for (size_t k = 0; k < 3; k++)
            EXPECT_NEAR(a[i][k], b[i][k], 1e-5)
                << i;  // a double's step at 4.6e6 m is 1e-9; float's at 100 m 8e-6
}

TEST(LoadMap, numbersThatDoubleHoldsExactlyAreStoredWithTheSameBitsAnywhere)
{
    std::string near, far;
    for (int i = 0; i < 100; i++)
    {
        char line[128];
        const double x = 0.0078125 * i - 3, y = 0.125 * i, z = i;  // whole numbers of 1/128 m
        std::snprintf(line, sizeof(line), "%.10f %.10f %.10f\n", x, y, z), near += line;
        std::snprintf(line, sizeof(line), "%.10f %.10f %.10f\n", x + utm.x, y + utm.y, z + utm.z),
            far += line;
    }
    mp2p_icp::LoadOptions options;
    options.coordinate_offset = utm;
    expect_same_bits(rows_of(*raw_layer(load_bytes(far, ".xyz", options))),
                     rows_of(*raw_layer(load_bytes(near, ".xyz"))));
}

TEST(LoadMap, theOffsetChosenIsTheRoundedCentreOfTheFinitePoints)
{
    const auto m = load_bytes("500000.2 4600000.2 10\nnan 0 0\n500010.9 4600000.8 12\n", ".xyz");
    EXPECT_EQ(m.map->coordinate_offset(), mrpt::math::TPoint3D(500006, 4600001, 11));
    EXPECT_TRUE(contains(notes_of(m.report), "relative to (500006, 4600001, 11)"));
    EXPECT_NEAR(raw_layer(m)->getPointsBufferRef_x()[0], -5.8, 1e-6);
    EXPECT_EQ(load_bytes("10000 -10000 10000\n", ".xyz").map->coordinate_offset(),
              mrpt::math::TPoint3D(0, 0, 0));
    EXPECT_EQ(load_bytes("10000.01 0 0\n", ".xyz").map->coordinate_offset(),
              mrpt::math::TPoint3D(10000, 0, 0));
}

TEST(LoadMap, anOffsetMustBeWholeNumbers)
{
    mp2p_icp::LoadOptions options;
    options.coordinate_offset = mrpt::math::TPoint3D(0.5, 0, 0);
    EXPECT_THROW(load_bytes("1 2 3\n", ".xyz", options), std::invalid_argument);
}

TEST(LoadMapPair, bothGetTheGlobalOffsetWhereBothAreFarAndClose)
{
    const TempFile global("_g.xyz", utm_text(utm)),
        local("_l.xyz", utm_text(utm + mrpt::math::TPoint3D(300, -40, 5))),
        near("_n.xyz", utm_text({0, 0, 0})),
        elsewhere("_e.xyz", utm_text(utm + mrpt::math::TPoint3D(50000, 0, 0)));
    const auto [l, g] = load_map_pair(local.path(), global.path());
    EXPECT_EQ(l.report.source, local.path());
    EXPECT_NE(g.map->coordinate_offset(), mrpt::math::TPoint3D(0, 0, 0));
    EXPECT_EQ(l.map->coordinate_offset(), g.map->coordinate_offset());
    EXPECT_NEAR(raw_layer(l)->getPointsBufferRef_x()[0] - raw_layer(g)->getPointsBufferRef_x()[0], 300,
                1e-4);  // float at 400 m

    EXPECT_EQ(load_map_pair(near.path(), global.path()).first.map->coordinate_offset(),
              mrpt::math::TPoint3D(0, 0, 0));
    EXPECT_EQ(load_map_pair(global.path(), near.path()).first.map->coordinate_offset(),
              g.map->coordinate_offset());
    const auto far_apart = load_map_pair(elsewhere.path(), global.path());
    EXPECT_NEAR(far_apart.first.map->coordinate_offset().x, utm.x + 50000,
                100);  // its own centre: the cloud is 200 m wide
}

TEST(LoadMapPair, theOffsetOfAMapIsTaken)
{
    mp2p_icp::metric_map_t map;
    const auto c = mrpt::maps::CSimplePointsMap::Create();
    c->insertPoint(1, 2, 3);
    map.layers["raw"] = c;
    map.set_coordinate_offset(utm);
    const TempFile global(".mm", archive_of(map)), local(".xyz", utm_text(utm));
    const auto pair = load_map_pair(local.path(), global.path());
    EXPECT_EQ(pair.first.map->coordinate_offset(), utm);
    EXPECT_EQ(pair.second.map->coordinate_offset(), utm);
}

// ---- Rawlogs and simplemaps -------------------------------------------------------------------------------

TEST(LoadMapObservations, pathsWithAnEntryAreRecognized)
{
    using mp2p_icp::is_observations_path;
    for (const std::string yes :
         {"a.rawlog:0", "/b/a b.simplemap:12", "a.rawlog.gz:3", "C:/a.simplemap.gz:4"})
        EXPECT_TRUE(is_observations_path(yes)) << yes;
    for (const std::string no : {"a.rawlog", "a.rawlog:", "a.rawlog:-1", "a.rawlog:1x", "a.ply:1",
                                 "a.rawlog:1/b.ply", "rawlog:1", ""})
        EXPECT_FALSE(is_observations_path(no)) << no;
}

TEST(LoadMapObservations, everyKindOfEntryGivesItsPoints)
{
    const auto plain = rawlog_bytes();
    for (const bool compressed : {false, true})
    {
        const TempFile file(compressed ? ".rawlog.gz" : ".rawlog", compressed ? gzipped(plain) : plain);
        const auto points = [&](int entry) {
            return raw_layer_as<mrpt::maps::CSimplePointsMap>(
                load_map(file.path() + ":" + std::to_string(entry)));
        };
        EXPECT_EQ(points(1)->size(), 30u);
        EXPECT_EQ(points(3)->size(), 30u);  // 10 and 20, of two scans
        EXPECT_EQ(points(4)->size(), 48u);
        EXPECT_EQ(points(5)->size(), 7u);
        for (const auto& p : rows_of(*points(1)))
            EXPECT_NEAR(std::hypot(p[0] - 0.5f, p[1]), 2, 1e-5);  // float, about the sensor
    }
}

TEST(LoadMapObservations, entriesWithoutRangeDataNameTheNearestThatHaveSome)
{
    const TempFile file(".rawlog", gzipped(rawlog_bytes()));
    const auto error = [&](int entry)
    {
        const std::string text = error_of_path(file.path() + ":" + std::to_string(entry));
        return text.substr(text.find(": ") + 2);
    };
    EXPECT_EQ(error(0),
              "entry 0 (mrpt::obs::CObservationOdometry) holds no range data; the nearest that do: entry 1 "
              "after it");
    EXPECT_EQ(error(2),
              "entry 2 (mrpt::obs::CActionCollection) holds no range data; the nearest that do: entry 1 "
              "before and entry 3 after it");
    EXPECT_EQ(error(6),
              "entry 6 (mrpt::obs::CObservationOdometry) holds no range data; the nearest that do: entry 5 "
              "before it");
    EXPECT_EQ(error(7), "there is no entry 7: it has 7 entries, 0 to 6");
    const TempFile odometry("_o.rawlog", archive_of(mrpt::obs::CObservationOdometry()));
    EXPECT_TRUE(contains(error_of_path(odometry.path() + ":0"), "nor does any other entry"));
}

TEST(LoadMapObservations, aTruncatedRawlogIsReadUpToTheDamage)
{
    const std::string whole = rawlog_bytes();
    const TempFile file(".rawlog", whole.substr(0, whole.size() / 2));  // ends in the depth image
    EXPECT_EQ(load_map(file.path() + ":1").report.points_read, 30u);
    const std::string error = error_of_path(file.path() + ":5");
    EXPECT_TRUE(contains(error, "after 4 entries, the object at byte ")) << error;
}

TEST(LoadMapObservations, keyframesOfASimplemapAreEntries)
{
    for (const bool compressed : {false, true})
    {
        const TempFile file(".simplemap", compressed ? gzipped(simplemap_bytes()) : simplemap_bytes());
        EXPECT_EQ(load_map(file.path() + ":0").report.points_read, 10u);
        EXPECT_EQ(load_map(file.path() + ":2").report.points_read, 30u);
        EXPECT_TRUE(contains(error_of_path(file.path() + ":3"), "it has 3 entries, 0 to 2"));
    }
}

TEST(LoadMapObservations, theObservationsThemselvesCanBeHad)
{
    const TempFile file(".rawlog", rawlog_bytes());
    mp2p_icp::LoadReport report;
    const auto frame = mp2p_icp::load_observations(file.path() + ":3", report);
    ASSERT_EQ(frame->size(), 2u);
    EXPECT_EQ(frame->getObservationByIndexAs<mrpt::obs::CObservation2DRangeScan::Ptr>(1)->getScanSize(), 20u);
    EXPECT_EQ(report.kind, "rawlog, entry 3");
    EXPECT_THROW(mp2p_icp::load_observations(file.path(), report), mp2p_icp::DataError);
}

TEST(LoadMapObservations, aMissingExternalFileIsADataError)
{
    const auto folder = std::filesystem::temp_directory_path().string() + "/";
    auto scan = depth_image(6, 8);
    const std::string file_name = "mp2p_icp_external_range.bin";
    scan.rangeImage_convertToExternalStorage(file_name, folder);
    auto cloud = cloud_observation(3);
    cloud.setAsExternalStorage("mp2p_icp_missing_cloud.bin",
                               mrpt::obs::CObservationPointCloud::ExternalStorageFormat::MRPT_Serialization);
    const TempFile file(".rawlog", archive_of(scan, cloud));
    const std::string base = mrpt::io::getLazyLoadPathBase();
    mrpt::io::setLazyLoadPathBase(folder);
    EXPECT_EQ(load_map(file.path() + ":0").report.points_read, 48u);
    std::filesystem::remove(folder + file_name);
    const std::string gone = error_of_path(file.path() + ":0"), never = error_of_path(file.path() + ":1");
    mrpt::io::setLazyLoadPathBase(base);
    EXPECT_NE(gone, "no error");
    EXPECT_TRUE(contains(never, "mp2p_icp_missing_cloud.bin")) << never;
}

TEST(LoadMapObservations, entriesOfRealRawlogsAreCountedAsMrptDoes)
{
    for (const std::string name :
         {"2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog", "test_rtk_path.rawlog",
          "localization_demo.rawlog", "uwb_ro-localization_demo.rawlog"})
    {
        const auto path = mrpt_dataset(name);
        MP2P_ICP_SKIP_WITHOUT(path);
        mrpt::obs::CRawlog rawlog;
        ASSERT_TRUE(rawlog.loadFromRawLogFile(path));
        EXPECT_TRUE(contains(error_of_path(path + ":9999999"),
                             "it has " + std::to_string(rawlog.size()) + " entries"))
            << error_of_path(path + ":9999999");
    }
}

TEST(LoadMapObservations, realScansOfEveryKindGivePoints)
{
    // The counts of MRPT's own conversions, or of the valid rays.
    for (const auto& [name, least, most] :
         {std::tuple<std::string, uint64_t, uint64_t>(
              "2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog:0", 300, 361),
          {"rot_scan_2d.rawlog:0", 300, 400},
          {"rot_scan_velodyne.rawlog:0", 10000, 30000},
          {"test_velodyne_VLP16.rawlog:0", 10000, 30000},
          {"tests_rgbd.rawlog:0", 200000, 307200},
          {"localization_demo.simplemap.gz:3", 300, 361},
          {"malaga-cs-fac-building.simplemap.gz:98", 300, 361}})
    {
        const auto file = mrpt_dataset(name.substr(0, name.rfind(':')));
        MP2P_ICP_SKIP_WITHOUT(file);
        const auto m = load_map("/usr/share/mrpt/datasets/" + name);
        EXPECT_GE(m.report.points_read, least) << name;
        EXPECT_LE(m.report.points_read, most) << name;
    }
}

TEST(LoadMapObservations, severalThreadsMayLoadAtOnce)
{
    const TempFile rawlog(".rawlog", gzipped(rawlog_bytes())), map(".mm", archive_of(rich_map(true)));
    std::vector<std::thread> threads;
    std::atomic<int> right{0};
    for (int t = 0; t < 4; t++)
        threads.emplace_back(
            [&, t]
            {
                for (int i = 0; i < 10; i++)
                    right += t % 2 ? load_map(rawlog.path() + ":3").report.points_read == 30u
                                   : load_map(map.path()).report.points_read == 27u;
            });
    for (auto& t : threads) t.join();
    EXPECT_EQ(right, 40);
}
