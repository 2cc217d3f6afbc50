#pragma once

#include <string>
#include <string_view>

namespace mp2p_icp
{
/// What a file's content is, whatever it is called.
enum class ContentKind
{
    Ply,
    Pcd,
    Obj,
    Text,
    Kitti,
    MetricMap,  ///< MRPT archive of a metric_map_t
    SimpleMap,  ///< MRPT archive of a CSimpleMap
    Rawlog      ///< MRPT archive of observations, actions and sensory frames
};

/** Recognizes content (not compressed). Only KITTI `.bin` has nothing to be recognized by: binary content of
 * no known kind in a file with the suffix `.bin` is taken for it. \exception DataError if the kind is
 * unknown, or known and not supported.
 */
ContentKind detect_kind(const std::string& path, std::string_view content);

/// The class of the first object, if the content is an MRPT archive; else empty.
std::string archive_class(std::string_view content);

/// Empty if the path's suffix is usual for this kind, else a note such as `named .pcd, but it is PLY
/// (ascii)`.
std::string suffix_note(const std::string& path, ContentKind kind, const std::string& kind_name);

}  // namespace mp2p_icp
