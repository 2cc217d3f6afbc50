#include <mp2p_icp/observation_points.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/se3.h>

#include "sensor_clouds.h"

namespace mp2p_icp
{
using mrpt::maps::CPointsMap;

bool has_points(const mrpt::obs::CObservation& observation)
{
    using namespace mrpt::obs;
    if (const auto* scan = dynamic_cast<const CObservation2DRangeScan*>(&observation))
        return scan->getScanSize() > 0;
    if (const auto* image = dynamic_cast<const CObservation3DRangeScan*>(&observation))
        return image->hasRangeImage || image->hasPoints3D;
    if (const auto* scan = dynamic_cast<const CObservationVelodyneScan*>(&observation))
        return !scan->scan_packets.empty() || scan->point_cloud.size() > 0;
    if (const auto* scan = dynamic_cast<const CObservationRotatingScan*>(&observation))
        return has_known_rays(*scan);
    if (const auto* cloud = dynamic_cast<const CObservationPointCloud*>(&observation))
        return cloud->pointcloud ? !cloud->pointcloud->empty() : cloud->isExternallyStored();
    return false;
}

namespace
{
/// Null for a kind of observation without points.
CPointsMap::ConstPtr any_sensor_cloud(const mrpt::obs::CObservation& observation,
                                      const ObservationPointsOptions& options)
{
    using namespace mrpt::obs;
    if (const auto* scan = dynamic_cast<const CObservation2DRangeScan*>(&observation))
        return sensor_cloud(*scan, options);
    if (const auto* image = dynamic_cast<const CObservation3DRangeScan*>(&observation))
        return sensor_cloud(*image);
    if (const auto* scan = dynamic_cast<const CObservationVelodyneScan*>(&observation))
        return sensor_cloud(*scan);
    if (const auto* scan = dynamic_cast<const CObservationRotatingScan*>(&observation))
        return has_known_rays(*scan) ? sensor_cloud(*scan) : nullptr;
    if (const auto* cloud = dynamic_cast<const CObservationPointCloud*>(&observation))
        return sensor_cloud(*cloud);
    return nullptr;
}
}  // namespace

std::optional<uint64_t> insert_observation_points(const mrpt::obs::CObservation& observation,
                                                  CPointsMap& points, const ObservationPointsOptions& options)
{
    const auto cloud = any_sensor_cloud(observation, options);
    if (!cloud) return {};
    const mrpt::poses::CPose3D T_robot_sensor(observation.sensorPose());
    if (!is_finite(T_robot_sensor)) return cloud->size();  // then none of its points is
    const std::vector<size_t> finite = finite_points(*cloud);
    const size_t first = points.size();
    append_points(points, *cloud, finite);
    move_points(points, first, T_robot_sensor);
    return cloud->size() - finite.size();
}

}  // namespace mp2p_icp
