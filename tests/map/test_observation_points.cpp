#include <gtest/gtest.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/observation_points.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/random.h>
#include <mrpt/maps/CColouredPointsMap.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservation3DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationPointCloud.h>
#include <mrpt/obs/CObservationRotatingScan.h>
#include <mrpt/obs/CObservationVelodyneScan.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/obs/registerAllClasses.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "test_data.h"

using namespace mp2p_icp;
using mrpt::maps::CPointsMapXYZI;
using mrpt::maps::CSimplePointsMap;
using mrpt::math::TPoint3D;
using mrpt::obs::CObservation2DRangeScan;
using mrpt::poses::CPose3D;

namespace
{
const float NaN = std::numeric_limits<float>::quiet_NaN();

/// A sensor pose with every degree of freedom in use.
CPose3D some_pose()
{
    return {1.5, -0.7, 0.9, 0.6, -0.3, 0.2};
}

TPoint3D point(const mrpt::maps::CPointsMap& m, size_t i)
{
    TPoint3D p;
    m.getPoint(i, p);
    return p;
}

/// A scan, from `T_robot_sensor`, of the plane x = 5 of the robot's frame.
CObservation2DRangeScan scan_of_wall(const CPose3D& T_robot_sensor, size_t rays = 61)
{
    CObservation2DRangeScan scan;
    scan.aperture = 1.0f;
    scan.sensorPose = T_robot_sensor;
    scan.resizeScanAndAssign(rays, 1.0f, true);
    for (size_t i = 0; i < rays; i++)
    {
        const double angle = -0.5 + static_cast<double>(i) / static_cast<double>(rays - 1);
        const auto direction = T_robot_sensor.rotateVector({std::cos(angle), std::sin(angle), 0});
        scan.setScanRange(i, static_cast<float>((5 - T_robot_sensor.x()) / direction.x));
    }
    return scan;
}

template <class Observation>
std::shared_ptr<Observation> first_of_rawlog(const std::string& path)
{
    mrpt::obs::registerAllClasses_mrpt_obs();
    mrpt::obs::CRawlog log;
    if (!log.loadFromRawLogFile(path)) return nullptr;
    return std::dynamic_pointer_cast<Observation>(log.getAsGeneric(0));
}

/// The points that the observation gives from `T_robot_sensor` must be those that it gives from the origin,
/// moved: once.
template <class Observation>
void expect_pose_applied_once(Observation o)
{
    CSimplePointsMap in_sensor, in_robot;
    o.setSensorPose(CPose3D());
    ASSERT_EQ(insert_observation_points(o, in_sensor), 0u);
    o.setSensorPose(some_pose());
    ASSERT_EQ(insert_observation_points(o, in_robot), 0u);
    ASSERT_GT(in_sensor.size(), 100u);
    ASSERT_EQ(in_sensor.size(), in_robot.size());
    for (size_t i = 0; i < in_sensor.size(); i++)
    {
        const auto p = point(in_sensor, i);
        // Two roundings to float, of coordinates up to |p|.
        ASSERT_LT((some_pose().composePoint(p) - point(in_robot, i)).norm(), 3e-7 * (p.norm() + 2)) << i;
    }
}
}  // namespace

// ---- 2-D scans --------------------------------------------------------------------------------------------

TEST(ObservationPoints, ScanOfAWallLiesOnTheWallWhateverTheSensorPose)
{
    const auto scan = scan_of_wall(some_pose());
    CSimplePointsMap points;
    ASSERT_EQ(insert_observation_points(scan, points), 0u);
    ASSERT_EQ(points.size(), scan.getScanSize());
    for (size_t i = 0; i < points.size(); i++)
        EXPECT_NEAR(point(points, i).x, 5.0, 2e-6) << i;  // float ranges of some 6 m
    // From right to left: the sensor's y grows along the scan.
    EXPECT_LT(point(points, 0).y, point(points, 60).y - 3);
}

