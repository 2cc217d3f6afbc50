#include <mp2p_icp/random.h>

#include <cmath>
#include <limits>

#include "io_test_archives.h"

using namespace mp2p_icp_test;
using mp2p_icp::metric_map_t;

namespace
{
/// Floats of all sizes up to 10 km, also those that decimal digits are hard on.
float any_float(mp2p_icp::SeededRandom& random)
{
    switch (random.index(4))
    {
        case 0:
            return static_cast<float>(random.uniform(-1e4, 1e4));
        case 1:
            return static_cast<float>(random.uniform(-1, 1) * std::pow(10, random.uniform(-40, 3)));
        case 2:
            return -0.f;
        default:
            return static_cast<float>(random.index(1000)) * 0.1f;
    }
}

mrpt::maps::CPointsMap::Ptr simple_cloud()
{
    mp2p_icp::SeededRandom random(1);
    const auto c = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 500; i++) c->insertPointFast(any_float(random), any_float(random), any_float(random));
    return c;
}
mrpt::maps::CPointsMap::Ptr intensity_cloud()
{
    mp2p_icp::SeededRandom random(2);
    const auto c = mrpt::maps::CPointsMapXYZI::Create();
    for (int i = 0; i < 500; i++)
        c->insertPointRGB(any_float(random), any_float(random), any_float(random), any_float(random), 0, 0);
    return c;
}
mrpt::maps::CPointsMap::Ptr colour_cloud(bool of_bytes)
{
    mp2p_icp::SeededRandom random(3);
    const auto c = mrpt::maps::CColouredPointsMap::Create();
    const auto colour = [&] {
        return of_bytes ? static_cast<float>(random.index(256)) / 255.f
                        : static_cast<float>(random.uniform());
    };
    for (int i = 0; i < 500; i++)
    {
        const float r = colour(), g = colour(), b = colour();
        c->insertPointRGB(any_float(random), any_float(random), any_float(random), r, g, b);
    }
    return c;
}

metric_map_t map_of(const mrpt::maps::CPointsMap::Ptr& cloud)
{
    metric_map_t map;
    map.layers["raw"] = cloud;
    return map;
}

mp2p_icp::LoadedMap written_and_read(const metric_map_t& map, const std::string& suffix)
{
    const TempFile file(suffix);
    mp2p_icp::save_map(map, file.path());
    return mp2p_icp::load_map(file.path());
}
}  // namespace

class SaveMap : public ::testing::TestWithParam<std::string>
{
};

TEST_P(SaveMap, everyCloudClassComesBackWithTheSameBitsAndClass)
{
    for (const auto& cloud : {simple_cloud(), intensity_cloud(), colour_cloud(true), colour_cloud(false)})
    {
        SCOPED_TRACE(cloud->GetRuntimeClass()->className);
        const bool kitti = GetParam() == ".bin";
        if (kitti && dynamic_cast<mrpt::maps::CColouredPointsMap*>(cloud.get()))
            continue;  // no place for colours
        const auto read = written_and_read(map_of(cloud), GetParam());
        Rows expected = rows_of(*cloud);
        if (kitti)
            for (auto& row : expected) row.resize(4, 0.f);  // intensity 0 where there was none
        else
            EXPECT_EQ(raw_layer(read)->GetRuntimeClass(), cloud->GetRuntimeClass());
        expect_same_bits(rows_of(*raw_layer(read)), expected);
        EXPECT_EQ(read.report.points_read, 500u);
        EXPECT_EQ(notes_of(read.report), "");
    }
}

