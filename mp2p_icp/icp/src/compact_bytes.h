#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>

/// \file compact_bytes.h Numbers as bytes of a string, and back.
namespace mp2p_icp
{
template <class T>
void append(std::string& bytes, const T& value)
{
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// 7 bits a byte, the lowest first; zigzag, so that it is small for both signs.
inline void append_difference(std::string& bytes, uint32_t from, uint32_t to)
{
    const auto difference = static_cast<int64_t>(to) - static_cast<int64_t>(from);
    auto left = (static_cast<uint64_t>(difference) << 1) ^ static_cast<uint64_t>(difference >> 63);
    for (; left >= 0x80; left >>= 7) bytes += static_cast<char>(0x80 | (left & 0x7f));
    bytes += static_cast<char>(left);
}

[[noreturn]] inline void pairings_are_damaged(const std::string& what)
{
    throw std::runtime_error("the pairings of an iteration are damaged: " + what);
}

template <class T>
T take(std::string_view& bytes)
{
    if (bytes.size() < sizeof(T)) pairings_are_damaged("a run ends too early");
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    bytes.remove_prefix(sizeof(T));
    return value;
}

inline uint32_t take_difference(std::string_view& bytes, uint32_t from)
{
    uint64_t zigzag = 0;
    for (int shift = 0;; shift += 7)
    {
        if (shift > 35) pairings_are_damaged("a number is too long");
        const auto byte = take<uint8_t>(bytes);
        zigzag |= static_cast<uint64_t>(byte & 0x7f) << shift;
        if (byte < 0x80) break;
    }
    return static_cast<uint32_t>(from + ((zigzag >> 1) ^ (~(zigzag & 1) + 1)));
}

}  // namespace mp2p_icp
