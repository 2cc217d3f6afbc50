#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/obs/VelodyneCalibration.h>

#include <cmath>

#include "sensor_clouds.h"

namespace mp2p_icp
{
using mrpt::maps::CPointsMap;
using mrpt::obs::CObservationRotatingScan;

namespace
{
/// The ray of row r and column c: azimuth `first + per_column*(c + row_delay*r)`, counterclockwise, and the
/// row's elevation.
struct RayModel
{
    double first_azimuth = 0, azimuth_per_column = 0;
    double row_delay = 0;           ///< columns that pass between the firings of two neighbouring rows
    std::vector<double> elevation;  ///< one per row
};

constexpr int VLP16_ROWS = 16;

bool is_vlp16(const CObservationRotatingScan& scan)
{
    return scan.rangeImage.rows() == VLP16_ROWS && scan.lidarModel.find("VLP-16") != std::string::npos;
}

bool columns_are_empty(const CObservationRotatingScan& scan, int first)
{
    for (int r = 0; r < scan.rangeImage.rows(); r++)
        for (int c = first; c < scan.rangeImage.cols(); c++)
            if (scan.rangeImage(r, c) != 0) return false;
    return true;
}

/// As documented: startAzimuth is the first column's azimuth and startAzimuth+azimuthSpan the last one's,
/// positive to the left.
RayModel documented_model(const CObservationRotatingScan& scan)
{
    const int columns = scan.rangeImage.cols();
    return {scan.startAzimuth, columns > 1 ? scan.azimuthSpan / (columns - 1) : 0.0, 0.0,
            std::vector<double>(static_cast<size_t>(scan.rangeImage.rows()), 0.0)};
}

/** As CObservationRotatingScan::fromVelodyne() makes them (found by comparing with CObservationVelodyneScan's
 * own cloud): 16 times too many columns, the last 15/16 of them empty, and azimuths as Velodyne counts them,
 * clockwise. */
bool is_from_velodyne(const CObservationRotatingScan& scan)
{
    const int columns = scan.rangeImage.cols();
    return is_vlp16(scan) && columns % VLP16_ROWS == 0 && columns_are_empty(scan, columns / VLP16_ROWS);
}

RayModel vlp16_model(const CObservationRotatingScan& scan)
{
    RayModel model = documented_model(scan);
    const auto& lasers = mrpt::obs::VelodyneCalibration::LoadDefaultCalibration("VLP16").laser_corrections;
    for (size_t r = 0; r < model.elevation.size(); r++)
        model.elevation[r] = lasers.at(r).verticalCorrection * M_PI / 180;
    model.row_delay =
        2.304 / 55.296;  // microseconds between two lasers and between two firings, from the sensor's manual
    if (is_from_velodyne(scan))
    {
        model.first_azimuth = -scan.startAzimuth;
        model.azimuth_per_column = -scan.azimuthSpan / (scan.rangeImage.cols() / VLP16_ROWS);
    }
    return model;
}
}  // namespace

bool has_known_rays(const CObservationRotatingScan& scan)
{
    return scan.rangeImage.cols() > 0 && (scan.rangeImage.rows() == 1 || is_vlp16(scan));
}

CPointsMap::ConstPtr sensor_cloud(const CObservationRotatingScan& scan)
{
    const RayModel model = is_vlp16(scan) ? vlp16_model(scan) : documented_model(scan);
    const auto& ranges = scan.rangeImage;
    const bool has_intensity =
        scan.intensityImage.rows() == ranges.rows() && scan.intensityImage.cols() == ranges.cols();
    const auto out = mrpt::maps::CPointsMapXYZI::Create();
    for (int c = 0; c < ranges.cols(); c++)
        for (int r = 0; r < ranges.rows(); r++)
        {
            if (ranges(r, c) == 0) continue;
            const double range = ranges(r, c) * scan.rangeResolution;
            const double azimuth = model.first_azimuth + model.azimuth_per_column * (c + model.row_delay * r);
            const double elevation = model.elevation[static_cast<size_t>(r)];
            const double level = range * std::cos(elevation);
            out->insertPointFast(static_cast<float>(level * std::cos(azimuth)),
                                 static_cast<float>(level * std::sin(azimuth)),
                                 static_cast<float>(range * std::sin(elevation)));
            out->setPointIntensity(out->size() - 1,
                                   has_intensity ? scan.intensityImage(r, c) / 255.0f : 1.0f);
        }
    return out;
}

}  // namespace mp2p_icp
