#include <gtest/gtest.h>
#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/random.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>

#include <limits>

#include "icp_test_tools.h"

/// \file test_log_pairings.cpp Logs hold pairings in few bytes, and lose no bit of them.
using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mrpt::math::TPoint3D;

namespace
{
template <class T>
std::string bytes_of(const T& object)
{
    mrpt::io::CMemoryStream stream;
    auto archive = mrpt::serialization::archiveFrom(stream);
    archive << object;
    return {static_cast<const char*>(stream.getRawBufferData()), stream.getTotalBytesCount()};
}

/// A log of maps with two layers, and no iterations yet.
LogRecord log_of_maps()
{
    LogRecord log;
    for (auto* map : {&log.pcGlobal, &log.pcLocal})
    {
        metric_map_t layers = map_of(wavy_surface(400, 1));
        layers.layers["a"] = wavy_surface(100, 2);
        *map = std::make_shared<metric_map_t>(layers);
    }
    log.iterationsDetails.emplace();
    return log;
}

TPoint3D local_point(const LogRecord& log, const char* layer, size_t index)
{
    TPoint3D p;
    log.pcLocal->point_layer(layer)->getPoint(index, p.x, p.y, p.z);
    return p;
}

plane_patch_t plane_number(size_t i)
{
    const auto x = static_cast<double>(i);
    return {mrpt::math::TPlane(1 / (1 + x), 0.1, 0.7, -x), TPoint3D(x, 0.1, -1e-3 * x)};
}
mrpt::math::TLine3D line_number(size_t i)
{
    mrpt::math::TLine3D line;
    line.pBase = {0.3, static_cast<double>(i), 0}, line.director = {0, 0.6, 0.8};
    return line;
}

void expect_the_same_again(const LogRecord& log)
{
    const std::string bytes = bytes_of(log);
    mrpt::io::CMemoryStream stream;
    stream.Write(bytes.data(), bytes.size());
    stream.Seek(0);
    LogRecord again;
    auto archive = mrpt::serialization::archiveFrom(stream);
    archive >> again;
    ASSERT_EQ(again.iterationsDetails->size(), log.iterationsDetails->size());
    for (const auto& [iteration, details] : *log.iterationsDetails)
        EXPECT_EQ(bytes_of(again.iterationsDetails->at(iteration).pairings), bytes_of(details.pairings));
}
}  // namespace

TEST(log_pairings, of_points_with_surfaces_are_the_same_again)
{
    LogRecord log = log_of_maps();
    for (size_t iteration = 0; iteration < 4; iteration++)
    {
        Pairings& p = (*log.iterationsDetails)[iteration].pairings;
        for (size_t i = 0; i < 300; i++)
        {
            p.paired_pt2pl.push_back({plane_number(i + iteration), local_point(log, "raw", i)});
            p.paired_pt2ln.push_back({line_number(i / 2), local_point(log, "a", i % 100)});
        }
        p.pt2pl_weights = {{300, 0.5}};
    }
    expect_the_same_again(log);
}

TEST(log_pairings, of_all_layers_and_of_none_in_any_order_are_the_same_again)
{
    LogRecord log = log_of_maps();
    SeededRandom random(5);
    const auto some_point = [&]
    {
        const auto which = static_cast<int>(3 * random.uniform());
        if (which == 2) return TPoint3D(random.uniform(), -0.0, std::numeric_limits<double>::quiet_NaN());
        return local_point(log, which ? "raw" : "a", static_cast<size_t>(100 * random.uniform()));
    };
    for (size_t iteration = 0; iteration < 3; iteration++)
    {
        Pairings& p = (*log.iterationsDetails)[iteration].pairings;
        for (size_t i = 0; i < 500; i++)
        {
            const auto number = static_cast<size_t>(200 * random.uniform());
            p.paired_pt2pl.push_back({plane_number(number), some_point()});
            p.paired_pt2ln.push_back({line_number(number), some_point()});
        }
        p.paired_pt2pl[7].pl_global.centroid.x = -0.0;
        p.paired_pt2pl[8].pl_global.centroid.x = std::numeric_limits<double>::quiet_NaN();
    }
    expect_the_same_again(log);
}

TEST(log_pairings, of_known_surfaces_take_few_bytes)
{
    LogRecord log = log_of_maps();
    const auto size_with_iterations = [&](size_t count)
    {
        for (size_t iteration = 0; iteration < count; iteration++)
        {
            Pairings& p = (*log.iterationsDetails)[iteration].pairings;
            p = Pairings();
            for (size_t i = 0; i < 400; i++)
                p.paired_pt2pl.push_back({plane_number(i), local_point(log, "raw", i)});
        }
        return bytes_of(log).size();
    };
    const size_t one = size_with_iterations(1), two = size_with_iterations(2);
    EXPECT_LT(two - one, 3 * 400u) << "a byte for the point, one for the plane; and the iteration's pose";
}
