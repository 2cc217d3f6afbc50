#include "io_test_archives.h"

using namespace mp2p_icp_test;
using mp2p_icp::metric_map_t;

namespace
{
std::string text(const std::string& s)
{
    return little_endian(static_cast<uint32_t>(s.size())) + s;
}
template <class... T>
std::string doubles(T... v)
{
    return (little_endian(static_cast<double>(v)) + ...);
}
std::string object_start(uint8_t version)
{
    return "\x96mp2p_icp::metric_map_t" + std::string(1, static_cast<char>(version));
}

/// A map of planes and lines, without layers, laid out by hand as the original does.
std::string golden(uint8_t version, const std::string& tail)
{
    std::string s = object_start(version);
    s += text("std::vector") + text("TLine3D") + little_endian<uint32_t>(1) + doubles(1, 2, 3, 0, 0, 1);
    s += little_endian<uint32_t>(1) + doubles(0.6, 0, 0.8, -2.5) + doubles(7, 8, 9);
    s += little_endian<uint32_t>(1) + doubles(1, 2, 3, 0, 0, 1);
    s += little_endian<uint32_t>(0);
    return s + tail + "\x88";
}
const std::string id_and_label = text("std::optional") + text("uint64_t") + "\x01" +
                                 little_endian<uint64_t>(77) + text("std::optional") + text("std::string") +
                                 "\x01" + text("hall");

metric_map_t golden_map()
{
    metric_map_t map;
    map.lines.push_back(mrpt::math::TLine3D::FromPointAndDirector({1, 2, 3}, {0, 0, 1}));
    map.planes.emplace_back(mrpt::math::TPlane(0.6, 0, 0.8, -2.5), mrpt::math::TPoint3D(7, 8, 9));
    map.id = 77;
    map.label = "hall";
    return map;
}

void expect_equal(const metric_map_t& a, const metric_map_t& b)
{
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.label, b.label);
    ASSERT_EQ(a.lines.size(), b.lines.size());
    for (size_t i = 0; i < a.lines.size(); i++)
    {
        EXPECT_EQ(a.lines[i].pBase, b.lines[i].pBase);
        EXPECT_EQ(a.lines[i].director, b.lines[i].director);
    }
    ASSERT_EQ(a.planes.size(), b.planes.size());
    for (size_t i = 0; i < a.planes.size(); i++)
    {
        for (size_t k = 0; k < 4; k++) EXPECT_EQ(a.planes[i].plane.coefs[k], b.planes[i].plane.coefs[k]);
        EXPECT_EQ(a.planes[i].centroid, b.planes[i].centroid);
    }
    ASSERT_EQ(a.layers.size(), b.layers.size());
    for (const auto& [name, layer] : a.layers)
    {
        SCOPED_TRACE(name);
        ASSERT_TRUE(b.layers.count(name));
        EXPECT_EQ(b.layers.at(name)->GetRuntimeClass(), layer->GetRuntimeClass());
        expect_same_bits(rows_of(*a.point_layer(name)), rows_of(*b.point_layer(name)));
    }
}
}  // namespace

TEST(MetricMapSerialization, version1HasTheLayoutOfTheOriginal)
{
    EXPECT_EQ(archive_of(golden_map()), golden(1, id_and_label));
    expect_equal(*load_bytes(golden(1, id_and_label), ".mm").map, golden_map());
}

TEST(MetricMapSerialization, version0HasNeitherIdNorLabel)
{
    metric_map_t expected = golden_map();
    expected.id.reset();
    expected.label.reset();
    expect_equal(*load_bytes(golden(0, ""), ".mm").map, expected);
}

