#pragma once

#include <mp2p_icp/metricmap.h>
#include <mrpt/serialization/CArchive.h>

namespace mp2p_icp
{
/// Does any line or plane come with a fit?
bool has_fits(const metric_map_t& map);

/** The fits of all lines and planes of a map, whose number the reader knows: u8 version (0); for each line
 * and then for each plane u8 present, and if so its numbers in the order of the members (u64 inliers, else
 * doubles; of the covariance the upper triangle, row by row).
 */
void write_fits(const metric_map_t& map, mrpt::serialization::CArchive& out);
/// Into the lines and planes that were read before. \exception DataError on another version, or numbers that
/// no fit gives.
void read_fits(mrpt::serialization::CArchive& in, metric_map_t& map);

}  // namespace mp2p_icp
