#pragma once

#include <mp2p_icp/errors.h>

#include <fstream>
#include <string>

namespace mp2p_icp_apps::experiments
{
/// \exception mp2p_icp::DataError if it cannot be written
inline void write_text_file(const std::string& path, const std::string& text)
{
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw mp2p_icp::DataError(path, "cannot be written");
}

}  // namespace mp2p_icp_apps::experiments
