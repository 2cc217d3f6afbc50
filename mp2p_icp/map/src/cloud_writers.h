#pragma once

#include <mrpt/maps/CPointsMap.h>
#include <mrpt/math/TPoint3D.h>

#include <string>

/** \file cloud_writers.h
 * One writer per file format, from a cloud to the bytes of the file. `offset` is added to the coordinates, in
 * double.
 */
namespace mp2p_icp
{
/// Binary little endian; coordinates are float, or double if there is an offset.
std::string write_ply(const mrpt::maps::CPointsMap& points, const mrpt::math::TPoint3D& offset);

/// Binary; coordinates are float, or double if there is an offset.
std::string write_pcd(const mrpt::maps::CPointsMap& points, const mrpt::math::TPoint3D& offset);

/// Rows of numbers, with 9 significant digits, or 17 if there is an offset. \param header a line of column
/// names comes first
std::string write_text_points(const mrpt::maps::CPointsMap& points, const mrpt::math::TPoint3D& offset,
                              char separator, bool header);

/// x y z intensity as floats; there is no place for an offset.
std::string write_kitti(const mrpt::maps::CPointsMap& points);

}  // namespace mp2p_icp