TEST(ObservationPoints, ScanTurningLeftToRightIsMirrored)
{
    CObservation2DRangeScan scan;
    scan.aperture = static_cast<float>(M_PI);
    scan.resizeScanAndAssign(3, 2.0f, true);
    scan.rightToLeft = false;
    CSimplePointsMap points;
    insert_observation_points(scan, points);
    EXPECT_LT((point(points, 0) - TPoint3D(0, 2, 0)).norm(), 1e-6);
    EXPECT_LT((point(points, 1) - TPoint3D(2, 0, 0)).norm(), 1e-6);
    EXPECT_LT((point(points, 2) - TPoint3D(0, -2, 0)).norm(), 1e-6);
}

TEST(ObservationPoints, ASingleRayPointsForward)
{
    CObservation2DRangeScan scan;
    scan.resizeScanAndAssign(1, 2.0f, true);
    CSimplePointsMap points;
    ASSERT_EQ(insert_observation_points(scan, points), 0u);
    ASSERT_EQ(points.size(), 1u);
    EXPECT_LT((point(points, 0) - TPoint3D(2, 0, 0)).norm(), 1e-9);
}

TEST(ObservationPoints, ANoddingScannerPitchesAlongTheScan)
{
    CObservation2DRangeScan scan;
    scan.aperture = 0;  // all rays forward: only the pitch differs
    scan.deltaPitch = 0.4;
    scan.resizeScanAndAssign(3, 2.0f, true);
    CSimplePointsMap points;
    insert_observation_points(scan, points);
    for (size_t i = 0; i < 3; i++)
    {
        const auto expected =
            CPose3D(0, 0, 0, 0, 0.2 * static_cast<double>(i), 0).composePoint(TPoint3D(2, 0, 0));
        EXPECT_LT((point(points, i) - expected).norm(), 1e-6) << i;
    }
}

TEST(ObservationPoints, InvalidRangesAreSkippedAndNonFiniteOnesAreCounted)
{
    auto scan = scan_of_wall(CPose3D());
    scan.setScanRangeValidity(3, false);
    scan.setScanRange(4, NaN), scan.setScanRangeValidity(4, false);  // says itself that it is nothing
    scan.setScanRange(5, 0.0f);
    scan.setScanRange(6, -1.0f);
    scan.setScanRange(7, NaN);
    scan.setScanRange(8, std::numeric_limits<float>::infinity());
    CSimplePointsMap points;
    EXPECT_EQ(insert_observation_points(scan, points), 2u);
    EXPECT_EQ(points.size(), scan.getScanSize() - 6);
    EXPECT_EQ(finite_points(points).size(), points.size());
}

TEST(ObservationPoints, PointsAreAppendedToWhatIsThere)
{
    CSimplePointsMap points;
    points.insertPoint(7, 8, 9);
    insert_observation_points(scan_of_wall(some_pose()), points);
    ASSERT_EQ(points.size(), 62u);
    EXPECT_EQ(point(points, 0), TPoint3D(7, 8, 9));  // and was not moved by the sensor's pose
}

TEST(ObservationPoints, IntensityOfAScanIsKept)
{
    auto scan = scan_of_wall(CPose3D());
    scan.setScanHasIntensity(true);
    for (size_t i = 0; i < scan.getScanSize(); i++) scan.setScanIntensity(i, static_cast<int>(100 + i));
    CPointsMapXYZI points;
    insert_observation_points(scan, points);
    for (size_t i = 0; i < points.size(); i++)
        EXPECT_EQ(points.getPointIntensity(i), static_cast<float>(100 + i));
}

