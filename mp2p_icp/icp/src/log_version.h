#pragma once

#include <cstdint>

namespace mp2p_icp
{
/// Of the serialized LogRecord, 128 and above being this library's; the original's logs have 0 and 1,
/// and may come to have some more.
constexpr uint8_t LOG_VERSION = 129, FIRST_LOG_VERSION = 128;
}  // namespace mp2p_icp
