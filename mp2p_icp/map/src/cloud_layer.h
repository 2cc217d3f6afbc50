#pragma once

#include <mp2p_icp/load_map.h>

#include "RawCloud.h"

namespace mp2p_icp
{
/// Beyond this distance of a coordinate from zero (m), float is too coarse: its steps are above 1 mm.
constexpr double FAR_AWAY = 1e4;

bool is_storable(const mrpt::math::TPoint3D& p);

/// The box around the points that can be stored; empty if there are none.
std::optional<mrpt::math::TBoundingBox> finite_box(const RawCloud& cloud);

/// Does all of the box, moved by -offset, lie within FAR_AWAY of the origin?
bool is_near(const mrpt::math::TBoundingBox& box, const mrpt::math::TPoint3D& offset);

/** The offset for a cloud: as the options say; else as the file says; else zero if the cloud is near the
 * origin, or the centre of its box, rounded. \exception std::invalid_argument if the one of the options is
 * not whole numbers.
 */
mrpt::math::TPoint3D choose_offset(const RawCloud& cloud, const LoadOptions& options);

/** Makes the map of a cloud: one layer of the class that has a place for its channels, with the offset
 * subtracted. \exception DataError if there is no finite point, or if it needs too much memory.
 */
LoadedMap to_map(RawCloud&& cloud, const std::string& source, const std::string& layer,
                 const mrpt::math::TPoint3D& offset);

}  // namespace mp2p_icp
