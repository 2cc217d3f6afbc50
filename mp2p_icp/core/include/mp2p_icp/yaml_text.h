#pragma once

#include <mp2p_icp/yaml_tools.h>

#include <string>

namespace mp2p_icp
{
/** YAML as one line of text in flow style, which yaml_from_text() reads back. Unlike MRPT's own writer it
 * keeps every digit of numbers and quotes what needs quotes. Comments are not written.
 */
std::string to_yaml_text(const yaml& content);

}  // namespace mp2p_icp
