#pragma once

#include <mrpt/math/TPose3D.h>

#include <string>

namespace mp2p_icp_apps
{
/** A pose from "[x y z yaw_deg pitch_deg roll_deg]", in m and degrees; commas and missing brackets are
 * accepted. \exception std::invalid_argument for anything else, and for numbers that are not finite.
 */
mrpt::math::TPose3D pose_from_text(const std::string& text);

/** A pose from a text file with a 4x4 matrix, row by row (brackets, commas and semicolons are skipped). Its
 * rotation may be rounded: the nearest true one is taken. \exception mp2p_icp::DataError if it is not that:
 * not 16 numbers, last row not 0 0 0 1, or no rotation within 1e-3.
 */
mrpt::math::TPose3D pose_from_matrix_file(const std::string& file_name);

/// pose_from_matrix_file() if there is such a file, else pose_from_text(). \exception as they do, naming the
/// option
mrpt::math::TPose3D pose_from_argument(const std::string& option, const std::string& argument);

/** The angle in degrees, as the shortest number that CPose3D turns into exactly these radians (it wraps
 * angles to
 * (-pi, pi], which costs the last bits); where there is none, the nearest. So a pose that was typed in
 * degrees is written as it was typed, and reading it back gives the same bits.
 */
double degrees_of(double radians);

}  // namespace mp2p_icp_apps