TEST(ObservationPoints, InterpolationFillsTheSegmentsAndKeepsMeasuredPointsFirst)
{
    const auto scan = scan_of_wall(some_pose(), 11);
    CSimplePointsMap plain, dense;
    insert_observation_points(scan, plain);
    ObservationPointsOptions options;
    options.scan_2d_interpolate_up_to = 10.0;
    options.scan_2d_interpolation_step = 0.05;
    ASSERT_EQ(insert_observation_points(scan, dense, options), 0u);
    size_t expected = plain.size(), next = plain.size();
    for (size_t i = 0; i < plain.size(); i++) EXPECT_EQ(point(dense, i), point(plain, i)) << i;
    for (size_t i = 0; i + 1 < plain.size(); i++)
    {
        const auto a = point(plain, i), b = point(plain, i + 1);
        const auto parts = static_cast<size_t>(std::ceil((b - a).norm() / 0.05));
        expected += parts - 1;
        for (size_t k = 1; k < parts; k++, next++)
            EXPECT_LT(
                (point(dense, next) - (a + (b - a) * (static_cast<double>(k) / static_cast<double>(parts))))
                    .norm(),
                2e-6);
    }
    EXPECT_EQ(dense.size(), expected);
    EXPECT_GT(dense.size(), plain.size() + 50);
}

TEST(ObservationPoints, InterpolationBridgesNeitherInvalidRaysNorWideGaps)
{
    CObservation2DRangeScan scan;  // rays 1 degree apart at 1 m: 0.0175 m between neighbours
    scan.aperture = static_cast<float>(20 * M_PI / 180);
    scan.resizeScanAndAssign(21, 1.0f, true);
    scan.setScanRangeValidity(5, false);
    scan.setScanRange(10, NaN);
    for (size_t i = 15; i < 21; i++) scan.setScanRange(i, 1.5f);  // a step of half a metre
    ObservationPointsOptions options;
    options.scan_2d_interpolate_up_to = 0.1;
    options.scan_2d_interpolation_step = 0.01;
    CSimplePointsMap points;
    EXPECT_EQ(insert_observation_points(scan, points, options), 1u);
    // 20 segments, without 4-5, 5-6, 9-10, 10-11 and 14-15: one point in each of 10 at 1 m, two in each of 5
    // at 1.5 m (0.026 m).
    EXPECT_EQ(points.size(), 19u + 10 * 1 + 5 * 2);
    for (size_t i = 0; i < points.size(); i++)
    {
        const double range = point(points, i).norm();
        EXPECT_TRUE(std::abs(range - 1) < 1e-3 || std::abs(range - 1.5) < 1e-3) << range;
    }
}

TEST(ObservationPoints, WrongInterpolationOptionsAreRefusedByName)
{
    const auto scan = scan_of_wall(CPose3D());
    CSimplePointsMap points;
    ObservationPointsOptions options;
    options.scan_2d_interpolate_up_to = -1;
    EXPECT_THROW(insert_observation_points(scan, points, options), std::invalid_argument);
    options.scan_2d_interpolate_up_to = 1;
    options.scan_2d_interpolation_step = 0;
    try
    {
        insert_observation_points(scan, points, options);
        FAIL();
    }
    catch (const std::invalid_argument& e)
    {
        EXPECT_NE(std::string(e.what()).find("scan_2d_interpolation_step"), std::string::npos);
    }
    EXPECT_TRUE(points.empty());
}

TEST(ObservationPoints, EveryScanOfARealRawlogGivesItsValidRays)
{
    const auto path = mp2p_icp_test::mrpt_dataset("2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog");
    MP2P_ICP_SKIP_WITHOUT(path);
    mrpt::obs::CRawlog log;
    ASSERT_TRUE(log.loadFromRawLogFile(path));
    size_t scans = 0;
    for (size_t i = 0; i < log.size(); i++)
    {
        const auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(log.getAsGeneric(i));
        if (!frame) continue;
        for (const auto& observation : *frame)
        {
            const auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(observation);
            if (!scan) continue;
            CSimplePointsMap points;
            ASSERT_EQ(insert_observation_points(*scan, points), 0u);
            size_t ray = 0;
            for (size_t k = 0; k < points.size(); k++, ray++)
            {
                while (!scan->getScanRangeValidity(ray)) ray++;
                const auto from_sensor = scan->sensorPose.inverseComposePoint(point(points, k));
                ASSERT_NEAR(from_sensor.norm(), scan->getScanRange(ray), 1e-5);
                ASSERT_NEAR(std::atan2(from_sensor.y, from_sensor.x), scan->getScanAngle(ray), 1e-5);
            }
            scans++;
        }
    }
    EXPECT_GT(scans, 200u);
}

