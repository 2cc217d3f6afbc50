#include <mp2p_icp/errors.h>
#include <mrpt/maps/CColouredPointsMap.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include "sensor_clouds.h"

namespace mp2p_icp
{
using mrpt::maps::CPointsMap;

namespace
{
std::string name_of(const mrpt::obs::CObservation& o)
{
    return std::string(o.GetRuntimeClass()->className) + " '" + o.sensorLabel + "'";
}

/// MRPT reads files and calibrations lazily, and says what is wrong with them by throwing.
template <class Work>
CPointsMap::ConstPtr with_data_errors(const mrpt::obs::CObservation& o, const Work& work)
{
    try
    {
        return work();
    }
    catch (const std::exception& e)
    {
        throw DataError(name_of(o), short_reason(e));
    }
}

/// MRPT reads the colour of a pixel without looking at the size of the colour image, where both cameras are
/// the same one.
bool colours_can_be_read(const mrpt::obs::CObservation3DRangeScan& image)
{
    if (!image.hasIntensityImage) return false;
    return !image.doDepthAndIntensityCamerasCoincide() ||
           (image.intensityImage.getWidth() == static_cast<size_t>(image.rangeImage.cols()) &&
            image.intensityImage.getHeight() == static_cast<size_t>(image.rangeImage.rows()));
}

/// Points that were unprojected before; (0,0,0) stands for "no point".
CPointsMap::ConstPtr stored_points(const mrpt::obs::CObservation3DRangeScan& image)
{
    const auto& x = image.points3D_x;
    const auto& y = image.points3D_y;
    const auto& z = image.points3D_z;
    if (x.size() != y.size() || x.size() != z.size())
        throw std::runtime_error("its point coordinates have different lengths");
    const auto out = mrpt::maps::CSimplePointsMap::Create();
    for (size_t i = 0; i < x.size(); i++)
        if (x[i] != 0 || y[i] != 0 || z[i] != 0) out->insertPointFast(x[i], y[i], z[i]);
    return out;
}

CPointsMap::ConstPtr unprojected(const mrpt::obs::CObservation3DRangeScan& image)
{
    mrpt::obs::CObservation3DRangeScan copy =
        image;  // MRPT loads files into the object, and writes pixel indices there
    copy.load();
    if (!copy.hasRangeImage || copy.rangeImage.size() == 0) return stored_points(copy);
    if (!colours_can_be_read(copy))
    {
        const auto plain = mrpt::maps::CSimplePointsMap::Create();
        copy.unprojectInto(*plain);
        return plain;
    }
    const auto coloured = mrpt::maps::CColouredPointsMap::Create();
    copy.unprojectInto(*coloured);
    return coloured;
}

/// Takes Velodyne points as they come.
struct VelodynePoints : public mrpt::obs::CObservationVelodyneScan::PointCloudStorageWrapper
{
    mrpt::maps::CPointsMapXYZI::Ptr out = mrpt::maps::CPointsMapXYZI::Create();
    void add(float x, float y, float z, uint8_t intensity)
    {
        out->insertPointFast(x, y, z);
        out->setPointIntensity(out->size() - 1, static_cast<float>(intensity) / 255.0f);
    }
    void add_point(float x, float y, float z, uint8_t intensity, const mrpt::system::TTimeStamp&, const float,
                   uint16_t) override
    {
        add(x, y, z, intensity);
    }
};

CPointsMap::ConstPtr velodyne_points(const mrpt::obs::CObservationVelodyneScan& scan)
{
    VelodynePoints points;
    const auto& made = scan.point_cloud;  // made by the user before, perhaps with settings of his own
    if (made.size() > 0)
    {
        const bool has_intensity = made.intensity.size() == made.size();
        if (made.y.size() != made.size() || made.z.size() != made.size())
            throw std::runtime_error("its point coordinates have different lengths");
        for (size_t i = 0; i < made.size(); i++)
            points.add(made.x[i], made.y[i], made.z[i], has_intensity ? made.intensity[i] : uint8_t(255));
        return points.out;
    }
    mrpt::obs::CObservationVelodyneScan copy = scan;  // MRPT's function is not const
    mrpt::obs::CObservationVelodyneScan::TGeneratePointCloudParameters parameters;
    parameters.minDistance = 0;  // the sensor's own limits, minRange and maxRange, hold
    copy.generatePointCloud(points, parameters);
    return points.out;
}

CPointsMap::ConstPtr loaded_cloud(const mrpt::obs::CObservationPointCloud& cloud)
{
    if (cloud.pointcloud) return cloud.pointcloud;
    if (!cloud.isExternallyStored()) return mrpt::maps::CSimplePointsMap::Create();
    mrpt::obs::CObservationPointCloud copy = cloud;  // so that the observation itself stays unloaded
    copy.load();
    if (!copy.pointcloud)
        throw std::runtime_error("nothing could be loaded from '" + cloud.getExternalStorageFile() + "'");
    return copy.pointcloud;
}
}  // namespace

CPointsMap::ConstPtr sensor_cloud(const mrpt::obs::CObservation3DRangeScan& image)
{
    return with_data_errors(image, [&]() { return unprojected(image); });
}

CPointsMap::ConstPtr sensor_cloud(const mrpt::obs::CObservationVelodyneScan& scan)
{
    return with_data_errors(scan, [&]() { return velodyne_points(scan); });
}

CPointsMap::ConstPtr sensor_cloud(const mrpt::obs::CObservationPointCloud& cloud)
{
    return with_data_errors(cloud, [&]() { return loaded_cloud(cloud); });
}

}  // namespace mp2p_icp
