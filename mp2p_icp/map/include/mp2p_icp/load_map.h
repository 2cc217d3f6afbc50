#pragma once

#include <mp2p_icp/metricmap.h>
#include <mrpt/obs/CSensoryFrame.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace mp2p_icp
{
/// What was found while reading an input.
struct LoadReport
{
    std::string source;                     ///< the path, as given
    std::string kind;                       ///< what it was read as, such as `PLY (binary little endian)`
    uint64_t points_read = 0;               ///< points in the source, dropped ones included
    uint64_t points_dropped_nonfinite = 0;  ///< with a NaN or infinite coordinate
    std::vector<std::string>
        notes;  ///< what the user should know: wrong suffix, fields without a place, offset, ...
};

struct LoadedMap
{
    metric_map_t::Ptr map;
    LoadReport report;
};

struct LoadOptions
{
    std::string layer =
        metric_map_t::PT_LAYER_RAW;  ///< where the points of a plain cloud go; a .mm has its own layers

    /** Subtracted from all coordinates, in double, before they are stored in float; must be whole numbers.
     * Empty: zero if all coordinates are within 10 km of the origin, else the centre of the data, rounded.
     * Kept in the map (coordinate_offset()).
     */
    std::optional<mrpt::math::TPoint3D> coordinate_offset;
};

/** Reads a cloud or a map from a path, by its content (the suffix decides only for KITTI `.bin`, which has no
 * magic; a known kind under a wrong suffix is read as what it is, with a note):
 * `.mm`, `.ply` (ascii, binary little and big endian), `.pcd` (ascii, binary, binary_compressed), text with
 * three or more columns
 * (`.xyz .txt .csv`), KITTI `.bin`, `.obj` (vertices), any of them as `.gz`, and entry N of `file.rawlog:N`
 * or `file.simplemap:N`.
 *
 * Intensity and colour are kept where MRPT has a cloud class for them. Points that are not finite are dropped
 * and counted. \exception DataError if it cannot be read: names the file, the place, what was expected and
 * found. Never crashes on, nor needs more than 2 GB for, a damaged or hostile file. Thread-safe for different
 * paths or the same.
 */
LoadedMap load_map(const std::string& path, const LoadOptions& options = {});

/// Both inputs of an alignment, in {local, global} order, with one common coordinate offset where both are
/// far away.
std::pair<LoadedMap, LoadedMap> load_map_pair(const std::string& local_path, const std::string& global_path,
                                              const LoadOptions& options = {});

/// Is it of the form `file.rawlog:N` or `file.simplemap:N` (also `.gz`)?
bool is_observations_path(const std::string& path);

/** The observations of one entry of a rawlog or simplemap. What is stored in files beside it is looked for
 * where MRPT has been told to (mrpt::io::setLazyLoadPathBase()). \exception DataError as load_map(); also if
 * the entry holds no range data, naming the nearest entries that do.
 */
mrpt::obs::CSensoryFrame::Ptr load_observations(const std::string& path, LoadReport& report);

/** Writes a map by the suffix of the path: `.mm` (all of it), or one cloud layer as `.ply` (binary little
 * endian), `.pcd` (binary), `.xyz`/`.txt`/`.csv` (9 digits), `.bin` (KITTI; intensity 0 if the layer has
 * none). Reading it back gives the same bits. The coordinate offset is added back (in double: ply and pcd
 * then hold double coordinates). \param layer needed when the map has several cloud layers. \exception
 * std::invalid_argument for an unknown suffix or layer, DataError if the file cannot be written.
 */
void save_map(const metric_map_t& map, const std::string& path, const std::string& layer = "");

}  // namespace mp2p_icp