// ---- Point clouds -----------------------------------------------------------------------------------------

namespace
{
mrpt::obs::CObservationPointCloud intensity_cloud()
{
    mrpt::obs::CObservationPointCloud o;
    const auto cloud = CPointsMapXYZI::Create();
    for (int i = 0; i < 200; i++)
    {
        cloud->insertPoint(0.1f * static_cast<float>(i), 2.0f - static_cast<float>(i % 7),
                           static_cast<float>(i % 3));
        cloud->setPointIntensity(static_cast<size_t>(i), static_cast<float>(i) / 200.0f);
    }
    o.pointcloud = cloud;
    return o;
}
}  // namespace

TEST(ObservationPoints, PointCloudGetsItsSensorPoseOnceAndKeepsIntensity)
{
    auto o = intensity_cloud();
    expect_pose_applied_once(o);
    o.sensorPose = some_pose();
    CPointsMapXYZI points;
    insert_observation_points(o, points);
    for (size_t i = 0; i < points.size(); i++)
        EXPECT_EQ(points.getPointIntensity(i), static_cast<float>(i) / 200.0f);
    EXPECT_EQ(point(*o.pointcloud, 10), TPoint3D(1.0, -1.0, 1.0)) << "the observation itself must not move";
}

TEST(ObservationPoints, PointCloudDropsAndCountsPointsThatAreNotFinite)
{
    auto o = intensity_cloud();
    o.sensorPose = some_pose();
    o.pointcloud->setPointFast(3, NaN, 0, 0);
    o.pointcloud->setPointFast(9, 0, 0, -std::numeric_limits<float>::infinity());
    CSimplePointsMap points;
    EXPECT_EQ(insert_observation_points(o, points), 2u);
    EXPECT_EQ(points.size(), 198u);
    EXPECT_EQ(finite_points(points).size(), 198u);
}

TEST(ObservationPoints, ASensorPoseThatIsNotFiniteLeavesNoPoint)
{
    auto o = intensity_cloud();
    o.sensorPose = CPose3D(std::nan(""), 0, 0, 0, 0, 0);
    CSimplePointsMap points;
    EXPECT_EQ(insert_observation_points(o, points), 200u);
    EXPECT_TRUE(points.empty());
}

TEST(ObservationPoints, AnEmptyPointCloudIsNoPointsAndNoError)
{
    mrpt::obs::CObservationPointCloud o;
    CSimplePointsMap points;
    EXPECT_FALSE(has_points(o));
    EXPECT_EQ(insert_observation_points(o, points), 0u);
    o.pointcloud = CSimplePointsMap::Create();
    EXPECT_EQ(insert_observation_points(o, points), 0u);
    EXPECT_TRUE(points.empty());
}

TEST(ObservationPoints, ExternallyStoredCloudIsReadAndTheObservationStaysUnloaded)
{
    const auto file = mp2p_icp_test::temp_path(".bin");
    {
        std::ofstream out(file, std::ios::binary);
        const float values[] = {1, 2, 3, 0.25f, 4, 5, 6, 0.75f};
        out.write(reinterpret_cast<const char*>(values), sizeof(values));
    }
    mrpt::obs::CObservationPointCloud o;
    o.sensorPose = CPose3D(10, 0, 0, M_PI / 2, 0, 0);
    o.setAsExternalStorage(file, mrpt::obs::CObservationPointCloud::ExternalStorageFormat::KittiBinFile);
    EXPECT_TRUE(has_points(o));
    CPointsMapXYZI points;
    ASSERT_EQ(insert_observation_points(o, points), 0u);
    ASSERT_EQ(points.size(), 2u);
    EXPECT_LT((point(points, 0) - TPoint3D(8, 1, 3)).norm(), 1e-5);
    EXPECT_LT((point(points, 1) - TPoint3D(5, 4, 6)).norm(), 1e-5);
    EXPECT_EQ(points.getPointIntensity(1), 0.75f);
    EXPECT_FALSE(o.pointcloud);
    std::filesystem::remove(file);
    try
    {
        insert_observation_points(o, points);
        FAIL() << "the file is gone";
    }
    catch (const DataError& e)
    {
        EXPECT_NE(std::string(e.what()).find("CObservationPointCloud"), std::string::npos) << e.what();
    }
}

