#pragma once

#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp_filters/FilterLines.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CRawlog.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace mp2p_icp_test
{
/// A scan of a rawlog, with the odometry when it was taken.
struct LaserScan
{
    mrpt::obs::CObservation2DRangeScan::Ptr scan;
    mrpt::poses::CPose3D odometry;
};

/// All scans of a 2-D laser in a rawlog of either kind: actions and frames in turn, or a row of observations.
inline std::vector<LaserScan> laser_scans(const std::string& path)
{
    using namespace mrpt::obs;
    CRawlog rawlog;
    if (!rawlog.loadFromRawLogFile(path)) throw std::runtime_error("cannot read " + path);
    std::vector<LaserScan> scans;
    mrpt::poses::CPose3D now;
    for (const auto& entry : rawlog)
    {
        if (const auto actions = std::dynamic_pointer_cast<CActionCollection>(entry))
            if (const auto move = actions->getBestMovementEstimation())
                now = now + mrpt::poses::CPose3D(move->poseChange->getMeanVal());
        if (const auto odometry = std::dynamic_pointer_cast<CObservationOdometry>(entry))
            now = mrpt::poses::CPose3D(odometry->odometry);
        auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(entry);
        if (const auto frame = std::dynamic_pointer_cast<CSensoryFrame>(entry))
            scan = frame->getObservationByClass<CObservation2DRangeScan>();
        if (scan) scans.push_back({scan, now});
    }
    return scans;
}

/// The layers and lines that a pipeline makes of a scan. Its FilterLines is told where the laser is.
inline mp2p_icp::metric_map_t map_of_scan(const mp2p_icp::Pipeline& pipeline,
                                          const mrpt::obs::CObservation2DRangeScan& scan)
{
    mp2p_icp::metric_map_t map;
    const auto& own = pipeline.generators;
    mp2p_icp_filters::apply_generators(own ? *own : mp2p_icp_filters::generators_from_yaml({}), scan, map);
    const auto filters = pipeline.filters.find("filters");
    if (filters == pipeline.filters.end()) return map;
    for (const auto& filter : filters->second)
        if (const auto lines = std::dynamic_pointer_cast<mp2p_icp_filters::FilterLines>(filter))
            lines->sensor_position = {scan.sensorPose.x(), scan.sensorPose.y(), scan.sensorPose.z()};
    mp2p_icp_filters::apply_filter_pipeline(filters->second, map);
    return map;
}

/// The motion is planar: z, pitch and roll stay as they are; nothing is said of x, y and yaw.
inline mrpt::poses::CPose3DPDFGaussianInf planar_prior(const mrpt::poses::CPose3D& guess)
{
    mrpt::poses::CPose3DPDFGaussianInf prior(guess);
    for (const int i : {2, 4, 5}) prior.cov_inv(i, i) = 1e6;
    return prior;
}

/// Are two poses nearer than so many metres and degrees?
inline bool agree(const mrpt::poses::CPose3D& a, const mrpt::poses::CPose3D& b, double metres, double degrees)
{
    return (mp2p_icp::translation_of(a) - mp2p_icp::translation_of(b)).norm() < metres &&
           mp2p_icp::rotation_angle(mp2p_icp::rotation_of(a - b)) < mrpt::DEG2RAD(degrees);
}

/// Does the information on x, y and yaw, in the plane, leave less than a third of 5 cm and 1 degree? (A
/// verdict is about all six coordinates: walls seen by a level laser say nothing of z, pitch and roll.)
inline bool determines_plane(const mp2p_icp::Results& r)
{
    if (r.verdict != mp2p_icp::Verdict::aligned && r.verdict != mp2p_icp::Verdict::under_constrained)
        return false;
    const std::vector<int> planar = {0, 1, 3};
    const Eigen::Matrix3d information = r.information.asEigen()(planar, planar);
    const Eigen::Vector3d unit(0.05 / 3, 0.05 / 3, mrpt::DEG2RAD(1.0) / 3);
    const Eigen::Matrix3d scaled = unit.asDiagonal() * information * unit.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scaled, Eigen::EigenvaluesOnly).eigenvalues()(0) >
           1;
}
}  // namespace mp2p_icp_test
