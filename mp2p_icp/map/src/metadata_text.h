#pragma once

#include <mrpt/containers/yaml.h>

#include <string>

namespace mp2p_icp
{
/** Metadata as one line of YAML in flow style. Unlike MRPT's own writer it keeps every digit of numbers and
 * quotes what needs quotes. Comments are not written.
 */
std::string metadata_to_text(const mrpt::containers::yaml& metadata);

/// \exception ConfigError if it is not a YAML map.
mrpt::containers::yaml metadata_from_text(const std::string& text);

}  // namespace mp2p_icp
