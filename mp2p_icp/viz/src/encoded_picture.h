#pragma once

#include <mrpt/img/CImage.h>

#include <string>

namespace mp2p_icp
{
/// The bytes of the picture as a PNG file. \exception std::invalid_argument for an empty picture.
/// \exception std::runtime_error if it cannot be encoded.
std::string encoded_png(const mrpt::img::CImage& image);

}  // namespace mp2p_icp
