#pragma once

#include <cmath>
#include <optional>
#include <string>

namespace mp2p_icp
{
/// The shortest text that reads back as the same double (at most 17 significant digits, or all of a large
/// whole number); `.inf`, `-.inf`, `.nan` as YAML writes them.
std::string to_text(double value);

/// Reads a whole text as a number, whatever the locale; `.inf` and `.nan` are understood. Empty if it is not
/// a number.
std::optional<double> to_number(const std::string& text);

}  // namespace mp2p_icp
