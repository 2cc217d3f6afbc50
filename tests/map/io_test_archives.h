#pragma once

#include <mp2p_icp/random.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservation3DRangeScan.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationPointCloud.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/serialization/CArchive.h>

#include "io_test_tools.h"

/// Small MRPT archives, as bytes that are not compressed.
namespace mp2p_icp_test
{
template <class... Objects>
std::string archive_of(const Objects&... objects)
{
    mrpt::io::CMemoryStream stream;
    auto archive = mrpt::serialization::archiveFrom(stream);
    ((archive << objects), ...);
    return {static_cast<const char*>(stream.getRawBufferData()), stream.getTotalBytesCount()};
}

/// Ranges of `range` metres over half a turn, from a sensor at x = 0.5 m.
inline mrpt::obs::CObservation2DRangeScan scan_2d(size_t rays, float range)
{
    mrpt::obs::CObservation2DRangeScan scan;
    scan.aperture = static_cast<float>(M_PI);
    scan.maxRange = 80;
    scan.sensorPose = mrpt::poses::CPose3D(0.5, 0, 0, 0, 0, 0);
    scan.resizeScanAndAssign(rays, range, true);
    return scan;
}

inline mrpt::obs::CObservation3DRangeScan depth_image(int rows, int columns)
{
    mrpt::obs::CObservation3DRangeScan scan;
    scan.hasRangeImage = true;
    scan.range_is_depth = true;
    scan.rangeImage_setSize(rows, columns);
    scan.rangeImage.fill(2000);
    scan.rangeUnits = 1e-3f;
    scan.maxRange = 10;
    auto& camera = scan.cameraParams;
    camera.ncols = static_cast<uint32_t>(columns), camera.nrows = static_cast<uint32_t>(rows);
    camera.setIntrinsicParamsFromValues(columns, columns, columns / 2.0, rows / 2.0);
    return scan;
}

inline mrpt::obs::CObservationPointCloud cloud_observation(size_t points)
{
    mrpt::obs::CObservationPointCloud o;
    const auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (size_t i = 0; i < points; i++) cloud->insertPoint(static_cast<float>(i), 1, 2);
    o.pointcloud = cloud;
    return o;
}

/// Entries: 0 odometry, 1 a scan, 2 an action, 3 a frame of two scans, 4 a depth image, 5 a cloud, 6
/// odometry.
inline std::string rawlog_bytes()
{
    mrpt::obs::CSensoryFrame frame;
    frame.insert(std::make_shared<mrpt::obs::CObservation2DRangeScan>(scan_2d(10, 3)));
    frame.insert(std::make_shared<mrpt::obs::CObservation2DRangeScan>(scan_2d(20, 4)));
    mrpt::obs::CObservationComment comment;  // no entry
    comment.text = "made by a test";
    return archive_of(comment, mrpt::obs::CObservationOdometry(), scan_2d(30, 2),
                      mrpt::obs::CActionCollection(), frame, depth_image(6, 8), cloud_observation(7),
                      mrpt::obs::CObservationOdometry());
}

inline std::string simplemap_bytes()
{
    mrpt::maps::CSimpleMap map;
    for (size_t i = 1; i <= 3; i++)
    {
        const auto frame = mrpt::obs::CSensoryFrame::Create();
        frame->insert(std::make_shared<mrpt::obs::CObservation2DRangeScan>(scan_2d(10 * i, 2)));
        map.insert(mrpt::poses::CPose3DPDFGaussian::Create(), frame);
    }
    return archive_of(map);
}

/// Clouds of each class, with planes, lines, id, label and (if asked for) metadata.
inline mp2p_icp::metric_map_t rich_map(bool with_metadata)
{
    mp2p_icp::SeededRandom random(7);
    const auto f = [&random] { return static_cast<float>(random.uniform(-50, 50)); };
    mp2p_icp::metric_map_t map;
    const auto simple = mrpt::maps::CSimplePointsMap::Create();
    const auto intensity = mrpt::maps::CPointsMapXYZI::Create();
    const auto colour = mrpt::maps::CColouredPointsMap::Create();
    for (int i = 0; i < 9; i++)
    {
        simple->insertPoint(f(), f(), f());
        intensity->insertPointRGB(f(), f(), f(), static_cast<float>(random.uniform()), 0, 0);
        colour->insertPointRGB(f(), f(), f(), 0.25f, static_cast<float>(i) / 255.f, 1);
    }
    map.layers = {{"raw", simple}, {"with intensity", intensity}, {"coloured", colour}};
    map.planes.emplace_back(mrpt::math::TPlane(0.6, 0, 0.8, -2.5), mrpt::math::TPoint3D(1, 2, 3));
    map.planes.emplace_back(mrpt::math::TPlane(0, 1, 0, 7), mrpt::math::TPoint3D(-4, -7, 0.1));
    map.lines.push_back(mrpt::math::TLine3D::FromPointAndDirector({1, 2, 3}, {0, 0, 1}));
    map.id = 0x123456789abcdefull;
    map.label = "hall";
    if (!with_metadata) return map;
    map.metadata["sensor"] = std::string("a \"quoted\" name: [x] # y\nsecond line");
    map.metadata["height_m"] = 0.1 + 0.2;
    map.metadata["count"] = 12;
    map.set_coordinate_offset({500123, 4649776, -12});
    return map;
}
}  // namespace mp2p_icp_test
