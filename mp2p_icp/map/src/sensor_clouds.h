#pragma once

#include <mp2p_icp/observation_points.h>
#include <mrpt/maps/CPointsMap.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservation3DRangeScan.h>
#include <mrpt/obs/CObservationPointCloud.h>
#include <mrpt/obs/CObservationRotatingScan.h>
#include <mrpt/obs/CObservationVelodyneScan.h>

namespace mp2p_icp
{
/** What a sensor saw, as a cloud in the sensor's own frame: the sensor's pose on the robot is not applied
 * here. Returns leave out rays without a return, and keep points that are not finite (for the caller to
 * count).
 */
mrpt::maps::CPointsMap::ConstPtr sensor_cloud(const mrpt::obs::CObservation2DRangeScan& scan,
                                              const ObservationPointsOptions& options);
mrpt::maps::CPointsMap::ConstPtr sensor_cloud(const mrpt::obs::CObservation3DRangeScan& image);
mrpt::maps::CPointsMap::ConstPtr sensor_cloud(const mrpt::obs::CObservationVelodyneScan& scan);
mrpt::maps::CPointsMap::ConstPtr sensor_cloud(const mrpt::obs::CObservationRotatingScan& scan);
mrpt::maps::CPointsMap::ConstPtr sensor_cloud(const mrpt::obs::CObservationPointCloud& cloud);

/// Do we know the directions of the scan's rays? (The observation holds azimuths, but no elevations.)
bool has_known_rays(const mrpt::obs::CObservationRotatingScan& scan);

}  // namespace mp2p_icp