TEST(MetricMapSerialization, version5AddsAnAbsentGeoreferenceAndMetadataAsText)
{
    const std::string no_georeference = text("mp2p_icp::Georeferencing") + std::string("\0\0", 2);
    const std::string tail = id_and_label + no_georeference + "\x01" + text("a: 1\nb:\n  - x\n  - 2.5\n");
    const auto read = load_bytes(golden(5, tail), ".mm").map;
    expect_equal(*read, golden_map());
    EXPECT_EQ(read->metadata["a"].as<int>(), 1);
    EXPECT_EQ(read->metadata["b"](1).as<double>(), 2.5);

    metric_map_t map = golden_map();
    map.metadata["b"] = 2.5;
    EXPECT_EQ(archive_of(map), golden(5, id_and_label + no_georeference + "\x01" + text("{\"b\": 2.5}")));
    const auto without =
        load_bytes(golden(5, id_and_label + no_georeference + std::string(1, '\0')), ".mm").map;
    EXPECT_EQ(archive_of(*without), golden(1, id_and_label));
}

TEST(MetricMapSerialization, aGeoreferenceAndOtherVersionsAreRefusedByName)
{
    for (const int version : {2, 3, 4, 6, 200})
        EXPECT_TRUE(contains(error_of_bytes(golden(static_cast<uint8_t>(version), id_and_label), ".mm"),
                             "version " + std::to_string(version) + " is not supported"))
            << error_of_bytes(golden(static_cast<uint8_t>(version), id_and_label), ".mm");
    const std::string georeference = text("mp2p_icp::Georeferencing") + std::string("\0\1", 2);
    EXPECT_TRUE(contains(error_of_bytes(golden(5, id_and_label + georeference), ".mm"),
                         "version 5 with a georeference is not supported"));
    EXPECT_TRUE(
        contains(error_of_bytes(golden(5, id_and_label + text("other") + std::string("\0\0", 2)), ".mm"),
                 "found 'other'"));
}

TEST(MetricMapSerialization, aLayerOfAnUnknownClassIsRefusedByName)
{
    std::string bytes = archive_of(rich_map(false));
    const std::string known = "CSimplePointsMap", unknown = "CUnheardOfMapXYZ";
    ASSERT_EQ(known.size(), unknown.size());
    bytes.replace(bytes.find(known), known.size(), unknown);
    const std::string error = error_of_bytes(bytes, ".mm");
    EXPECT_TRUE(contains(error, "'mrpt::maps::CUnheardOfMapXYZ', which MRPT ")) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
}

TEST(MetricMapSerialization, aLayerThatIsNoMapIsRefused)
{
    std::string bytes = object_start(1) + text("std::vector") + text("TLine3D") + std::string(12, '\0') +
                        little_endian<uint32_t>(1) + text("odd") +
                        archive_of(mrpt::obs::CObservationOdometry()) + id_and_label + "\x88";
    EXPECT_TRUE(
        contains(error_of_bytes(bytes, ".mm"), "layer 'odd' is no map but a mrpt::obs::CObservationOdometry"))
        << error_of_bytes(bytes, ".mm");
}

TEST(MetricMapSerialization, aRichMapComesBackEqual)
{
    for (const bool with_metadata : {false, true})
    {
        const auto map = rich_map(with_metadata);
        const auto read = load_bytes(gzipped(archive_of(map)), ".mm").map;
        expect_equal(*read, map);
        EXPECT_EQ(archive_of(*read), archive_of(map));
        EXPECT_EQ(read->coordinate_offset(), map.coordinate_offset());
    }
    const auto read = load_bytes(archive_of(rich_map(true)), ".mm").map;
    EXPECT_EQ(read->metadata["sensor"].as<std::string>(), "a \"quoted\" name: [x] # y\nsecond line");
    EXPECT_EQ(read->metadata["height_m"].as<double>(), 0.1 + 0.2);  // all digits: MRPT's writer keeps six
    EXPECT_EQ(read->metadata["count"].as<int>(), 12);
    EXPECT_EQ(read->coordinate_offset(), mrpt::math::TPoint3D(500123, 4649776, -12));
}

TEST(MetricMapSerialization, theFilesOfTheOriginalReadAndAreWrittenByteForByte)
{
    for (const auto& [name, count] :
         {std::pair<std::string, size_t>("global_001.mm", 558), {"local_001.mm", 544}})
    {
        const std::string path = shared_data("maps_2d/" + name);
        MP2P_ICP_SKIP_WITHOUT(path);
        const auto m = mp2p_icp::load_map(path);
        EXPECT_EQ(m.map->point_layer("2d_lidar")->size(), count);
        EXPECT_EQ(m.report.points_read, count);
        EXPECT_EQ(m.report.points_dropped_nonfinite, 0u);
        const TempFile copy(".mm");
        mp2p_icp::save_map(*m.map, copy.path());
        EXPECT_EQ(gunzipped(copy.path()), gunzipped(path));
    }
}

