#pragma once

#include <mp2p_icp/log_scene.h>

#include "cloud_object.h"
#include "scene_frame.h"

namespace mp2p_icp
{
/// All points of the map, planes' centroids and lines' base points (with a few points of what is seen of
/// them): what a view should show. Only finite ones; in the map's coordinates, shifted.
PointSet extent_points(const metric_map_t& map, const mrpt::math::TPoint3D& shift = {0, 0, 0});

/** One object per part of a map, named as the part, relative to `frame` (given in the map's stored
 * coordinates). What is not finite is left out. \param uploads is counted up when a cloud is sent to the
 * graphics card.
 */
mrpt::opengl::CSetOfObjects::Ptr map_objects(const metric_map_t& map, const SceneFrame& frame,
                                             const std::shared_ptr<size_t>& uploads);

/// Colours, sizes and visibility of what map_objects() made; touches only what has changed.
void style_map_objects(mrpt::opengl::CSetOfObjects& objects, const MapStyle& style);

}  // namespace mp2p_icp
