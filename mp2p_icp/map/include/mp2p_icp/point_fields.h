#pragma once

#include <mrpt/maps/CPointsMap.h>
#include <mrpt/poses/CPose3D.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
/** \file point_fields.h
 * Copies of points with everything that belongs to them (intensity, colour, weight, or what a user's own
 * cloud class adds). All functions are thread-safe as long as nobody else uses the cloud that is written.
 */

/** An empty cloud of the MRPT class of that name. \exception std::invalid_argument if no such class is
 * registered (naming the nearest known cloud class), or if it is not a cloud.
 */
mrpt::maps::CPointsMap::Ptr new_cloud(const std::string& class_name);

/// An empty cloud of the same class, with the same insertion, likelihood and render options.
mrpt::maps::CPointsMap::Ptr new_cloud_like(const mrpt::maps::CPointsMap& other);

/** Appends the points `indices` of `from` to `to`, in that order. Between clouds of the same class every
 * field is copied. Between different classes the coordinates are; colours become an intensity (their
 * luminance, 0..1); any other field gets the default of the class of `to`. O(number of indices).
 */
void append_points(mrpt::maps::CPointsMap& to, const mrpt::maps::CPointsMap& from,
                   const std::vector<size_t>& indices);

/// Moves the points first, first+1, ... of the cloud: p becomes `pose (+) p`, computed in double and stored
/// in float.
void move_points(mrpt::maps::CPointsMap& points, size_t first, const mrpt::poses::CPose3D& pose);

/// Are all three coordinates finite?
bool is_finite_point(const mrpt::maps::CPointsMap& points, size_t index);

/// The indices, in increasing order, of the points with three finite coordinates.
std::vector<size_t> finite_points(const mrpt::maps::CPointsMap& points);

}  // namespace mp2p_icp