// ---- RGB-D ------------------------------------------------------------------------------------------------

namespace
{
/// A depth image of 8 x 6 pixels, whose pixel (row, column) is at 1 + 0.1*column + 0.01*row metres.
mrpt::obs::CObservation3DRangeScan depth_image(bool range_is_depth)
{
    mrpt::obs::CObservation3DRangeScan o;
    o.hasRangeImage = true;
    o.range_is_depth = range_is_depth;
    o.rangeImage_setSize(6, 8);
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 8; c++) o.rangeImage(r, c) = static_cast<uint16_t>(1000 + 100 * c + 10 * r);
    o.cameraParams.ncols = 8, o.cameraParams.nrows = 6;
    o.cameraParams.setIntrinsicParamsFromValues(10, 12, 3.5, 2.5);
    o.cameraParamsIntensity = o.cameraParams;
    return o;
}
}  // namespace

TEST(ObservationPoints, DepthImageIsUnprojectedAndMoved)
{
    for (const bool range_is_depth : {true, false})
    {
        auto o = depth_image(range_is_depth);
        o.rangeImage(2, 3) = 0;  // no return
        o.sensorPose = some_pose();
        CSimplePointsMap points;
        ASSERT_EQ(insert_observation_points(o, points), 0u);
        ASSERT_EQ(points.size(), 47u);
        size_t i = 0;
        for (int r = 0; r < 6; r++)
            for (int c = 0; c < 8; c++)
            {
                if (r == 2 && c == 3) continue;
                const TPoint3D ray(1, (3.5 - c) / 10, (2.5 - r) / 12);
                const double range = 1 + 0.1 * c + 0.01 * r;
                const TPoint3D in_sensor = ray * (range_is_depth ? range : range / ray.norm());
                EXPECT_LT((some_pose().composePoint(in_sensor) - point(points, i++)).norm(), 2e-6)
                    << r << " " << c;
            }
        EXPECT_TRUE(o.points3D_idxs_x.empty()) << "the observation must not be changed";
    }
}

TEST(ObservationPoints, ColoursOfAnRgbdImageAreKept)
{
    auto o = depth_image(true);
    o.hasIntensityImage = true;
    o.intensityImage.resize(8, 6, mrpt::img::CH_RGB);
    o.intensityImage.filledRectangle(0, 0, 7, 5, mrpt::img::TColor(255, 51, 0));
    mrpt::maps::CColouredPointsMap coloured;
    ASSERT_EQ(insert_observation_points(o, coloured), 0u);
    ASSERT_EQ(coloured.size(), 48u);
    float r = 0, g = 0, b = 0;
    coloured.getPointColor(20, r, g, b);
    EXPECT_NEAR(r, 1.0f, 1e-6f);
    EXPECT_NEAR(g, 0.2f, 1e-6f);
    EXPECT_NEAR(b, 0.0f, 1e-6f);
    CPointsMapXYZI grey;
    insert_observation_points(o, grey);
    EXPECT_NEAR(grey.getPointIntensity(20), 0.299f + 0.587f * 0.2f, 1e-5f);
}

TEST(ObservationPoints, AColourImageOfAnotherSizeIsNotReadOutside)
{
    auto o = depth_image(true);
    o.hasIntensityImage = true;
    o.intensityImage.resize(2, 2, mrpt::img::CH_RGB);
    mrpt::maps::CColouredPointsMap points;
    EXPECT_EQ(insert_observation_points(o, points), 0u);
    EXPECT_EQ(points.size(), 48u);
}