namespace
{
const std::string no_georeference_or_metadata = text("mp2p_icp::Georeferencing") + std::string("\0\0\0", 3);
std::string golden_fits(double last_number)
{
    return std::string("\0", 1)                                                             // version
           + "\x01" + doubles(1, 0, 0, -2, 3) + little_endian<uint64_t>(40) + doubles(0.5)  // the line
           + doubles(1, 2, 3, 4, 5, 6, 7, 8, 9, 10)                                         //
           + "\x01" + doubles(0, 1, 0, -1, 2, -3, 4) + little_endian<uint64_t>(50) +
           doubles(0.25)  // the plane
           + doubles(1, 2, 3, 4, 5, last_number);
}

metric_map_t golden_map_with_fits()
{
    metric_map_t map = golden_map();
    auto& line = map.lines[0].fit.emplace();
    line.axis_a = {1, 0, 0}, line.begin = -2, line.end = 3, line.inliers = 40, line.sigma = 0.5;
    line.covariance << 1, 2, 3, 4, 2, 5, 6, 7, 3, 6, 8, 9, 4, 7, 9, 10;
    auto& plane = map.planes[0].fit.emplace();
    plane.axis_u = {0, 1, 0}, plane.u_min = -1, plane.u_max = 2, plane.v_min = -3, plane.v_max = 4;
    plane.inliers = 50, plane.sigma = 0.25;
    plane.covariance << 1, 2, 3, 2, 4, 5, 3, 5, 6;
    return map;
}
}  // namespace

TEST(MetricMapSerialization, version128AddsTheFitsOfLinesAndPlanes)
{
    const std::string bytes = golden(128, id_and_label + no_georeference_or_metadata + golden_fits(6));
    const metric_map_t map = golden_map_with_fits();
    EXPECT_EQ(archive_of(map), bytes);
    const auto read = load_bytes(bytes, ".mm").map;
    expect_equal(*read, map);
    ASSERT_TRUE(read->lines[0].fit && read->planes[0].fit);
    EXPECT_EQ(read->lines[0].fit->covariance, map.lines[0].fit->covariance);
    EXPECT_EQ(read->planes[0].fit->covariance, map.planes[0].fit->covariance);
    EXPECT_EQ(read->planes[0].fit->inliers, 50u);
    EXPECT_EQ(archive_of(*read), bytes);
}

TEST(MetricMapSerialization, someMayHaveFitsAndMetadataStay)
{
    metric_map_t map = golden_map_with_fits();
    map.planes.insert(map.planes.begin(), mp2p_icp::fitted_plane_t());
    map.planes[0].plane.coefs = {0, 0, 1, 0};
    map.lines[0].fit.reset();
    map.metadata["height"] = 2.5;
    const auto read = load_bytes(archive_of(map), ".mm").map;
    expect_equal(*read, map);
    EXPECT_FALSE(read->planes[0].fit || read->lines[0].fit);
    ASSERT_TRUE(read->planes[1].fit);
    EXPECT_EQ(read->planes[1].fit->v_max, 4);
    EXPECT_EQ(read->metadata["height"].as<double>(), 2.5);
}

TEST(MetricMapSerialization, fitsThatAreNoneAreRefused)
{
    const auto bytes_of = [](const std::string& fits)
    { return golden(128, id_and_label + no_georeference_or_metadata + fits); };
    EXPECT_TRUE(contains(error_of_bytes(bytes_of(golden_fits(-1)), ".mm"), "numbers that no fit gives"));
    std::string other = golden_fits(6);
    other[0] = 3;
    EXPECT_TRUE(contains(error_of_bytes(bytes_of(other), ".mm"), "version 3 of the fits"));
    EXPECT_FALSE(error_of_bytes(bytes_of(golden_fits(6).substr(0, 100)), ".mm").empty());
}
