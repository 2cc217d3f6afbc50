#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace mp2p_icp
{
/// The types of numbers in binary PLY and PCD files.
enum class ScalarType
{
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64
};

inline size_t size_of(ScalarType t)
{
    constexpr size_t sizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return sizes[static_cast<size_t>(t)];
}

inline bool is_integer(ScalarType t)
{
    return t != ScalarType::F32 && t != ScalarType::F64;
}

/// A number of type T at any address. \param swap the bytes stand in the order that is not this machine's
template <class T>
T load_as(const char* p, bool swap)
{
    char bytes[sizeof(T)];
    std::memcpy(bytes, p, sizeof(T));
    if (swap) std::reverse(bytes, bytes + sizeof(T));
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return value;
}

inline double load_scalar(ScalarType t, const char* p, bool swap)
{
    switch (t)
    {
        case ScalarType::I8:
            return load_as<int8_t>(p, swap);
        case ScalarType::U8:
            return load_as<uint8_t>(p, swap);
        case ScalarType::I16:
            return load_as<int16_t>(p, swap);
        case ScalarType::U16:
            return load_as<uint16_t>(p, swap);
        case ScalarType::I32:
            return load_as<int32_t>(p, swap);
        case ScalarType::U32:
            return load_as<uint32_t>(p, swap);
        case ScalarType::I64:
            return static_cast<double>(load_as<int64_t>(p, swap));
        case ScalarType::U64:
            return static_cast<double>(load_as<uint64_t>(p, swap));
        case ScalarType::F32:
            return static_cast<double>(load_as<float>(p, swap));
        case ScalarType::F64:
            break;
    }
    return load_as<double>(p, swap);
}

/// Is this machine's byte order big endian?
inline bool is_big_endian_machine()
{
    const uint16_t one = 1;
    char first;
    std::memcpy(&first, &one, 1);
    return first == 0;
}

}  // namespace mp2p_icp