TEST(ObservationPoints, StoredPointsAreUsedWhereThereIsNoRangeImage)
{
    mrpt::obs::CObservation3DRangeScan o;
    EXPECT_FALSE(has_points(o));
    o.hasPoints3D = true;
    o.points3D_x = {1, 0, 3};
    o.points3D_y = {0, 0, 1};
    o.points3D_z = {0, 0, 2};  // the second stands for "no point"
    o.sensorPose = CPose3D(0, 0, 1, 0, 0, 0);
    EXPECT_TRUE(has_points(o));
    CSimplePointsMap points;
    ASSERT_EQ(insert_observation_points(o, points), 0u);
    ASSERT_EQ(points.size(), 2u);
    EXPECT_EQ(point(points, 0), TPoint3D(1, 0, 1));
    EXPECT_EQ(point(points, 1), TPoint3D(3, 1, 3));
    o.points3D_z.pop_back();
    EXPECT_THROW(insert_observation_points(o, points), DataError);
}

TEST(ObservationPoints, RealRgbdFrameGivesAPointPerMeasuredPixel)
{
    const auto path = mp2p_icp_test::mrpt_dataset("tests_rgbd.rawlog");
    MP2P_ICP_SKIP_WITHOUT(path);
    const auto o = first_of_rawlog<mrpt::obs::CObservation3DRangeScan>(path);
    ASSERT_TRUE(o);
    EXPECT_TRUE(has_points(*o));
    size_t measured = 0;
    for (int r = 0; r < o->rangeImage.rows(); r++)
        for (int c = 0; c < o->rangeImage.cols(); c++) measured += o->rangeImage(r, c) != 0;
    CSimplePointsMap points;
    ASSERT_EQ(insert_observation_points(*o, points), 0u);
    EXPECT_EQ(points.size(), measured);
    expect_pose_applied_once(*o);
}

// ---- Velodyne and rotating scans --------------------------------------------------------------------------

TEST(ObservationPoints, RealVelodyneScanGetsItsSensorPoseOnceFromPacketsOrCloud)
{
    const auto path = mp2p_icp_test::mrpt_dataset("test_velodyne_VLP16.rawlog");
    MP2P_ICP_SKIP_WITHOUT(path);
    const auto o = first_of_rawlog<mrpt::obs::CObservationVelodyneScan>(path);
    ASSERT_TRUE(o);
    EXPECT_TRUE(has_points(*o));
    expect_pose_applied_once(*o);

    CPointsMapXYZI from_packets, from_cloud;
    ASSERT_EQ(insert_observation_points(*o, from_packets), 0u);
    EXPECT_EQ(o->point_cloud.size(), 0u) << "the observation must not be changed";
    o->generatePointCloud();
    ASSERT_EQ(insert_observation_points(*o, from_cloud), 0u);
    ASSERT_EQ(from_packets.size(), 11305u);
    ASSERT_EQ(from_cloud.size(), 11305u);
    for (size_t i = 0; i < from_cloud.size(); i++)
    {
        ASSERT_EQ(point(from_packets, i), point(from_cloud, i));
        ASSERT_EQ(from_packets.getPointIntensity(i),
                  static_cast<float>(o->point_cloud.intensity[i]) / 255.0f);
    }
}

TEST(ObservationPoints, DamagedVelodynePacketsAreAnErrorOrNoPointsButNeverACrash)
{
    mrpt::obs::CObservationVelodyneScan o;
    o.scan_packets.resize(3);
    o.calibration.laser_corrections.resize(5);  // no such sensor
    SeededRandom random(1);
    for (int round = 0; round < 50; round++)
    {
        auto* bytes = reinterpret_cast<uint8_t*>(o.scan_packets.data());
        for (size_t i = 0; i < o.scan_packets.size() * sizeof(o.scan_packets[0]); i++)
            bytes[i] = static_cast<uint8_t>(random());
        const uint16_t header = 0xeeff;  // some blocks look right
        std::memcpy(bytes, &header, sizeof(header));
        CSimplePointsMap points;
        try
        {
            insert_observation_points(o, points);
        }
        catch (const DataError& e)
        {
            EXPECT_NE(std::string(e.what()).find("CObservationVelodyneScan"), std::string::npos);
        }
    }
}

