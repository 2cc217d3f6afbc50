#pragma once

#include <cstddef>
#include <string>

namespace mp2p_icp
{
/// The text as it may stand in HTML, also in an attribute between double quotes. Control characters, which
/// HTML does not allow, and bytes that are not UTF-8 become U+FFFD.
std::string html_escaped(const std::string& text);

/// The text as a string of JSON, with its quotes, that may stand inside of a <script>.
std::string json_string(const std::string& text);

std::string base64(const void* bytes, size_t count);

/// \name Numbers for people; `–` for one that is not finite, `∞` for an infinite one
///@{
std::string fixed_text(double value, int decimals);
/// With so many significant digits.
std::string rounded_text(double value, int digits);
/// With a unit that suits it: nm, µm, mm, m or km.
std::string distance_text(double metres);
std::string degrees_text(double radians);
/// With groups of three digits apart.
std::string count_text(size_t count);
///@}

}  // namespace mp2p_icp
