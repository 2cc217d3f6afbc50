#pragma once

#include <string>
#include <string_view>

namespace mp2p_icp
{
/// What is held in memory while one input is read: file, decompressed bytes, points. A larger input is
/// refused.
constexpr uint64_t READ_MEMORY_BUDGET_BYTES = 1'800'000'000;
/// The largest file, and the largest content of a compressed one.
constexpr uint64_t READ_CONTENT_CAP_BYTES = uint64_t(1) << 30;

/// All bytes of a file. \exception DataError if it is missing, a directory, empty, unreadable or above the
/// cap.
std::string read_whole_file(const std::string& path);

/// Creates or replaces a file. \exception DataError if not all bytes can be written.
void write_whole_file(const std::string& path, std::string_view bytes);

/// The path's last suffix in lower case with its dot, not counting a trailing `.gz`; empty if there is none.
std::string suffix_of(const std::string& path);
bool has_gz_suffix(const std::string& path);

}  // namespace mp2p_icp