TEST_P(SaveMap, aMapWithAnOffsetStandsAtItsTrueCoordinatesAndComesBackExactly)
{
    if (GetParam() == ".bin")
    {
        metric_map_t map = map_of(simple_cloud());
        map.set_coordinate_offset({1, 0, 0});
        EXPECT_THROW(mp2p_icp::save_map(map, temp_path(".bin")), std::invalid_argument);
        return;
    }
    // What a map holds that was read from double coordinates: whole numbers of 2^-30 m near the offset, as
    // doubles there are.
    mp2p_icp::SeededRandom random(4);
    const auto cloud = mrpt::maps::CPointsMapXYZI::Create();
    const mrpt::math::TPoint3D offset(500123, 4649776, -12);
    for (int i = 0; i < 500; i++)
    {
        const auto coordinate = [&](double o)
        {
            const double true_place = o + random.uniform(-1, 1) * std::pow(10, random.uniform(-6, 3));
            return static_cast<float>(true_place - o);
        };
        const float x = coordinate(offset.x), y = coordinate(offset.y), z = coordinate(offset.z);
        cloud->insertPointRGB(x, y, z, static_cast<float>(i), 0, 0);
    }
    metric_map_t map = map_of(cloud);
    map.set_coordinate_offset(offset);
    const auto read = written_and_read(map, GetParam());
    EXPECT_EQ(read.map->coordinate_offset(), offset);
    expect_same_bits(rows_of(*raw_layer_as<mrpt::maps::CPointsMapXYZI>(read)), rows_of(*cloud));
    if (GetParam() == ".mm") return;
    // The file itself holds the true coordinates: with another offset asked for, they are relative to that.
    const TempFile file(GetParam());
    mp2p_icp::save_map(map, file.path());
    mp2p_icp::LoadOptions options;
    options.coordinate_offset = mrpt::math::TPoint3D(500123, 4649000, -12);
    const auto other = mp2p_icp::load_map(file.path(), options);
    EXPECT_EQ(raw_layer(other)->getPointsBufferRef_x()[3], cloud->getPointsBufferRef_x()[3]);
    EXPECT_NEAR(raw_layer(other)->getPointsBufferRef_y()[3], cloud->getPointsBufferRef_y()[3] + 776,
                1e-4);  // float at 1 km
}

TEST_P(SaveMap, farCoordinatesWithoutAnOffsetComeBackExactly)
{
    const auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 10; i++) cloud->insertPoint(2e4f + static_cast<float>(i) / 3, -7e5f, 0.1f);
    const auto read = written_and_read(map_of(cloud), GetParam());
    if (GetParam() == ".bin")  // no place for a note; the offset and the rest still add up exactly
    {
        const auto o = read.map->coordinate_offset();
        for (size_t i = 0; i < 10; i++)
            EXPECT_EQ(
                static_cast<float>(static_cast<double>(raw_layer(read)->getPointsBufferRef_x()[i]) + o.x),
                cloud->getPointsBufferRef_x()[i]);
        return;
    }
    EXPECT_EQ(read.map->coordinate_offset(), mrpt::math::TPoint3D(0, 0, 0));
    expect_same_bits(rows_of(*raw_layer(read)), rows_of(*cloud));
}

TEST_P(SaveMap, anUnwritablePlaceIsADataError)
{
    EXPECT_THROW(mp2p_icp::save_map(map_of(simple_cloud()), "/nonexistent_folder/x" + GetParam()),
                 mp2p_icp::DataError);
}

INSTANTIATE_TEST_SUITE_P(Formats, SaveMap,
                         ::testing::Values(".mm", ".ply", ".pcd", ".xyz", ".txt", ".csv", ".bin", ".ply.gz",
                                           ".xyz.gz"),
                         [](const auto& format)
                         {
                             std::string name = format.param.substr(1);
                             std::replace(name.begin(), name.end(), '.', '_');
                             return name;
                         });

TEST(SaveMapArguments, theLayerMustBeClear)
{
    metric_map_t map = map_of(simple_cloud());
    map.layers["other"] = intensity_cloud();
    const TempFile file(".ply");
    try
    {
        mp2p_icp::save_map(map, file.path());
        FAIL() << "two layers, none named";
    }
    catch (const std::invalid_argument& e)
    {
        EXPECT_TRUE(contains(e.what(), "'other', 'raw'")) << e.what();
    }
    mp2p_icp::save_map(map, file.path(), "other");
    expect_same_bits(rows_of(*raw_layer(mp2p_icp::load_map(file.path()))),
                     rows_of(*map.point_layer("other")));
    EXPECT_THROW(mp2p_icp::save_map(map, file.path(), "third"), std::invalid_argument);
    EXPECT_THROW(mp2p_icp::save_map(map, temp_path(".mm"), "raw"), std::invalid_argument);
    EXPECT_THROW(mp2p_icp::save_map(map, temp_path(".las"), "raw"), std::invalid_argument);
    EXPECT_THROW(mp2p_icp::save_map(metric_map_t(), file.path()), std::invalid_argument);
}
