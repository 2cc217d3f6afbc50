#pragma once

#include <charconv>
#include <cmath>
#include <string>

namespace mp2p_icp_apps::experiments
{
/// So many significant digits, the same in every locale; `nan`, `inf`, `-inf` where there is no number.
inline std::string number_text(double value, int digits = 7)
{
    if (std::isnan(value)) return "nan";
    char buffer[40];
    const auto end =
        std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::general, digits).ptr;
    return std::string(buffer, end);
}

}  // namespace mp2p_icp_apps::experiments