TEST(ObservationPoints, RotatingScanMadeFromAVelodyneScanGivesTheSamePoints)
{
    const auto rotating_path = mp2p_icp_test::mrpt_dataset("rot_scan_velodyne.rawlog");
    const auto path = mp2p_icp_test::mrpt_dataset("test_velodyne_VLP16.rawlog");
    MP2P_ICP_SKIP_WITHOUT(rotating_path);
    MP2P_ICP_SKIP_WITHOUT(path);
    const auto velodyne = first_of_rawlog<mrpt::obs::CObservationVelodyneScan>(path);
    const auto rotating =
        first_of_rawlog<mrpt::obs::CObservationRotatingScan>(rotating_path);  // made from the former
    ASSERT_TRUE(velodyne && rotating);
    EXPECT_TRUE(has_points(*rotating));
    expect_pose_applied_once(*rotating);

    velodyne->sensorPose = rotating->sensorPose = CPose3D();
    CPointsMapXYZI truth, points;
    ASSERT_EQ(insert_observation_points(*velodyne, truth), 0u);
    ASSERT_EQ(insert_observation_points(*rotating, points), 0u);
    ASSERT_EQ(points.size(), truth.size());
    for (size_t i = 0; i < points.size(); i++)  // both in the order of firing
    {
        const auto p = point(points, i), q = point(truth, i);
        // The range image has no azimuth per firing, so a constant turning rate is assumed: the error stays
        // below one firing, 0.2 degrees. (A wrong direction, span or order of rows would be wrong by far
        // more.) Ranges are rounded to 2 mm.
        ASSERT_NEAR(p.norm(), q.norm(), 0.0011) << i;
        ASSERT_LT((p - q).norm(), q.norm() * 0.2 * M_PI / 180 + 0.0011) << i;
        ASSERT_EQ(points.getPointIntensity(i), truth.getPointIntensity(i));
    }
}

TEST(ObservationPoints, RotatingScanMadeFromA2dScanGivesTheSamePoints)
{
    for (const bool right_to_left : {true, false})
    {
        auto scan = scan_of_wall(some_pose());
        scan.rightToLeft = right_to_left;
        mrpt::obs::CObservationRotatingScan rotating;
        rotating.fromScan2D(scan);
        CSimplePointsMap from_scan, from_rotating;
        insert_observation_points(scan, from_scan);
        ASSERT_EQ(insert_observation_points(rotating, from_rotating), 0u);
        ASSERT_EQ(from_rotating.size(), from_scan.size());
        for (size_t i = 0; i < from_scan.size(); i++)  // its ranges are rounded to a resolution
            EXPECT_LT((point(from_scan, i) - point(from_rotating, i)).norm(), rotating.rangeResolution) << i;
    }
}

TEST(ObservationPoints, RotatingScanOfAnUnknownSensorHasNoPoints)
{
    mrpt::obs::CObservationRotatingScan o;
    o.lidarModel = "some sensor";
    o.rangeImage.setSize(4, 10);
    o.rangeImage.fill(100);
    o.rangeResolution = 0.01;
    CSimplePointsMap points;
    EXPECT_FALSE(has_points(o));
    EXPECT_FALSE(insert_observation_points(o, points).has_value());
    EXPECT_TRUE(points.empty());
}

TEST(ObservationPoints, OtherKindsOfObservationHaveNoPoints)
{
    const mrpt::obs::CObservationOdometry o;
    CSimplePointsMap points;
    EXPECT_FALSE(has_points(o));
    EXPECT_FALSE(insert_observation_points(o, points).has_value());
}
