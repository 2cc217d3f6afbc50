#pragma once

#include <mp2p_icp/random.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string>

/// Seeded damage to the bytes of a file.
namespace mp2p_icp_test
{
/// Overwrites 1, 2, 4 or 8 bytes with the kind of number that breaks parsers.
inline void inflate_a_number(std::string& s, mp2p_icp::SeededRandom& random)
{
    const size_t size = size_t(1) << random.index(4), at = random.index(s.size());
    const uint64_t numbers[] = {
        UINT64_MAX, INT64_MAX, 0x7fffffff7fffffffull, 0, 0x8000000080000000ull, 0x0fffffff0fffffffull,
        random()};
    const uint64_t number = numbers[random.index(std::size(numbers))];
    for (size_t i = 0; i < size && at + i < s.size(); i++) s[at + i] = static_cast<char>(number >> (8 * i));
}

/// Replaces a run of digits by a large number.
inline void inflate_a_text_number(std::string& s, mp2p_icp::SeededRandom& random)
{
    const auto at = s.find_first_of("0123456789", random.index(s.size()));
    if (at == std::string::npos) return;
    const auto end = s.find_first_not_of("0123456789", at);
    const char* numbers[] = {"4294967295", "18446744073709551615", "-1", "99999999999999999999999", "1e308",
                             "0",          "2147483648",           "x"};
    s.replace(at, (end == std::string::npos ? s.size() : end) - at,
              numbers[random.index(std::size(numbers))]);
}

inline std::string mutated(std::string s, mp2p_icp::SeededRandom& random)
{
    const size_t changes = 1 + random.index(3);
    for (size_t c = 0; c < changes && !s.empty(); c++)
    {
        const size_t at = random.index(s.size()),
                     length = 1 + random.index(std::min<size_t>(32, s.size() - at));
        switch (random.index(7))
        {
            case 0:
                s[at] = static_cast<char>(s[at] ^ (1 << random.index(8)));
                break;
            case 1:
                s[at] = static_cast<char>(random.index(256));
                break;
            case 2:
                s.resize(at);
                break;
            case 3:
                inflate_a_number(s, random);
                break;
            case 4:
                inflate_a_text_number(s, random);
                break;
            case 5:
                s.erase(at, length);
                break;
            default:
                s.insert(at, s.substr(random.index(s.size()), length));
                break;
        }
    }
    return s;
}
}  // namespace mp2p_icp_test
