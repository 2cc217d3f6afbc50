#pragma once

#include <gtest/gtest.h>
#include <mrpt/containers/yaml.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace mp2p_icp_test
{
inline size_t occurrences(const std::string& text, const std::string& part)
{
    size_t n = 0;
    for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) n++;
    return n;
}

inline bool has(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

/// What stands between two texts; empty if they are not there.
inline std::string between(const std::string& text, const std::string& begin, const std::string& end)
{
    const auto from = text.find(begin);
    if (from == std::string::npos) return {};
    const auto to = text.find(end, from + begin.size());
    return to == std::string::npos ? std::string()
                                   : text.substr(from + begin.size(), to - from - begin.size());
}

inline std::string decoded_base64(const std::string& text)
{
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    uint32_t bits = 0;
    int count = 0;
    for (const char c : text)
    {
        if (c == '=') break;
        const auto value = letters.find(c);
        if (value == std::string::npos) ADD_FAILURE() << "not base64: " << c;
        bits = bits << 6u | static_cast<uint32_t>(value);
        count += 6;
        if (count < 8) continue;
        count -= 8;
        out += static_cast<char>(bits >> count & 0xFFu);
    }
    return out;
}

/// The points of packed floats.
inline std::vector<mrpt::math::TPoint3D> decoded_points(const std::string& base64)
{
    const std::string bytes = decoded_base64(base64);
    std::vector<float> numbers(bytes.size() / sizeof(float));
    if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(float));
    EXPECT_EQ(bytes.size() % (3 * sizeof(float)), 0u);
    std::vector<mrpt::math::TPoint3D> points;
    for (size_t i = 0; i + 2 < numbers.size(); i += 3)
        points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    return points;
}

inline mrpt::math::TPoint3D point_of(const mrpt::containers::yaml& list)
{
    return {list(0).as<double>(), list(1).as<double>(), list(2).as<double>()};
}

/// What the script of a page draws, read as YAML, of which JSON is a part.
inline mrpt::containers::yaml scene_of(const std::string& page)
{
    const std::string json = between(page, "<script type=\"application/json\" id=\"scene\">", "</script>");
    EXPECT_FALSE(json.empty());
    return mrpt::containers::yaml::FromText(json);
}
}  // namespace mp2p_icp_test
