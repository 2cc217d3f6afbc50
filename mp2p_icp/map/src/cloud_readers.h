#pragma once

#include <string>
#include <string_view>

#include "RawCloud.h"

/** \file cloud_readers.h
 * One small reader per file format, from bytes in memory to a RawCloud. `source` is only for messages. Each
 * of them throws DataError with the line or byte, what was expected and found, and reserves memory only for
 * points that the bytes can hold.
 */
namespace mp2p_icp
{
RawCloud read_ply(const std::string& source, std::string_view bytes);
RawCloud read_pcd(const std::string& source, std::string_view bytes);

/** Rows of three or more numbers: x y z; x y z intensity; x y z r g b; with other counts the rest is left
 * out. A line of column names, plain or in the last comment (`#` or `//`) before the data, says otherwise.
 */
RawCloud read_text_points(const std::string& source, std::string_view bytes);

/// KITTI: records of four floats, x y z intensity.
RawCloud read_kitti(const std::string& source, std::string_view bytes);

/// The vertices of a Wavefront file, with their colours if they have some.
RawCloud read_obj(const std::string& source, std::string_view bytes);

}  // namespace mp2p_icp
